"""The documents are read as a reader reads them, and what they show is typed as shown."""

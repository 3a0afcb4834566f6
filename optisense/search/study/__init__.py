"""A study: one search with all its trials, in a folder or in memory, and the loop that runs it."""

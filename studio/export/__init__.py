"""Out of the studio: a report, and files for the workshop."""

"""What parts are made of, and the coating."""

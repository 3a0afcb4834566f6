"""Searching for a better sensor."""

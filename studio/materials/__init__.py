"""Panels of materials and the coating."""

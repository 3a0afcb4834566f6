"""Lights and the camera."""

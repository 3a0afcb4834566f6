"""Reconstruction from a picture: tilts of the skin from colours, and depth from tilts."""

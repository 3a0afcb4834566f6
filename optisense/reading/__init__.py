"""What a picture tells a reader: tilts of the skin from colours, and depth from tilts."""

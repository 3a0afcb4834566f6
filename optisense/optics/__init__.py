"""The one package that knows the renderer: from a design to a tactile image."""

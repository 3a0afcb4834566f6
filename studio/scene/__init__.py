"""A sensor design as Blender objects: the data model, and the way there and back."""

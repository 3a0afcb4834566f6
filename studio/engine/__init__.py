"""The one engine of this Blender, and the jobs that it works on."""

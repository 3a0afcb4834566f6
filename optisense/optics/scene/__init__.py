"""The scene: media, surfaces, BSDFs, emitters, and the ray scene made of them.

`assembly.assemble` converts a design to the pieces of the scene, with the media on both sides of
each face, and `ray_scene.RayScene` intersects rays with them.
"""

"""The scene: media, surfaces, BSDFs, emitters, and the ray scene made of them.

A design comes in; `assembly.assemble` gives the pieces of the scene, with the media on both sides
of each face, and `ray_scene.RayScene` intersects rays with them.
"""

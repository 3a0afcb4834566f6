"""Shapes: meshes, references, parts, cages."""

"""Meshes, cages, indenters, and where and how deep a contact sits."""

from optisense.geometry.mesh import TriangleMesh

__all__ = ["TriangleMesh"]

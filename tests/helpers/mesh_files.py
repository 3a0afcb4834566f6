"""Mesh files of known content."""

from __future__ import annotations


def triangle_ply(corners: str) -> str:
    """Return the text of a PLY file of three vertices and one face, such as "0 1 2"."""
    return (
        "ply\nformat ascii 1.0\nelement vertex 3\n"
        "property float x\nproperty float y\nproperty float z\n"
        "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
        f"0 0 0\n9 0 0\n0 9 0\n3 {corners}\n"
    )

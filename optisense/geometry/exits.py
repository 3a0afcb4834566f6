"""Where straight lines that start on a gel leave it, through all solids that it consists of."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from optisense.array_types import FloatArray, IntArray
from optisense.geometry.mesh import TriangleMesh
from optisense.geometry.rays import ray_hits

GLUE = 0.05
"""Largest distance (mm) between the faces of a gel and of another layer of it or a part that holds
it: the thickness of a film of glue, and more than the difference of two meshes of one curved
surface."""

NEAREST = 1e-3
"""Distance (mm) behind the skin below which a face counts as the skin itself: half of the distance
below which faces touch."""

GRAZING = 1e-6
"""Cosine between a line and the normal of a face up to which the face is parallel to the line, as
the side of a gel below a point of its border: far above the rounding of double precision."""


def exits(solids: Sequence[TriangleMesh], starts: FloatArray, ways: FloatArray) -> FloatArray:
    """Return the distances (n,), mm, at which lines leave the first solid that they leave, or the
    last of those that follow it without a gap above `GLUE`; infinite if they leave none.

    Layers of a gel thus count as one body, whether their meshes touch, overlap or differ a little
    at a curved face between them. A gap within a single solid always ends it.

    Args:
        solids: at least one mesh, mm, with outward face normals.
        starts: (n, 3) points of the skin, mm.
        ways: (n, 3) unit vectors into the gel.
    """
    found = [_stretches(solid, starts, ways) for solid in solids]
    line, start, end = (np.concatenate(parts) for parts in zip(*found, strict=True))
    result = np.full(len(starts), np.inf)
    behind = end > NEAREST
    np.minimum.at(result, line[behind], end[behind])
    goes_on = len(solids) > 1
    while goes_on:
        further = (start <= result[line] + GLUE) & (end > result[line])
        np.maximum.at(result, line[further], end[further])
        goes_on = bool(further.any())
    return result


def _stretches(
    solid: TriangleMesh, starts: FloatArray, ways: FloatArray
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return the stretches of lines inside a solid: the numbers (k,) of their lines, and the
    distances (k,) at which they start and end, mm.

    A stretch without an entry starts at minus infinity, and one without an exit ends at infinity.
    """
    hits = ray_hits(solid, starts, ways)
    cosine = np.einsum("ki,ki->k", solid.face_normals[hits.face], ways[hits.ray])
    steep = np.abs(cosine) > GRAZING
    line, distance, leaves = hits.ray[steep], hits.distance[steep], cosine[steep] > 0.0
    same = line[1:] == line[:-1]
    before = np.where(np.append(False, same), np.append(-np.inf, distance[:-1]), -np.inf)
    kept = leaves | ~np.append(same, False)
    start = np.where(leaves, before, distance)
    end = np.where(leaves, distance, np.inf)
    return line[kept], start[kept], end[kept]

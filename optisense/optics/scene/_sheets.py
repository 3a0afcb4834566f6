"""The media on both sides of opaque sheets."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from optisense.geometry import TriangleMesh
from optisense.optics.scene._solids import PROBE, Solid, solid_at
from optisense.optics.scene.ray_scene import Piece


def media_beside(sheet: Piece, solids: Sequence[Solid], each: bool) -> NDArray[np.int64]:
    """Return the numbers (m, 2) of the solids in front of and behind each face of an opaque sheet;
    -1 for air.

    Args:
        each: whether they are looked up beside the middle of the largest face of each flat or
            smooth patch; else beside that of the largest face of all.
    """
    corners = sheet.vertices[sheet.faces]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(cross, axis=1)
    normals = cross / np.where(size > 0, size, 1.0)[:, None]
    patch = np.zeros(len(corners), dtype=np.int64)
    if each and sheet.normals is None:  # parallel flat faces may lie at several levels
        level = np.round(np.einsum("fi,fi->f", normals, corners[:, 0]) / PROBE).astype(np.int64)
        levels = np.stack([sheet.patches, level], axis=1)
        patch = np.unique(levels, axis=0, return_inverse=True)[1].reshape(-1)
    elif each:
        patch = sheet.patches
    falling = np.argsort(-size, kind="stable")
    largest = falling[np.unique(patch[falling], return_index=True)[1]]
    middle, off = corners[largest].mean(axis=1), PROBE * normals[largest]
    sides = [solid_at(middle + off, solids), solid_at(middle - off, solids)]
    return np.stack(sides, axis=1)[patch]


def split_by_media(
    mesh: TriangleMesh, beside: NDArray[np.int64]
) -> list[tuple[tuple[int, int], TriangleMesh]]:
    """Return the parts of a sheet that lie between two media each, with the numbers of these.

    Args:
        beside: numbers (m, 2) of the media, as of `media_beside`.
    """
    if (beside == beside[0]).all():
        return [((int(beside[0, 0]), int(beside[0, 1])), mesh)]
    pairs, kind = np.unique(beside, axis=0, return_inverse=True)
    return [
        (
            (int(front), int(back)),
            mesh.with_faces(mesh.faces[kind.reshape(-1) == number]).compacted(),
        )
        for number, (front, back) in enumerate(pairs)
    ]

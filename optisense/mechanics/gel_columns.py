"""Columns of hexahedra that model the gel around a contact, from the skin to the base."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from optisense.geometry import TriangleMesh
from optisense.geometry.rays import ray_hits
from optisense.mechanics.footprint import Footprint, outer_faces
from optisense.mechanics.height_map import heights, slopes

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

PITCH = 1.0 / 3.0
"""Distance of columns over the thickness of the gel. The effect of the gel's shape varies over
lengths of a thickness."""
REACH = 3.0
"""Distance from a footprint, in thicknesses, up to which the gel is modelled. Displacements of a
bonded gel are below 1 % there of those at half a thickness."""
MOST_COLUMNS = 33
"""Largest number of columns along a side, which bounds the time of a factorisation; columns are
wider around large contacts."""
LAYERS = 4
"""Number of elements from the skin to the base. With eight, corrections change by less than 2 %."""
FINER = 8
"""Number of steps between two columns in which the border of the skin is located."""
LEAST_UPRIGHT = 0.5
"""Cosine of the steepest slope of the skin against the tangent plane that is modelled, 60 degrees;
beyond it a dome's skin is too steep for columns over the tangent plane."""
TILE = 0.3
"""Side of the squares whose columns are traced together, over the longest column; it bounds the
number of faces that are tested."""
NEAREST_EXIT = 1e-3
"""Distance (mm) behind the skin below which a face counts as the skin itself."""
THINNEST, THICKEST = 0.15, 3.0
"""Smallest and largest length of a column, over the thickness under the contact; columns of other
lengths miss the base, as at the side of a gel."""


@dataclass(frozen=True, eq=False)
class GelColumns:
    """Columns over a regular grid of the tangent plane of a contact; lengths in mm, in its frame.

    Attributes:
        x, y: (columns,) and (rows,) coordinates of the grid.
        solid: (rows, columns) mask of the grid points that have a column.
        cells: (rows - 1, columns - 1) mask of the cells with gel between their four columns.
        held: (rows, columns) mask of the columns at the rim of the model, beyond which the gel
            continues; they are fixed.
        top: (rows, columns, 3) points of the skin.
        inward: (rows, columns, 3) unit normals of the skin, into the gel.
        length: (rows, columns) lengths of the columns along these normals.
        uneven: deviation of the gel from a flat layer near the contact, as a share of its
            thickness: the larger of the skin's height and the change of thickness; infinite if the
            gel ends there.
    """

    x: FloatArray
    y: FloatArray
    solid: BoolArray
    cells: BoolArray
    held: BoolArray
    top: FloatArray
    inward: FloatArray
    length: FloatArray
    uneven: float

    @property
    def pitch(self) -> float:
        """Distance (mm) between columns."""
        return float(self.x[1] - self.x[0])


def gel_columns(
    place: Footprint,
    loaded: tuple[float, float],
    skin: TriangleMesh,
    elastomers: Sequence[TriangleMesh],
) -> GelColumns | None:
    """Return the columns around a contact; None if there are too few for a body.

    Args:
        place: the footprint of the contact.
        loaded: half sides (mm) of the rectangle around the contact that carries loads.
        skin: the undeformed sensing surface, in the design's frame.
        elastomers: the gels under it.
    """
    thickness = place.thickness
    halves = [half + REACH * thickness for half in loaded]
    pitch = max(PITCH * thickness, 2.0 * max(halves) / (MOST_COLUMNS - 1))
    across, along = (round(half / pitch) for half in halves)
    x = pitch * np.arange(-across, across + 1, dtype=np.float64)
    y = pitch * np.arange(-along, along + 1, dtype=np.float64)
    pose = np.eye(4)
    pose[:3, :3] = place.axes.T
    pose[:3, 3] = -place.axes.T @ place.origin
    local = skin.vertex_normals().transformed(pose)
    fine_x, fine_y = (
        g[0] + pitch / FINER * np.arange(FINER * (len(g) - 1) + 1, dtype=np.float64) for g in (x, y)
    )
    fine = heights(outer_faces(local, fine_x, fine_y), fine_x, fine_y, highest=True)
    height = np.where(np.isfinite(fine), fine, np.nan)[::FINER, ::FINER]
    inward = _inward(height, pitch)
    there = np.asarray(np.isfinite(inward).all(axis=2))
    there, steps, inward = _to_the_border(there, np.isfinite(fine), inward)
    row, column = (FINER * each for each in np.indices(there.shape))
    row, column = row + steps[1], column + steps[0]
    at = np.where(there, fine[row, column], 0.0)
    top = np.stack([fine_x[column], fine_y[row], np.where(np.isfinite(at), at, 0.0)], axis=2)
    there &= np.isfinite(at)
    length = np.full(height.shape, np.inf)
    steep = there & (-inward[:, :, 2] < LEAST_UPRIGHT)
    bodies = [mesh.transformed(pose) for mesh in elastomers]
    length[there] = _lengths(top[there], inward[there], bodies, THICKEST * thickness)
    fits = there & (length > THINNEST * thickness) & np.isfinite(length)
    good = fits & ~steep
    cells = good[:-1, :-1] & good[:-1, 1:] & good[1:, :-1] & good[1:, 1:]
    cells &= ~_folded(top, inward, np.where(good, length, 0.0))
    found = _around_the_middle(cells)
    if found is None:
        return None
    solid, cells = found
    goes_on = np.pad(np.zeros_like(solid), 1, constant_values=True)
    goes_on[1:-1, 1:-1] = fits & steep
    held = solid & ndimage.binary_dilation(goes_on, np.ones((3, 3)))[1:-1, 1:-1]
    return GelColumns(
        x,
        y,
        solid,
        cells,
        held,
        top,
        inward,
        length,
        _uneven(thickness, loaded, top, length, solid, held),
    )


def _to_the_border(
    there: BoolArray, fine: BoolArray, inward: FloatArray
) -> tuple[BoolArray, NDArray[np.int64], FloatArray]:
    """Move the outermost columns to the border of the skin.

    A column that is less than half a pitch from the border moves there; elsewhere a column is
    added.

    Args:
        there: (rows, columns) mask of the grid points that have skin.
        fine: the same mask on a grid `FINER` times as fine.
        inward: (rows, columns, 3) unit normals.

    Returns:
        The mask (rows, columns) of columns, their displacement (2, rows, columns) along x and y in
        steps of the fine grid, and their normals.
    """
    there, inward = there.copy(), inward.copy()
    steps = np.zeros((2, *there.shape), dtype=np.int64)
    for axis in (0, 1):  # along x, along y
        for way in (1, -1):
            ends = np.roll(there, -way, 1 - axis)
            rim: list[slice | int] = [slice(None), slice(None)]
            rim[1 - axis] = -1 if way > 0 else 0
            ends[tuple(rim)] = True
            for row, column in zip(*np.nonzero(there & ~ends), strict=True):
                spot = [FINER * row + steps[1, row, column], FINER * column + steps[0, row, column]]
                along = FINER * (column, row)[axis]
                line = fine[spot[0], :] if axis == 0 else fine[:, spot[1]]
                ahead = line[along : along + FINER + 1] if way > 0 else line[along::-1][: FINER + 1]
                room = int(np.argmin(ahead)) - 1 if not ahead.all() else FINER
                if room <= FINER // 2:
                    steps[axis, row, column] = way * max(room, 0)
                    continue
                beside = (row, column + way) if axis == 0 else (row + way, column)
                there[beside] = True
                inward[beside] = inward[row, column]
                steps[:, beside[0], beside[1]] = steps[:, row, column]
                steps[axis, beside[0], beside[1]] = way * (room - FINER)
    return there, steps, inward


def _inward(height: FloatArray, pitch: float) -> FloatArray:
    """Return the unit normals (rows, columns, 3) into the gel, from one-sided slopes at borders."""
    by_x, by_y = slopes(height, pitch)
    normals = np.stack([by_x, by_y, -np.ones_like(height)], axis=2)
    return np.asarray(normals / np.linalg.norm(normals, axis=2, keepdims=True))


def _lengths(
    starts: FloatArray, ways: FloatArray, bodies: Sequence[TriangleMesh], longest: float
) -> FloatArray:
    """Return the distance (n,), mm, from points of the skin to the exit of straight lines from the
    gel; infinite if there is none.
    """
    result = np.full(len(starts), np.inf)
    tiles = np.floor(starts[:, :2] / (TILE * longest)).astype(np.int64)
    _, tile = np.unique(tiles, axis=0, return_inverse=True)
    order = np.argsort(tile.ravel(), kind="stable")
    groups = np.split(order, np.flatnonzero(np.diff(tile.ravel()[order])) + 1)
    for body in bodies:
        lowest, highest = body.triangles.min(axis=1), body.triangles.max(axis=1)
        leaves = body.face_normals
        for group in groups:
            ends = np.concatenate([starts[group], starts[group] + longest * ways[group]])
            near = ((highest >= ends.min(axis=0)) & (lowest <= ends.max(axis=0))).all(axis=1)
            # Only faces that the lines can leave through are tested; the skin itself is met from
            # behind.
            near &= leaves @ ways[group].mean(axis=0) > 0.0
            if not near.any():
                continue
            part = TriangleMesh(body.vertices, body.faces[near])
            hits = ray_hits(part, starts[group], ways[group])
            far = (hits.distance > NEAREST_EXIT) & (hits.distance <= longest)
            np.minimum.at(result, group[hits.ray[far]], hits.distance[far])
    return result


def _folded(top: FloatArray, inward: FloatArray, length: FloatArray) -> BoolArray:
    """Return a mask (rows - 1, columns - 1) of the cells whose columns cross, as some do where the
    skin ends.

    A cell is valid if its area, seen along its columns, has the same sign at all its corners, on
    the skin and on the base.
    """
    folded = np.zeros((top.shape[0] - 1, top.shape[1] - 1), dtype=bool)
    for share in (0.0, 1.0):
        at = top + share * length[..., None] * inward
        low, right = at[:-1, :-1], at[:-1, 1:]
        left, high = at[1:, :-1], at[1:, 1:]
        corners = (
            (right - low, left - low, inward[:-1, :-1]),
            (right - low, high - right, inward[:-1, 1:]),
            (high - left, left - low, inward[1:, :-1]),
            (high - left, high - right, inward[1:, 1:]),
        )
        for along, across, way in corners:
            volume = -np.einsum("rci,rci->rc", np.cross(along, across), way)
            folded |= ~(volume > 0.0)
    return folded


def _around_the_middle(cells: BoolArray) -> tuple[BoolArray, BoolArray] | None:
    """Return the cells that are connected with the middle, and their columns; None if there are
    none.
    """
    labels, count = ndimage.label(cells)
    if count == 0:
        return None
    rows, columns = np.nonzero(cells)
    middle = (np.array(cells.shape) - 1) / 2
    nearest = int(np.argmin((rows - middle[0]) ** 2 + (columns - middle[1]) ** 2))
    chosen = labels == labels[rows[nearest], columns[nearest]]
    solid = np.zeros((cells.shape[0] + 1, cells.shape[1] + 1), dtype=bool)
    for row in (slice(None, -1), slice(1, None)):
        for column in (slice(None, -1), slice(1, None)):
            solid[row, column] |= chosen
    return solid, chosen


def _uneven(
    thickness: float,
    loaded: tuple[float, float],
    top: FloatArray,
    length: FloatArray,
    solid: BoolArray,
    held: BoolArray,
) -> float:
    """Return the deviation of the gel from a flat layer within a thickness of the loads (see
    `GelColumns.uneven`).
    """
    near = np.ones(solid.shape, dtype=bool)
    for axis, half in enumerate(loaded):
        near &= np.abs(top[:, :, axis]) <= half + thickness
    if not (solid[near].all() and near.any()) or (held & near).any():
        return np.inf
    height = np.abs(top[near][:, 2]).max()
    change = np.abs(length[near] - thickness).max()
    return float(max(height, change) / thickness)

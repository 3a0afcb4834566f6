"""Columns of hexahedra that model the gel around a contact, from the skin to the base."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy import ndimage

from optisense.array_types import BoolArray, FloatArray, IntArray
from optisense.geometry import TriangleMesh
from optisense.geometry.patches import sides_of_faces
from optisense.geometry.rays import exits
from optisense.mechanics._footprint import Footprint, outer_faces
from optisense.mechanics._height_map import heights, slopes

PITCH = 1.0 / 3.0
"""Distance of columns under a contact over the thickness of the gel. The effect of the gel's shape
varies over lengths of a thickness."""
NEAR = 2.0
"""Distance from the loads, in pitches, up to which columns are a pitch apart; farther out, where
displacements vary more slowly, their distance grows."""
GROWTH = 0.5
"""Increase of the distance of columns from one to the next, in pitches. With 0.25, forces change by
less than 0.1 %, and a press at a new place takes a tenth more time."""
WIDEST = 1.5
"""Largest distance of columns, in pitches: half a thickness, over which displacements far from the
loads vary little."""
REACH = 3.0
"""Distance from a footprint, in thicknesses, up to which the gel is modelled. Displacements of a
bonded gel are below 1 % there of those at half a thickness."""
MOST_COLUMNS = 33
"""Largest number of columns along a side, which bounds the time of a factorisation; columns are
wider around large contacts."""
LAYERS = 4
"""Number of elements from the skin to the base. With eight, corrections change by less than 2 %."""
FINER = 8
"""Number of steps between two columns in which skin is looked for: a sixth of a millimetre on
GelSight Mini. Between the last point with skin and the next one, its border is that of its mesh."""
NARROWEST = 0.02
"""Least distance of the border of the skin from a column, over the distance of columns, at which a
column is added there; nearer, the column moves to the border. With a tenth, forces jump by 1 %."""
LEAST_UPRIGHT = 0.5
"""Cosine of the steepest slope of the skin against the tangent plane that is modelled, 60 degrees;
beyond it a dome's skin is too steep for columns over the tangent plane."""
TILE = 2.0
"""Side of the cubes whose columns are traced together, over the longest column. It bounds the
number of faces that are tested: those within three lengths of a column."""
LEAST_LEAVING = -0.5
"""Smallest cosine between the normal of a face and the mean direction of the lines of a tile at
which the face is tested. Lines leave the base of a gel nearly at right angles, and single lines of
a tile differ from their mean by up to 60 degrees; the skin itself, which is left out, faces
them."""
ASIDE = 1e-6
"""Distance by which the lines of columns at the border of the gel start inside of it, over the
thickness: far above the rounding of double precision, and below any distance that matters."""
LACKING = 4
"""Number of columns on skin whose lack of elements counts. Fewer are left out at some corners, such
as those of the spherical GelSight Mini, where forces are smooth."""
THINNEST, THICKEST = 0.15, 3.0
"""Smallest and largest length of a column, over the thickness under the contact; columns of other
lengths miss the base, as at the side of a gel."""


@dataclass(frozen=True, eq=False)
class GelColumns:
    """Columns over a grid of the tangent plane of a contact; lengths in mm, in its frame.

    Attributes:
        x, y: (columns,) and (rows,) coordinates of the grid, which is regular under the contact.
        solid: (rows, columns) mask of the grid points that have a column.
        cells: (rows - 1, columns - 1) mask of the cells with gel between their four columns.
        held: (rows, columns) mask of the columns at the rim of the model, beyond which the gel
            continues; they are fixed.
        top: (rows, columns, 3) points of the skin.
        inward: (rows, columns, 3) unit normals of the skin, into the gel.
        length: (rows, columns) lengths of the columns along these normals.
        uneven: deviation of the gel from a flat layer near the contact, as a share of its
            thickness: the larger of the skin's height and the change of thickness.
        room: distance (mm) of the loads from where the gel ends, or the model of it does.
        left_out: distance (mm) of the loads from skin on which `LACKING` columns have no
            elements, as they cross others or leave the gel through a side that leans under the
            skin; infinite if there are not as many.
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
    room: float
    left_out: float

    @property
    def pitch(self) -> float:
        """Distance (mm) between columns under the contact."""
        return float(np.diff(self.x).min())


def gel_columns(
    place: Footprint,
    loaded: tuple[float, float],
    skin: TriangleMesh,
    elastomers: Sequence[TriangleMesh],
) -> GelColumns | None:
    """Return the columns around a contact, of which a rectangle with half sides ``loaded`` (mm)
    carries loads; None if there are too few for a body.
    """
    thickness = place.thickness
    halves = [half + REACH * thickness for half in loaded]
    pitch = max(PITCH * thickness, 2.0 * max(halves) / (MOST_COLUMNS - 1))
    at_x, at_y = (
        _graded(half / pitch + NEAR, outer / pitch)
        for half, outer in zip(loaded, halves, strict=True)
    )
    step = pitch / FINER
    fine_x, fine_y = (step * np.arange(2 * at[-1] + 1) - step * at[-1] for at in (at_x, at_y))
    at_x, at_y = at_x + at_x[-1], at_y + at_y[-1]
    pose = np.eye(4)
    pose[:3, :3] = place.axes.T
    pose[:3, 3] = -place.axes.T @ place.origin
    local = skin.vertex_normals().transformed(pose)
    fine = heights(outer_faces(local, fine_x, fine_y), fine_x, fine_y, highest=True)
    fine[~np.isfinite(fine) | _walls(fine, step)] = np.nan
    inward = _inward(fine, at_x, at_y, pitch)
    there = np.asarray(np.isfinite(inward).all(axis=2))
    edges = np.zeros((0, 2, 3)) if there.all() else _border(skin, place)
    there, top, inward = _to_the_border(there, fine, inward, (at_x, at_y), (fine_x, fine_y), edges)
    there &= np.isfinite(top[:, :, 2])
    top[~there, 2] = 0.0
    length = np.full(there.shape, np.inf)
    steep = there & (-inward[:, :, 2] < LEAST_UPRIGHT)
    inside = top + ASIDE * thickness * _away_from_the_border(there)
    starts = place.origin + inside[there] @ place.axes.T
    ways = inward[there] @ place.axes.T
    length[there] = _lengths(starts, ways, elastomers, THICKEST * thickness)
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
    lacking = np.sort(_away(top, loaded)[there & ~steep & ~solid])
    return GelColumns(
        fine_x[at_x],
        fine_y[at_y],
        solid,
        cells,
        held,
        top,
        inward,
        length,
        *_shape(thickness, loaded, top, length, solid, held),
        float(lacking[LACKING - 1]) if len(lacking) >= LACKING else np.inf,
    )


def _graded(near: float, outer: float) -> IntArray:
    """Return the places of columns along an axis, in steps of the fine grid from the middle.

    Up to a distance ``near`` columns are one pitch apart; the last one is at ``outer`` (pitches).
    """
    inside = min(math.ceil(near), round(outer))
    left = round(outer) - inside
    widths: list[float] = []
    while sum(widths) < left:
        widths.append(min(1.0 + GROWTH * (len(widths) + 1), WIDEST))
    beyond = np.cumsum(widths) * (left / sum(widths)) if widths else np.zeros(0)
    half = np.concatenate([np.arange(inside + 1), inside + beyond])
    half = np.round(FINER * half).astype(np.int64)
    return np.concatenate([-half[:0:-1], half])


def _walls(fine: FloatArray, step: float) -> BoolArray:
    """Return a mask (rows, columns) of the points of a fine grid on steep skin that ends within a
    pitch, as at the side of a tray; the gel ends where such skin begins.

    Heights (mm) are minus infinity without skin, and ``step`` (mm) is the distance of the points.
    """
    found = np.zeros(fine.shape, dtype=bool)
    known = np.isfinite(fine)
    if known.all():
        return found
    steepest = step * math.sqrt(LEAST_UPRIGHT**-2 - 1.0)
    heights_there = np.where(known, fine, np.nan)
    for axis in (0, 1):
        rise = np.abs(np.diff(heights_there, axis=axis, prepend=np.nan, append=np.nan))
        before, after = np.delete(rise, -1, axis), np.delete(rise, 0, axis)
        steep = (before > steepest) | (after > steepest)
        found |= steep & ~((before <= steepest) | (after <= steepest))
    return found & (ndimage.minimum_filter(known, 2 * FINER + 1, mode="nearest") == 0)


@lru_cache(maxsize=8)
def _edges(skin: TriangleMesh) -> tuple[TriangleMesh, IntArray, IntArray]:
    """Return a skin with shared vertices, its edges (n, 2) by their vertices, and the faces (n, 2)
    beside each; -1 where there is none.
    """
    whole = skin.welded()
    ends, face = sides_of_faces(whole)
    again = np.zeros(len(ends), dtype=bool)
    again[1:] = (ends[1:] == ends[:-1]).all(axis=1)
    first = np.flatnonzero(~again)
    paired = np.append(again[1:], False)[first]
    beside = np.where(paired, face[np.minimum(first + 1, len(face) - 1)], -1)
    return whole, ends[first], np.stack([face[first], beside], axis=1)


def _border(skin: TriangleMesh, place: Footprint) -> FloatArray:
    """Return the ends (n, 2, 3), mm, of the edges at which skin ends that is not too steep, in the
    frame of a contact.
    """
    whole, ends, faces = _edges(skin)
    upright = np.append(-(whole.face_normals @ place.axes[:, 2]) >= LEAST_UPRIGHT, False)
    some = upright[faces[:, 0]] != upright[faces[:, 1]]
    return place.local(whole.vertices[ends[some]].reshape(-1, 3)).reshape(-1, 2, 3)


def _crossings(edges: FloatArray, axis: int, line: float) -> FloatArray:
    """Return the points (n, 3) at which edges (m, 2, 3) meet the plane of a line along x or y (0 or
    1), whose other coordinate is ``line`` (mm).
    """
    side = edges[:, :, 1 - axis] - line
    some = (side[:, 0] < 0.0) != (side[:, 1] < 0.0)
    side, edges = side[some], edges[some]
    share = side[:, 0] / (side[:, 0] - side[:, 1])
    return np.asarray(edges[:, 0] + share[:, None] * (edges[:, 1] - edges[:, 0]))


def _to_the_border(
    there: BoolArray,
    fine: FloatArray,
    inward: FloatArray,
    places: tuple[IntArray, IntArray],
    grid: tuple[FloatArray, FloatArray],
    edges: FloatArray,
) -> tuple[BoolArray, FloatArray, FloatArray]:
    """Add columns at the border of the skin, or move those that nearly stand there.

    Args:
        there: (rows, columns) mask of the grid points that have skin.
        fine: heights on the fine grid, mm; NaN where there is no skin.
        inward: (rows, columns, 3) unit normals.
        places: the columns and rows of the fine grid at which the grid points lie.
        grid: coordinates x and y of the fine grid, mm.
        edges: (n, 2, 3) ends of the edges at the border of the skin, mm.

    Returns:
        The mask (rows, columns) of columns, their points (rows, columns, 3) on the skin, mm, and
        their normals.
    """
    there, inward = there.copy(), inward.copy()
    known = np.isfinite(fine)
    step = float(grid[0][1] - grid[0][0])
    steps = np.zeros((2, *there.shape), dtype=np.int64)
    exact = np.full((*there.shape, 3), np.nan)
    for axis in (0, 1):  # along x, along y
        for way in (1, -1):
            ends = np.roll(there, -way, 1 - axis)
            rim: list[slice | int] = [slice(None), slice(None)]
            rim[1 - axis] = -1 if way > 0 else 0
            ends[tuple(rim)] = True
            for row, column in zip(*np.nonzero(there & ~ends), strict=True):
                spot = (
                    places[1][row] + steps[1, row, column],
                    places[0][column] + steps[0, row, column],
                )
                here = (column, row)[axis]
                along = places[axis][here]
                gap = abs(int(places[axis][here + way] - along))
                line = known[spot[0], :] if axis == 0 else known[:, spot[1]]
                ahead = line[along : along + gap + 1] if way > 0 else line[along::-1][: gap + 1]
                room = max(int(np.argmin(ahead)) - 1, 0) if not ahead.all() else gap
                aside = exact[row, column, 1 - axis]
                across = aside if np.isfinite(aside) else grid[1 - axis][spot[axis]]
                met = _crossings(edges, axis, float(across))
                away = way * (met[:, axis] - grid[axis][along]) / step
                found = np.flatnonzero((away > room - ASIDE) & (away < room + 1.0 + ASIDE))
                last = found[np.argmax(away[found])] if len(found) else None
                end = np.full(3, np.nan) if last is None else met[last]
                if (room if last is None else away[last]) <= NARROWEST * gap:
                    exact[row, column] = end
                    continue
                beside = (row, column + way) if axis == 0 else (row + way, column)
                there[beside] = True
                inward[beside] = inward[row, column]
                steps[:, beside[0], beside[1]] = steps[:, row, column]
                steps[axis, beside[0], beside[1]] = way * (room - gap)
                exact[beside] = end
    row, column = places[1][:, None] + steps[1], places[0] + steps[0]
    top = np.stack([grid[0][column], grid[1][row], fine[row, column]], axis=2)
    return there, np.where(np.isfinite(exact), exact, top), inward


def _away_from_the_border(there: BoolArray) -> FloatArray:
    """Return steps (rows, columns, 3) of -1, 0 or 1 along x and y from each grid point to the side
    with more columns; the third is 0.
    """
    steps = [np.sign(ndimage.sobel(np.where(there, 1.0, 0.0), k, mode="constant")) for k in (1, 0)]
    return np.stack([*steps, np.zeros(there.shape)], axis=2)


def _inward(fine: FloatArray, at_x: IntArray, at_y: IntArray, pitch: float) -> FloatArray:
    """Return the unit normals (rows, columns, 3) into the gel at some columns and rows of the fine
    grid, from differences of its heights (mm; NaN without skin) over a pitch (mm).
    """
    found = [slope[np.ix_(at_y, at_x)] for slope in slopes(fine, pitch, FINER)]
    normals = np.stack([*found, -np.ones_like(found[0])], axis=2)
    return np.asarray(normals / np.linalg.norm(normals, axis=2, keepdims=True))


def _lengths(
    starts: FloatArray, ways: FloatArray, bodies: Sequence[TriangleMesh], longest: float
) -> FloatArray:
    """Return the distance (n,), mm, from points of the skin to the exit of straight lines from the
    gel; infinite if there is none.
    """
    result = np.full(len(starts), np.inf)
    if not len(starts):
        return result
    tiles = np.floor(starts / (TILE * longest)).astype(np.int64)
    _, tile = np.unique(tiles, axis=0, return_inverse=True)
    order = np.argsort(tile.ravel(), kind="stable")
    groups = np.split(order, np.flatnonzero(np.diff(tile.ravel()[order])) + 1)
    for group in groups:
        way = ways[group]
        ends = np.concatenate([starts[group], starts[group] + longest * way])
        low, high = ends.min(axis=0), ends.max(axis=0)
        parts = []
        for body in bodies:
            lowest, highest = body.face_bounds
            near = ((highest >= low) & (lowest <= high)).all(axis=1)
            if len(bodies) == 1:
                # Lines leave through faces that point the same way; they meet the skin from behind.
                near &= body.face_normals @ way.mean(axis=0) > LEAST_LEAVING
            if near.any():
                parts.append(body.with_faces(body.faces[near]))
        if parts:
            found = exits(parts, starts[group], way)
            result[group] = np.where(found <= longest, found, np.inf)
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
    """Return the cells connected with the middle, and their columns; None if there are none."""
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


def _away(top: FloatArray, loaded: tuple[float, float]) -> FloatArray:
    """Return the distances (rows, columns), mm, of columns from the loaded rectangle along the
    farther axis; negative inside of it.
    """
    return np.asarray((np.abs(top[:, :, :2]) - loaded).max(axis=2))


def _shape(
    thickness: float,
    loaded: tuple[float, float],
    top: FloatArray,
    length: FloatArray,
    solid: BoolArray,
    held: BoolArray,
) -> tuple[float, float]:
    """Return the deviation of the gel from a flat layer within a thickness of the loads, and the
    distance (mm) of the loads from its border (see `GelColumns`).
    """
    away = _away(top, loaded)
    inner = ndimage.binary_erosion(solid, np.ones((3, 3)), border_value=1)
    room = float(away[held | (solid & ~inner)].min(initial=np.inf))
    near = solid & (away <= thickness)
    height = np.abs(top[near][:, 2]).max(initial=0.0)
    change = np.abs(length[near] - thickness).max(initial=0.0)
    return float(max(height, change) / thickness), room

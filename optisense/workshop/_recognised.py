"""Recognition of the construction of a mesh: a profile turned about an axis, an outline extruded
along an axis, a box deformed by a cage, or a dome of horizontal rings over a vertical wall.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.spatial import cKDTree

from optisense.array_types import FloatArray
from optisense.geometry import TriangleMesh
from optisense.geometry.connected import chains, connected_components
from optisense.geometry.patches import smoothly_joined

SAME = 1e-6
"""Largest difference of coordinates that count as equal, mm; files keep seven digits."""

FEWEST_CORNERS = 12
"""Smallest number of corners of a full turn; a body with fewer has flat sides on purpose."""

NEAR_AXIS = 0.05
"""Largest distance from the axis of a single vertex that counts as a pole, as a share of the
largest radius; poles may be moved off the axis."""


FEWEST_IN_RING = 8
"""Smallest number of corners of a ring, and twice the smallest number of rings of a dome."""

MOST_RINGS = 200
"""Largest number of rings; a mesh with more levels is not made of rings."""


@dataclass(frozen=True)
class Revolution:
    """Body of revolution.

    Attributes:
        axis: 0, 1 or 2 for x, y or z.
        centre: point of the axis, (3,) mm.
        profile: distance from the axis and position along it, (n, 2) mm; a closed outline ends on
            its first point.
    """

    axis: int
    centre: FloatArray
    profile: FloatArray


@dataclass(frozen=True)
class Extrusion:
    """Outline extruded along an axis.

    Attributes:
        axis: direction, 0, 1 or 2 for x, y or z.
        low, high: ends along the axis, mm.
        outlines: outlines (n, 2), mm, across the axis (y and z, z and x, or x and y); closed ones
            end on their first point. The first is the outer one, others are holes.
    """

    axis: int
    low: float
    high: float
    outlines: list[FloatArray]


@dataclass(frozen=True)
class Dome:
    """Dome over a vertical wall; its axis is z.

    Attributes:
        foot: z of the foot of the wall, mm.
        rings: corners (levels, n, 3) of the rings, from the upper end of the wall upward, mm;
            corner k of all rings is in about the same direction.
        top: top, (3,) mm.
    """

    foot: float
    rings: FloatArray
    top: FloatArray


def across(axis: int) -> tuple[int, int]:
    """Return the two other axes, in cyclic order."""
    return (axis + 1) % 3, (axis + 2) % 3


def turned(mesh: TriangleMesh) -> Revolution | None:
    """Return the profile of a body of revolution about x, y or z; None if the mesh is none."""
    for axis in (2, 0, 1):
        found = _turned_about(mesh, axis)
        if found is not None:
            return found
    return None


def _turned_about(mesh: TriangleMesh, axis: int) -> Revolution | None:
    i, j = across(axis)
    centre = np.zeros(3)
    for k in (i, j):  # the middle of a ring is the mean of its corners
        centre[k] = _axis_place(mesh.vertices, axis, k)
    flat = mesh.vertices[:, (i, j)] - centre[[i, j]]
    radius, along = np.linalg.norm(flat, axis=1), mesh.vertices[:, axis]
    if radius.max() < SAME:
        return None
    points = np.column_stack([radius, along])
    rings = _joined(points, SAME * 10.0)
    counts = np.bincount(rings)
    poles = (counts == 1) & (np.bincount(rings, radius) < NEAR_AXIS * radius.max())
    if (counts[~poles] < FEWEST_CORNERS).any() or len(set(counts[~poles].tolist())) != 1:
        return None
    angle = np.arctan2(flat[:, 1], flat[:, 0])
    for ring in np.flatnonzero(~poles):
        steps = np.diff(np.sort(angle[rings == ring]))
        if np.ptp(steps) > 1e-5:
            return None
    profile = np.array([points[rings == ring].mean(axis=0) for ring in range(len(counts))])
    profile[poles, 0] = 0.0
    # Sides between rings, in the order in which the normals point outward.
    where = rings[mesh.faces]
    sides = np.concatenate([where[:, [0, 1]], where[:, [1, 2]], where[:, [2, 0]]])
    loops = _loops(sides[sides[:, 0] != sides[:, 1]])
    if loops is None or len(loops) != 1 or len(set(loops[0])) != len(counts):
        return None
    return Revolution(axis, centre, profile[loops[0]])


def _axis_place(vertices: FloatArray, axis: int, k: int) -> float:
    """Return the position of the axis along another one, mm, if the largest ring is regular."""
    levels = np.unique(np.round(vertices[:, axis], 5))
    means = [vertices[np.abs(vertices[:, axis] - z) < 2e-5, k].mean() for z in levels[:64]]
    return float(np.median(means))


def _joined(points: FloatArray, distance: float) -> NDArray[np.int64]:
    """Return the group number of each point; points nearer than `distance` belong to one group."""
    grid = np.unique(np.round(points / distance).astype(np.int64), axis=0, return_inverse=True)
    cells, inverse = grid[0], np.asarray(grid[1]).reshape(-1)
    pairs = cKDTree(cells).query_pairs(1.5, output_type="ndarray")
    return connected_components(len(cells), pairs[:, 0], pairs[:, 1])[inverse]


def extrusion_of(mesh: TriangleMesh) -> Extrusion | None:
    """Return the outline of a prism, or of an open sheet, extruded along x, y or z; None if the
    mesh is none.

    A box is one, too; the axis with the most corners around it is used.
    """
    for axis in (2, 1, 0):
        found = extruded_along(mesh, axis)
        if found is not None:
            return found
    return None


def extruded_along(mesh: TriangleMesh, axis: int) -> Extrusion | None:
    """Return the outline extruded along one axis, or None."""
    normals = np.abs(mesh.face_normals[:, axis])
    areas = mesh.face_areas > 0.0
    upright = normals < 1e-5
    if not (upright | (normals > 1.0 - 1e-9))[areas].all():
        return None
    along = mesh.vertices[:, axis]
    low, high = float(along.min()), float(along.max())
    if high - low < SAME:
        return None
    caps = ~upright & areas
    ends = along[mesh.faces[caps]]
    if (
        caps.any()
        and not ((ends - low < SAME).all(axis=1) | (high - ends < SAME).all(axis=1)).all()
    ):
        return None
    # The sides' corners at the lower end, connected as the sides connect them there.
    bottom = along[mesh.faces] - low < SAME
    walls = upright & areas
    pairs = [
        mesh.faces[walls & bottom[:, a] & bottom[:, b]][:, [a, b]]
        for a, b in ((0, 1), (1, 2), (2, 0))
    ]
    sides = np.concatenate(pairs)
    if len(sides) == 0:
        return None
    loops = _loops(sides)
    if loops is None:
        return None
    i, j = across(axis)
    flat = mesh.vertices[:, (i, j)]
    outlines = [flat[loop] for loop in loops]
    wall_area = sum(float(np.linalg.norm(np.diff(o, axis=0), axis=1).sum()) for o in outlines)
    drawn = wall_area * (high - low)
    if abs(drawn - float(mesh.face_areas[walls].sum())) > 1e-6 * max(drawn, 1.0):
        return None
    closed = all((outline[0] == outline[-1]).all() for outline in outlines)
    if mesh.is_closed != (closed and bool(caps.any())) or (caps.any() and not mesh.is_closed):
        return None
    outlines.sort(key=lambda outline: -float(np.prod(np.ptp(outline, axis=0))))
    return Extrusion(axis, low, high, outlines)


def _loops(sides: NDArray[np.integer]) -> list[list[int]] | None:
    """Return outlines by their corners, closed ones with the first again at the end; None if more
    than two sides meet.
    """
    sides = np.unique(np.sort(sides, axis=1), axis=0)
    return None if np.bincount(sides.reshape(-1)).max(initial=0) > 2 else chains(sides)


def rims(mesh: TriangleMesh) -> list[list[int]] | None:
    """Return the loops of edges with one face, by their vertices, the first again at the end."""
    loops = _loops(mesh.open_edges)
    return None if loops is None or any(loop[0] != loop[-1] for loop in loops) else loops


def smooth_patches(mesh: TriangleMesh, sharp: float) -> list[NDArray[np.int64]]:
    """Return the faces of a mesh in patches separated by edges sharper than `sharp` degrees."""
    left = np.ones(len(mesh.faces), dtype=bool)
    found = []
    for face in range(len(mesh.faces)):
        if left[face]:
            patch = smoothly_joined(mesh, np.array([face]), sharp)
            left[patch] = False
            found.append(patch)
    return found


def box_sides(mesh: TriangleMesh) -> list[FloatArray]:
    """Return the corners (2, 2, 3) of each rectangle of a box, or of one rectangle, mm; empty if it
    is neither.

    The corners [0, 0], [0, 1], [1, 0], [1, 1] of a rectangle are seen anticlockwise from outside in
    the order [0, 0], [1, 0], [1, 1], [0, 1].
    """
    low, high = mesh.bounds
    size = high - low
    flat = size < SAME
    if mesh.is_closed:
        if abs(abs(mesh.volume) - float(np.prod(size))) > 1e-9 * float(np.prod(size)):
            return []
        axes = [(axis, sign) for axis in range(3) for sign in (-1, 1)]
    else:
        if flat.sum() != 1:
            return []
        (axis,) = np.flatnonzero(flat).tolist()
        i, j = across(axis)
        if abs(mesh.area - size[i] * size[j]) > 1e-9 * mesh.area:
            return []
        axes = [(axis, int(np.sign(mesh.face_normals[mesh.face_areas.argmax(), axis])))]
    found = []
    for axis, sign in axes:
        i, j = across(axis) if sign > 0 else across(axis)[::-1]
        corners = np.empty((2, 2, 3))
        corners[..., axis] = (high if sign > 0 else low)[axis]
        corners[0, :, i], corners[1, :, i] = low[i], high[i]
        corners[:, 0, j], corners[:, 1, j] = low[j], high[j]
        found.append(corners)
    return found


def dome(mesh: TriangleMesh) -> Dome | None:
    """Return the dome of a mesh, closed by a flat foot or open there; None if it is no dome."""
    level = np.round(mesh.vertices[:, 2], 6)
    levels = np.unique(level)
    if not FEWEST_IN_RING // 2 < len(levels) <= MOST_RINGS:
        return None
    tops = mesh.vertices[level == levels[-1]]
    if len(tops) != 1:
        return None
    middle = 0.5 * (mesh.bounds[0] + mesh.bounds[1])[:2]
    rings = [_around(mesh.vertices[level == z], middle) for z in levels[1:-1]]
    if min(len(ring) for ring in rings) < FEWEST_IN_RING:
        return None
    lowest = mesh.vertices[level == levels[0]][:, :2]
    for place in rings[0][:, :2]:  # the wall is vertical
        if np.abs(lowest - place).max(axis=1).min() > SAME:
            return None
    ways = _angles(rings[0], middle)
    if np.diff(ways).min() <= 0.0:
        return None
    even = np.array([_at(ring, ways, middle) for ring in rings])
    return Dome(float(levels[0]), even, tops[0])


def _angles(ring: FloatArray, middle: FloatArray) -> FloatArray:
    off = ring[:, :2] - middle
    return np.asarray(np.arctan2(off[:, 1], off[:, 0]))


def _around(ring: FloatArray, middle: FloatArray) -> FloatArray:
    """Return the corners of a ring in their order around its middle."""
    return ring[np.argsort(_angles(ring, middle))]


def _at(ring: FloatArray, ways: FloatArray, middle: FloatArray) -> FloatArray:
    """Return the points (n, 3), mm, in directions (n,), radians, from a middle (2,) of a smooth
    curve through a ring's corners (m, 3), mm, in their order around it.
    """
    reach = np.linalg.norm(ring[:, :2] - middle, axis=1)
    own = _angles(ring, middle)
    around = CubicSpline(
        np.append(own, own[0] + 2.0 * np.pi), np.append(reach, reach[0]), bc_type="periodic"
    )
    found = around(np.where(ways < own[0], ways + 2.0 * np.pi, ways))[:, None]
    way = np.column_stack([np.cos(ways), np.sin(ways)])
    return np.column_stack([middle + found * way, np.full(len(ways), ring[0, 2])])

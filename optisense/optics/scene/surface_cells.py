"""The cells of a uniform grid that a mesh passes through."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt
from scipy.spatial import cKDTree

from optisense.array_types import FloatingArray
from optisense.geometry.mesh_points import surface_samples
from optisense.optics.backend.arrays import floats, indices
from optisense.optics.scene.ray_scene import Piece
from optisense.optics.scene.surfaces import Region

SAMPLES_ACROSS = 7
"""Number of samples of the surface along the side of a cell. Seven give the cell's area to a few
per cent."""

CREASE_COSINE = 0.5
"""Largest cosine between normals at one grid place whose surface is divided into two cells, as at
an edge between a wall and a top: light from beside the wall reaches the top and not the wall. With
0.5, the normals differ by 60 degrees or more, which no smooth skin does within a cell."""

LEAST_EXTENT = 10.0
"""Extent (mm) of the sensing surface below which lengths such as the side of cells shrink with it.
On a pad of 10 mm, cells of 0.5 mm are accurate to 3 %; on one of 4 mm, they would be 20 % off."""

LARGE_EXTENT = 30.0
"""Extent (mm) of the sensing surface above which cells may grow with it where no lamp is near, so
that they do not become more: a surface of 80 mm has 20,000 of 0.5 mm. Below it, as on the built-in
sensors that a finger fits on, pictures are fast with small cells."""
SEARCH_CELLS = 3
"""Distance from the surface, in cell sides, within which a point still finds the nearest cell: 1.5
mm with cells of 0.5 mm, as presses are usually less than 1 mm deep."""


@dataclass
class SurfaceCells:
    """Cells of a uniform 3-D grid that surfaces pass through.

    Attributes:
        lower: lower corner of the grid, mm.
        inverse_size: inverse of the side of a cell, 1/mm.
        counts: number of grid places along each axis.
        index: number + 1 of the cell at each grid place (0: none).
        others: number of the second cell at the place of each cell, on the other side of a crease;
            the cell itself where there is none.
        creased: whether any place has two cells.
        cells: number of cells.
        planes: normal and offset of the plane of each cell, four floats.
        middles: centre of the surface in each cell, mm, four floats.
        centres: (cells, 3) the same centres.
        normals: (cells, 3) mean unit normal of the surface in each cell.
        areas: (cells,) area of the surface in each cell, mm^2.
        offset_growth: (cells, 2) coefficients a (1/mm) and b (1/mm^2) of the area of an offset
            surface: at the height h (mm) along the normals, it is 1 + a h + b h^2 times that of the
            surface (Steiner's formula; a is minus twice the mean curvature, b the Gaussian
            curvature).
        axes: (3, 3) frame of the direction bins, as rows.
        fineness: factor (1,), at most 1, on the heights above the surface in which light is
            tallied (see the function `fineness`).
    """

    lower: mi.Point3f
    inverse_size: mi.Float
    counts: mi.Vector3u
    index: mi.UInt32
    others: mi.UInt32
    creased: bool
    cells: int
    planes: mi.Float
    middles: mi.Float
    centres: FloatingArray
    normals: FloatingArray
    areas: FloatingArray
    offset_growth: FloatingArray
    axes: FloatingArray
    fineness: mi.Float


def fineness(pieces: Sequence[Piece]) -> float:
    """Return the factor, at most 1, on lengths that suit sensing surfaces of `LEAST_EXTENT` and
    more: the longest side of the box around the sensing surface over that length.
    """
    extent = _extent(pieces)
    return 1.0 if extent is None else min(1.0, extent / LEAST_EXTENT)


def coarseness(pieces: Sequence[Piece]) -> float:
    """Return the largest factor, at least 1, by which cells may be larger on a large sensing
    surface: the longest side of the box around it over `LARGE_EXTENT`.
    """
    extent = _extent(pieces)
    return 1.0 if extent is None else max(1.0, extent / LARGE_EXTENT)


def _extent(pieces: Sequence[Piece]) -> float | None:
    """Return the longest side (mm) of the box around the sensing surface; None without one."""
    skin = [piece.vertices for piece in pieces if piece.surface.region is Region.SENSING]
    return float(np.ptp(np.concatenate(skin), axis=0).max()) if skin else None


def _twice_areas(
    vertices: FloatingArray, faces: NDArray[np.integer]
) -> tuple[FloatingArray, FloatingArray]:
    """Return normals (m, 3) as long as twice the faces' areas (mm^2), and these lengths (m,)."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    cross = np.cross(b - a, c - a)
    return cross, np.linalg.norm(cross, axis=1)


def build_cells(
    vertices: FloatingArray,
    faces: NDArray[np.integer],
    size: float,
    normals: FloatingArray | None = None,
    fineness: float = 1.0,
) -> SurfaceCells:
    """Divide a mesh into cells.

    Args:
        vertices: (n, 3) mm.
        faces: (m, 3) indices of vertices.
        size: side (mm) of a cell.
        normals: (m, 3, 3) unit normals of the surface at the corners of each face, on the side of
            the normal of the face; None if all facets are flat.
        fineness: factor on the heights above the surface in which light is tallied.
    """
    vertices = np.asarray(vertices, dtype=np.float64)
    solid = _twice_areas(vertices, faces)[1] > 0.0  # others would give cells without area
    faces = faces[solid]
    points, face, areas = surface_samples(vertices, faces, size / SAMPLES_ACROSS)
    # The offset is not a round number, so that a plane of the design does not coincide with a
    # border between cells.
    lower = points.min(axis=1) - (0.37 + SEARCH_CELLS) * size
    counts = np.floor((points.max(axis=1) - lower) / size).astype(int) + 1 + SEARCH_CELLS
    x, y, z = (((points[k] - lower[k]) / size).astype(int) for k in range(3))
    place = x + counts[0] * (y + counts[1] * z)
    used, owner = np.unique(place, return_inverse=True)
    cross, length = _twice_areas(vertices, faces)
    upright = cross / np.maximum(length, 1e-30)[:, None]
    owner, other = _divided(np.asarray(owner).reshape(-1), points, upright[face], areas)
    cells = len(other)
    area, centre, normal = _means(owner, cells, points, upright[face], areas)
    growths = np.zeros((cells, 2))
    if normals is not None:
        growth = _growth(vertices[faces], normals[solid], upright)[face] * areas[:, None]
        growths = np.stack([np.bincount(owner, each, cells) for each in growth.T], axis=1)
        growths /= np.maximum(area, 1e-30)[:, None]
    index = _index(used, counts)

    lower3, counts3 = mi.Point3f(*lower.tolist()), mi.Vector3u(*counts.tolist())
    dr.make_opaque(lower3, counts3)
    four = np.zeros((cells, 4), dtype=np.float32)
    four[:, :3] = normal
    four[:, 3] = np.einsum("ij,ij->i", normal, centre)
    return SurfaceCells(
        lower=lower3,
        inverse_size=dr.opaque(mi.Float, 1 / size),
        counts=counts3,
        index=indices(index),
        others=indices(other),
        creased=cells > len(used),
        cells=cells,
        planes=floats(four),
        middles=floats(np.pad(centre.astype(np.float32), ((0, 0), (0, 1)))),
        centres=centre,
        normals=normal,
        areas=area,
        offset_growth=growths,
        axes=_frame(normal.sum(axis=0)),
        fineness=dr.opaque(mi.Float, fineness),
    )


def _growth(
    corners: FloatingArray, normals: FloatingArray, upright: FloatingArray
) -> FloatingArray:
    """Return the coefficients (m, 2) of `SurfaceCells.offset_growth` for each face.

    Args:
        corners, normals: (m, 3, 3) corners, mm, and unit normals of the surface there.
        upright: (m, 3) unit normals of the faces.
    """
    side, other = (corners[:, k] - corners[:, 0] for k in (1, 2))
    turn, other_turn = (normals[:, k] - normals[:, 0] for k in (1, 2))

    def area(one: FloatingArray, two: FloatingArray) -> FloatingArray:
        return np.asarray(np.einsum("mi,mi->m", np.cross(one, two), upright))

    linear = area(side, other_turn) + area(turn, other)
    return np.stack([linear, area(turn, other_turn)], axis=1) / area(side, other)[:, None]


def _means(
    owner: NDArray[np.int64],
    cells: int,
    points: FloatingArray,
    normals: FloatingArray,
    areas: FloatingArray,
) -> tuple[FloatingArray, FloatingArray, FloatingArray]:
    """Return areas (cells,), centres (cells, 3) and mean unit normals (cells, 3) of samples."""

    def total(values: FloatingArray) -> FloatingArray:
        return np.asarray(np.bincount(owner, values, cells), dtype=np.float64)

    area = total(areas)
    divisor = np.maximum(area, 1e-30)[:, None]
    centre = np.stack([total(areas * points[k]) for k in range(3)], axis=1) / divisor
    normal = np.stack([total(areas * normals[:, k]) for k in range(3)], axis=1)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    return area, centre, normal


def _divided(
    owner: NDArray[np.int64], points: FloatingArray, normals: FloatingArray, areas: FloatingArray
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Divide the places that a crease runs through into two cells.

    A sample belongs to the cell whose plane is nearer, as points do that look for their cell.

    Args:
        owner: number (n,) of the place of each sample.
        points, normals, areas: (3, n) place, (n, 3) normal and (n,) area of each sample.

    Returns:
        The cell (n,) of each sample, and the second cell at the place of each cell, itself if none.
    """
    count = int(owner.max()) + 1
    mean = _means(owner, count, points, normals, areas)[2]
    # Of two normals, one is at half their angle or more to any mean.
    bent = np.einsum("ij,ij->i", mean[owner], normals) < np.sqrt((1 + CREASE_COSINE) / 2)
    suspects, divided = np.unique(owner[bent]), owner.copy()
    number = np.full(count, -1)
    number[suspects] = np.arange(len(suspects))
    inside = np.flatnonzero(number[owner] >= 0)
    home, spots, ways = number[owner[inside]], points[:, inside], normals[inside]

    def farthest(seeds: FloatingArray) -> FloatingArray:
        """Return the normal at each place that differs most from its seed."""
        order = np.lexsort((np.einsum("ij,ij->i", seeds[home], ways), home))
        return np.asarray(ways[order[np.searchsorted(home[order], np.arange(len(suspects)))]])

    one = farthest(mean[suspects])
    two = farthest(one)
    beyond = home + len(suspects)
    towards = np.einsum("ij,ij->i", (one - two)[home], ways)
    halves = np.where(towards > 0, beyond, home)
    _, centre, normal = _means(halves, 2 * len(suspects), spots, ways, areas[inside])

    def away(cell: NDArray[np.int64]) -> FloatingArray:
        return np.asarray(np.abs(np.einsum("ij,ij->i", normal[cell], spots.T - centre[cell])))

    # Where all samples lie in one plane, as on the two sides of a sheet, the place stays one cell.
    other_side = away(beyond) < away(home)
    sides = (np.bincount(home, each, len(suspects)) > 0 for each in (other_side, ~other_side))
    creased = np.einsum("ij,ij->i", one, two) < CREASE_COSINE
    for side in sides:
        creased &= side
    first = suspects[creased]
    second = np.arange(count)
    second[first] = count + np.arange(len(first))
    divided[inside] = np.where(other_side, second[owner[inside]], owner[inside])
    return divided, np.concatenate([second, first])


def _index(used: NDArray[np.int64], counts: NDArray[np.int64]) -> NDArray[np.uint32]:
    """Return the number + 1 of the nearest cell to each grid place within SEARCH_CELLS, else 0."""
    numbers = np.zeros(int(np.prod(counts)), dtype=np.uint32)
    numbers[used] = np.arange(len(used)) + 1
    grid = numbers.reshape(counts[::-1])
    distance, nearest = distance_transform_edt(grid == 0, return_indices=True)
    near = np.where(distance <= SEARCH_CELLS, grid[tuple(nearest)], 0)
    return np.asarray(near.ravel(), dtype=np.uint32)


def _frame(z: FloatingArray) -> FloatingArray:
    z = z / np.linalg.norm(z) if np.linalg.norm(z) > 1e-6 else np.array([0.0, 0.0, 1.0])
    x = np.cross((1.0, 0.0, 0.0) if abs(z[0]) < 0.9 else (0.0, 1.0, 0.0), z)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z])


def bin_axis(cells: SurfaceCells, number: int) -> mi.Vector3f:
    """Return one axis of the frame of the direction bins.

    It is an opaque array, so that kernels do not depend on its values; otherwise every design with
    a slightly different surface would compile its own kernels.
    """
    return mi.Vector3f(*[dr.opaque(mi.Float, float(part)) for part in cells.axes[number]])


def cell_at(cells: SurfaceCells, point: mi.Point3f, active: mi.Bool) -> tuple[mi.UInt32, mi.Bool]:
    """Return the number of the cell that holds each point, and whether there is one.

    Of two cells beside a crease, it is that in whose plane the point lies.
    """
    relative = (point - cells.lower) * cells.inverse_size
    inside = mi.Bool(active)
    for i in range(3):
        inside &= (relative[i] >= 0) & (relative[i] < mi.Float(cells.counts[i]))
    x, y, z = (mi.UInt32(dr.maximum(relative[i], 0)) for i in range(3))
    found = dr.gather(mi.UInt32, cells.index, x + cells.counts.x * (y + cells.counts.y * z), inside)
    cell, inside = dr.maximum(found, 1) - 1, inside & (found > 0)
    if cells.creased:
        other = dr.gather(mi.UInt32, cells.others, cell, inside)
        away, beyond = (_distance(cells, each, point, inside) for each in (cell, other))
        cell = dr.select(beyond < away, other, cell)
    return cell, inside


def _distance(cells: SurfaceCells, cell: mi.UInt32, point: mi.Point3f, active: mi.Bool) -> mi.Float:
    """Return the distance (mm) of points from the planes of cells."""
    normal, offset = plane_of(cells, cell, active)
    return dr.abs(dr.dot(normal, point) - offset)


def plane_of(cells: SurfaceCells, cell: mi.UInt32, active: mi.Bool) -> tuple[mi.Vector3f, mi.Float]:
    """Return the unit normal and offset (mm) of the planes of cells: points x on a plane have
    dot(normal, x) = offset.
    """
    plane = dr.gather(mi.Vector4f, cells.planes, cell, active)
    return mi.Vector3f(plane.x, plane.y, plane.z), plane.w


def cells_near(
    cells: SurfaceCells, points: NDArray[np.floating], distance: float
) -> NDArray[np.bool_]:
    """Return a mask (cells,) of the cells whose centre lies within ``distance`` (mm) of any of the
    points (n, 3).
    """
    if len(points) == 0:
        return np.ones(cells.cells, dtype=bool)
    nearest, _ = cKDTree(points).query(cells.centres, distance_upper_bound=distance)
    return np.isfinite(nearest)

"""The cage: a lattice of control points that deforms whatever lies in its box.

Free-form deformation with a tensor product of Bernstein polynomials (Sederberg and Parry,
"Free-form deformation of solid geometric models", SIGGRAPH 1986). A lattice of n points along an
axis gives polynomials of degree n - 1: the shape is smooth everywhere, the corner points are
interpolated, and the lattice at rest leaves every point where it is (linear precision). A point in
the middle of a side moves the surface by less than its own displacement: of three points in a row,
the middle one has weight 1/2 at its own place.
"""

from __future__ import annotations

import math
import weakref

import numpy as np
from numpy.typing import ArrayLike

from optisense.array_types import FloatArray
from optisense.errors import DesignError
from optisense.geometry.mesh import TriangleMesh

Resolution = tuple[int, int, int]

OUTSIDE_TOLERANCE = 1e-6
"""Largest distance (mm) of a vertex outside the box: the rounding of coordinates in a mesh file of
single precision (2e-6 mm at 30 mm), and a distance that no part shows."""

MOST_KEPT_WEIGHTS = 4_000_000
"""Number of weights (vertices times control points) of a mesh above which they are computed again
instead of being kept: 32 MB, as for a mesh of 25,000 vertices in a cage of 160 points."""

_VALUES_AT_ONCE = 4_000_000
"""Number of products of basis functions that are computed together, which bounds the memory of the
arrays to 32 MB."""

_weights: weakref.WeakKeyDictionary[TriangleMesh, tuple[object, FloatArray]]
_weights = weakref.WeakKeyDictionary()
_last: weakref.WeakKeyDictionary[TriangleMesh, tuple[object, TriangleMesh]]
_last = weakref.WeakKeyDictionary()


def cage_points(box: ArrayLike, resolution: Resolution) -> FloatArray:
    """Return the control points of a cage at rest.

    Args:
        box: (2, 3) lower and upper corner, mm.
        resolution: number of points along x, y, z, at least 2 each.

    Returns:
        The points (nx * ny * nz, 3) float64, mm; x varies slowest, z fastest.
    """
    lower, upper = np.asarray(box, dtype=np.float64)
    axes = [np.linspace(lower[k], upper[k], resolution[k]) for k in range(3)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def cage_weights(vertices: ArrayLike, box: ArrayLike, resolution: Resolution) -> FloatArray:
    """Return the weight of each control point in the displacement of each vertex.

    Args:
        vertices: (n, 3) undeformed vertices, mm, all inside the box.
        box, resolution: the cage at rest; see `cage_points`.

    Returns:
        The weights (n, nx * ny * nz) float64; each row adds up to 1.

    Raises:
        DesignError: a vertex lies outside the box, where the polynomials grow without bound.
    """
    along = [
        bernstein(t, n) for t, n in zip(box_coordinates(vertices, box).T, resolution, strict=True)
    ]  # fmt: skip
    product = np.einsum("ni,nj,nk->nijk", *along, optimize=True)
    return product.reshape(len(product), -1)


def deform(weights: FloatArray, points: ArrayLike) -> FloatArray:
    """Return the deformed vertices (n, 3), mm, for `weights` (n, N) and points (N, 3), mm."""
    moved: FloatArray = weights @ np.asarray(points, dtype=np.float64).reshape(-1, 3)
    return moved


def deformed(
    mesh: TriangleMesh, box: ArrayLike, resolution: Resolution, points: ArrayLike
) -> TriangleMesh:
    """Return a mesh bent by its cage; shading normals are dropped.

    Two successive calls with the same arguments return the same object, so that its cached
    properties are reused.

    The weights are kept for the next call with the same mesh. For a fine cage around a large mesh
    there are too many weights, and each call computes them.

    Args:
        mesh: the mesh at rest, mm, all inside the box.
        box, resolution: the cage at rest; see `cage_points`.
        points: (nx * ny * nz, 3) control points, mm.

    Raises:
        DesignError: a vertex lies outside the box.
    """
    controls = np.asarray(points, dtype=np.float64).reshape(-1, 3)
    key = np.asarray(box, dtype=np.float64).tobytes(), resolution, controls.tobytes()
    last = _last.get(mesh)
    if last is None or last[0] != key:
        last = _last[mesh] = key, _bent(mesh, box, resolution, controls)
    return last[1]


def _bent(
    mesh: TriangleMesh, box: ArrayLike, resolution: Resolution, controls: FloatArray
) -> TriangleMesh:
    if len(mesh.vertices) * len(controls) <= MOST_KEPT_WEIGHTS:
        return mesh.with_vertices(deform(kept_weights(mesh, box, resolution), controls))
    share = box_coordinates(mesh.vertices, box)
    bases = [bernstein(share[:, k], resolution[k]) for k in range(3)]
    return mesh.with_vertices(contract(bases, controls, resolution))


def kept_weights(mesh: TriangleMesh, box: ArrayLike, resolution: Resolution) -> FloatArray:
    """Return the read-only `cage_weights` (n, nx * ny * nz) of the n vertices of a mesh at rest,
    which are kept for the next call with the same mesh.

    Raises:
        DesignError: a vertex lies outside the box.
    """
    key = np.asarray(box, dtype=np.float64).tobytes(), resolution
    kept = _weights.get(mesh)
    if kept is None or kept[0] != key:
        weights = np.asfortranarray(cage_weights(mesh.vertices, box, resolution))
        weights.flags.writeable = False
        kept = _weights[mesh] = key, weights
    return kept[1]


def box_coordinates(vertices: ArrayLike, box: ArrayLike) -> FloatArray:
    """Return the relative positions (n, 3) of vertices (n, 3), mm, in the box (2, 3), mm, 0 to 1
    along each axis.

    Raises:
        DesignError: a vertex lies outside the box.
    """
    points = np.asarray(vertices, dtype=np.float64).reshape(-1, 3)
    lower, upper = np.asarray(box, dtype=np.float64)
    outside = (points < lower - OUTSIDE_TOLERANCE) | (points > upper + OUTSIDE_TOLERANCE)
    if outside.any():
        rows = np.flatnonzero(outside.any(axis=1))
        x, y, z = points[rows[0]]
        raise DesignError(
            f"{len(rows)} vertices lie outside the box of the cage, "
            f"one of them at ({x:.3f}, {y:.3f}, {z:.3f}) mm",
            where="box from ({:.3f}, {:.3f}, {:.3f}) to ({:.3f}, {:.3f}, {:.3f}) mm".format(
                *lower, *upper
            ),
            hint="Let the box enclose every part that the cage deforms",
        )
    return ((points - lower) / (upper - lower)).clip(0.0, 1.0)


def bernstein(t: FloatArray, count: int) -> FloatArray:
    """Return the values (n, count) of the Bernstein polynomials of degree `count` - 1 at t (n,)."""
    i = np.arange(count)
    degree = count - 1
    binomial = np.array([math.comb(degree, k) for k in range(count)], dtype=np.float64)
    return np.asarray(binomial * t[:, None] ** i * (1.0 - t[:, None]) ** (degree - i))


def contract(bases: list[FloatArray], points: FloatArray, resolution: Resolution) -> FloatArray:
    """Return the sums (n, 3) over a lattice, without forming the product of its bases.

    Args:
        bases: (n, nx), (n, ny) and (n, nz) values of any basis functions.
        points: (nx * ny * nz, 3) coefficients.
        resolution: nx, ny, nz.
    """
    nx, ny, nz = resolution
    lattice = points.reshape(nx, ny * nz * 3)
    count = len(bases[0])
    result = np.empty((count, 3))
    step = max(1, _VALUES_AT_ONCE // (ny * nz * 3))
    for start in range(0, count, step):
        rows = slice(start, min(start + step, count))
        sheets = (bases[0][rows] @ lattice).reshape(-1, ny, nz * 3)
        lines = (bases[1][rows][:, None] @ sheets).reshape(-1, nz, 3)
        result[rows] = (bases[2][rows][:, None] @ lines)[:, 0]
    return result

"""The cage: a lattice of control points that deforms whatever lies in its box; stretch and folds.

Free-form deformation with a tensor product of Bernstein polynomials (Sederberg and Parry,
"Free-form deformation of solid geometric models", SIGGRAPH 1986). A lattice of n points along an
axis gives polynomials of degree n - 1: the shape is smooth everywhere, the corner points are
interpolated, and the lattice at rest leaves every point where it is (linear precision). A point in
the middle of a side moves the surface by less than its own displacement: of three points in a row,
the middle one has weight 1/2 at its own place.
"""

from __future__ import annotations

import math
import threading
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

KEPT_WEIGHTS = 32_000_000
"""Total number of weights that are kept (256 MB), those of eight such meshes; the oldest are
dropped first."""

_VALUES_AT_ONCE = 4_000_000
"""Number of products of basis functions that are computed together, which bounds the memory of the
arrays to 32 MB."""

MOST_COMBINATIONS = 100_000
"""Largest number of combinations of differences that are tested, which take some milliseconds; with
more, the result is unknown, and slower tests decide."""

_weights: weakref.WeakKeyDictionary[TriangleMesh, tuple[object, FloatArray]]
_weights = weakref.WeakKeyDictionary()
_last: weakref.WeakKeyDictionary[TriangleMesh, tuple[object, TriangleMesh]]
_last = weakref.WeakKeyDictionary()
_lock = threading.Lock()


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
        return mesh.deformed(deform(kept_weights(mesh, box, resolution), controls))
    share = box_coordinates(mesh.vertices, box)
    bases = [bernstein(share[:, k], resolution[k]) for k in range(3)]
    return mesh.deformed(contract(bases, controls, resolution))


def kept_weights(mesh: TriangleMesh, box: ArrayLike, resolution: Resolution) -> FloatArray:
    """Return the read-only `cage_weights` (n, nx * ny * nz) of the n vertices of a mesh at rest,
    which are kept for the next call with the same mesh, up to `KEPT_WEIGHTS` of all meshes.

    Raises:
        DesignError: a vertex lies outside the box.
    """
    key = np.asarray(box, dtype=np.float64).tobytes(), resolution
    kept = _weights.get(mesh)
    if kept is None or kept[0] != key:
        weights = np.asfortranarray(cage_weights(mesh.vertices, box, resolution))
        weights.flags.writeable = False
        kept = key, weights
        with _lock:
            _weights.pop(mesh, None)  # else the new weights would keep the place of the old ones
            _weights[mesh] = kept
            while sum(each.size for _, each in _weights.values()) > KEPT_WEIGHTS:
                del _weights[next(iter(_weights))]
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


def jacobians(
    vertices: ArrayLike, box: ArrayLike, resolution: Resolution, points: ArrayLike
) -> FloatArray:
    """Return the Jacobian matrix of the deformation at each vertex.

    Args:
        vertices: (n, 3) vertices at rest, mm, inside the box.
        box, resolution, points: the cage; see `deformed`.

    Returns:
        The derivatives (n, 3, 3) of deformed coordinates (row) by coordinates at rest (column). The
        determinant is the local change of volume; it is negative where space is turned inside out.

    Raises:
        DesignError: a vertex lies outside the box.
    """
    share = box_coordinates(vertices, box)
    result = np.empty((len(share), 3, 3))
    for axis, slopes in enumerate(_slopes(box, resolution, points)):
        nx, ny, nz = slopes.shape[:3]
        bases = [bernstein(share[:, k], slopes.shape[k]) for k in range(3)]
        result[:, :, axis] = contract(bases, slopes.reshape(-1, 3), (nx, ny, nz))
    return result


def _slopes(box: ArrayLike, resolution: Resolution, points: ArrayLike) -> list[FloatArray]:
    """Return the differences of control points along x, y and z, over their distances at rest.

    The derivative of a Bernstein sum is the sum of one degree less over these differences.
    """
    size = np.diff(np.asarray(box, dtype=np.float64), axis=0)[0]
    lattice = np.asarray(points, dtype=np.float64).reshape(*resolution, 3)
    return [np.diff(lattice, axis=k) * (resolution[k] - 1) / size[k] for k in range(3)]


def is_one_to_one(box: ArrayLike, resolution: Resolution, points: ArrayLike) -> bool:
    """Return whether the map of the box by the cage is certainly one to one.

    The condition is sufficient and holds for bends of ordinary size: if the symmetric part of the
    derivative is positive definite everywhere in a convex box, the map is one to one (the
    difference of two images has a positive component along the difference of the points). Each
    column of the derivative is a mean of the differences of control points along its axis, and
    positive definite matrices form a convex set, so that only combinations of these differences
    need to be tested. They are taken relative to the mean derivative, so that a rotation of the
    whole lattice has no effect. False means that it is unknown.
    """
    columns = [slopes.reshape(-1, 3) for slopes in _slopes(box, resolution, points)]
    mean = np.column_stack([column.mean(axis=0) for column in columns])
    if not np.isfinite(mean).all() or np.linalg.det(mean) <= 0.0:
        return False
    inverse = np.linalg.inv(mean)
    columns = [np.unique(np.round(column @ inverse.T, 9), axis=0) for column in columns]
    if math.prod(len(column) for column in columns) > MOST_COMBINATIONS:
        return False
    a = columns[0][:, None, None]
    b = columns[1][None, :, None]
    c = columns[2][None, None, :]
    xx, yy, zz = a[..., 0], b[..., 1], c[..., 2]
    xy, xz, yz = (
        0.5 * (a[..., 1] + b[..., 0]),
        0.5 * (a[..., 2] + c[..., 0]),
        0.5 * (b[..., 2] + c[..., 1]),
    )
    minor = xx * yy - xy * xy  # Sylvester: all leading minors above 0
    whole = minor * zz - xx * yz * yz - yy * xz * xz + 2.0 * xy * xz * yz
    return bool((xx > 0.0).all() and (minor > 0.0).all() and (whole > 0.0).all())


def refined_points(points: ArrayLike, resolution: Resolution, finer: Resolution) -> FloatArray:
    """Return control points of a finer lattice with exactly the same deformation.

    The method is degree elevation of Bernstein polynomials (Farin, "Curves and Surfaces for CAGD",
    section on degree elevation), axis by axis, one point at a time.

    Args:
        points: (nx * ny * nz, 3) control points, mm.
        resolution: nx, ny, nz.
        finer: resolution of the finer lattice, at least as many points along each axis.

    Returns:
        The control points (fx * fy * fz, 3) float64, mm.
    """
    lattice = np.asarray(points, dtype=np.float64).reshape(*resolution, 3)
    for axis in range(3):
        lattice = np.moveaxis(lattice, axis, 0)
        while len(lattice) < finer[axis]:
            count = len(lattice)
            before = (np.arange(count + 1) / count).reshape(-1, 1, 1, 1)
            zero = np.zeros_like(lattice[:1])
            lattice = before * np.concatenate([zero, lattice]) + (1.0 - before) * np.concatenate(
                [lattice, zero]
            )
        lattice = np.moveaxis(lattice, 0, axis)
    return lattice.reshape(-1, 3)

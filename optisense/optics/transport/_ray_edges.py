"""Boundaries between pixels whose chief rays take different paths, and their causes.

Between two pixels whose rays take different paths there is a boundary in the picture: the edge of a
part, the edge of another part in front of it, a line where two parts meet, or the limit of total
reflection. Its place between the two pixels is found by bisection, and its cause by following the
two rays beside it to the first surface where they differ. Each cause is a function that is 0 on the
boundary and smooth beside it, so that derivatives tell how the boundary moves (the boundary
integral of Li, Aittala, Durand and Lehtinen, "Differentiable Monte Carlo ray tracing through edge
sampling", ACM Trans. Graph. 37(6), 2018, with the edges found between pixels, which works through
mirrors and refracting surfaces alike).
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from optisense.array_types import FloatArray, IntArray
from optisense.optics.backend.arrays import floats
from optisense.optics.camera.projection import RayCamera
from optisense.optics.scene.ray_scene import Ray, RayScene
from optisense.optics.transport.chief_rays import trace_path_codes
from optisense.optics.transport.interact import RayKind, interact

HALVINGS = 11
"""Number of bisections of the gap between two pixels. With 11, boundaries are found to 1/2048 of a
pixel, which on a sensor is about the rounding of single-precision points."""

NEAR = 8.0
"""Largest distance between an edge and the nearer hit of two rays at which the edge counts as the
cause that separates them, in units of the rays' distance there. It is more than 1 as rays may meet
the edge at a slant: at a grazing angle of 7 degrees, distances are 8 times as long."""

ROUNDING = 1e-4
"""Distance (mm) by which single-precision rays may miss an edge that they pass, some 50 mm from the
camera, where one step of a coordinate is 4e-6 mm."""


class Discontinuity(IntEnum):
    """The cause that separates two neighbouring rays."""

    UNKNOWN = 0  # e.g. a part thinner than the two rays' distance
    EDGE = 1  # of the triangle that the ray meets which is stopped first
    CROSSING = 2  # two surfaces cut through each other
    TOTAL_REFLECTION = 3  # one ray is totally reflected, the other one is not


@dataclass(frozen=True)
class Edges:
    """Points of boundaries in a picture, each between two neighbouring pixels.

    Attributes:
        before, after: (k,) indices of the pixels in the flattened picture; `after` is right of
            `before` or below it.
        along_x: (k,) whether the two pixels are neighbours in a row.
        x, y: (k,) film position of the boundary, pixels.
        side: (k,) position of the boundary along the row or column, pixels from the middle between
            the two pixels.
        depth: (k,) number of surfaces that the rays meet before the one at which they separate.
        cause: (k,) the `Discontinuity`.
        first, second: (k,) the vertices of an EDGE, or the triangles of a CROSSING; for
            TOTAL_REFLECTION, `first` is the triangle.
    """

    before: IntArray
    after: IntArray
    along_x: NDArray[np.bool_]
    x: FloatArray
    y: FloatArray
    side: FloatArray
    depth: IntArray
    cause: IntArray
    first: IntArray
    second: IntArray


@dataclass(frozen=True)
class PathVertex:
    """A surface on the path of rays; all arrays have one entry per ray.

    Attributes:
        origin, direction: origin (mm) and unit direction of the ray that arrives here.
        distance: distance (mm) from the origin to the surface.
        face: number of the triangle.
        smooth: whether the normal varies over the triangle.
        eta: relative refractive index.
        turned: whether the ray is reflected.
        totally: whether the ray is totally reflected.
        valid: whether the ray meets a surface at all.
        arrived: whether the surface is the sensing surface or an indenter.
        goes_on: whether the ray continues.
    """

    origin: mi.Point3f
    direction: mi.Vector3f
    distance: mi.Float
    face: mi.UInt32
    smooth: mi.Bool
    eta: mi.Float
    turned: mi.Bool
    totally: mi.Bool
    valid: mi.Bool
    arrived: mi.Bool
    goes_on: mi.Bool


def walk(scene: RayScene, origin: mi.Point3f, direction: mi.Vector3f) -> list[PathVertex]:
    """Return all surfaces that rays meet one after the other, without derivatives.

    Args:
        origin: origins (3, n), mm.
        direction: unit directions (3, n).
    """
    stops = []
    active = dr.full(mi.Bool, True, dr.width(direction))
    ray = Ray(dr.detach(origin), dr.detach(direction), active)
    while dr.any(ray.active):
        step = interact(scene, ray, RayKind.CHIEF)
        hit = step.hit
        bent = hit.shading_normal != hit.normal
        stop = PathVertex(
            ray.origin,
            ray.direction,
            hit.distance,
            hit.face,
            hit.valid & (bent.x | bent.y | bent.z),
            step.eta,
            step.turned,
            step.totally,
            hit.valid,
            step.sensed,
            step.ray.active,
        )
        dr.eval(stop, step.ray)
        stops.append(stop)
        ray = step.ray
    return stops


def find_edges(scene: RayScene, camera: RayCamera, codes: NDArray[np.uint32]) -> Edges | None:
    """Find all boundaries between pixels of which at least one sees the sensing surface.

    Args:
        codes: (h, w) result of `trace_path_codes` for the middle of each pixel.

    Returns:
        The boundaries; None if there are none.
    """
    number = np.arange(codes.size).reshape(codes.shape)
    across = codes[:, 1:] != codes[:, :-1]
    down = codes[1:] != codes[:-1]
    before = np.concatenate([number[:, :-1][across], number[:-1][down]])
    after = np.concatenate([number[:, 1:][across], number[1:][down]])
    if not len(before):
        return None
    along_x = np.arange(len(before)) < np.count_nonzero(across)
    low = np.stack([before % camera.width, before // camera.width], axis=1) + 0.5
    way = np.stack([along_x, ~along_x], axis=1).astype(float)
    start, end = np.zeros(len(before)), np.ones(len(before))
    first = codes.ravel()[before]
    for _ in range(HALVINGS):
        middle = (start + end) / 2
        place = low + middle[:, None] * way
        same = trace_path_codes(scene, camera, place[:, 0], place[:, 1]) == first
        start, end = np.where(same, middle, start), np.where(same, end, middle)
    middle = (start + end) / 2
    place = low + middle[:, None] * way
    beside = low + start[:, None] * way, low + end[:, None] * way
    depth, cause, one, other = _causes(scene, camera, *beside)
    return Edges(
        before, after, along_x, place[:, 0], place[:, 1], middle - 0.5, depth, cause, one, other
    )


def _causes(
    scene: RayScene, camera: RayCamera, left: FloatArray, right: FloatArray
) -> tuple[IntArray, IntArray, IntArray, IntArray]:
    """Return the depth, cause, first and second (each (k,), see `Edges`) of the separation of the
    rays through pairs of film positions ``left`` and ``right`` (k, 2).
    """
    count = len(left)
    both = np.concatenate([left, right])
    stops = walk(scene, *camera.rays(floats(both[:, 0]), floats(both[:, 1])))
    patches = np.asarray(scene.patches).astype(np.int64)
    depth = np.zeros(count, dtype=np.int64)
    cause, first, second = depth.copy(), depth.copy(), depth.copy()
    waiting = np.ones(count, dtype=bool)
    for number, stop in enumerate(stops):
        valid = np.asarray(stop.valid).astype(bool)
        face = np.asarray(stop.face).astype(np.int64)
        patch = np.where(valid, patches[np.where(valid, face, 0)], -1)
        totally = np.asarray(stop.totally).astype(bool)
        parted = patch[:count] != patch[count:]
        here = waiting & (parted | (totally[:count] != totally[count:]))
        waiting &= ~here
        rows = np.flatnonzero(here)
        depth[rows] = number
        apart = parted[rows]
        limit = rows[~apart]
        cause[limit], first[limit] = Discontinuity.TOTAL_REFLECTION, face[limit]
        rows = rows[apart]
        if len(rows):
            found = _nearest_edges(scene, stop, valid, face, rows, count)
            cause[rows], first[rows], second[rows] = found
    return depth, cause, first, second


def _nearest_edges(
    scene: RayScene,
    stop: PathVertex,
    valid: NDArray[np.bool_],
    face: IntArray,
    rows: IntArray,
    count: int,
) -> tuple[IntArray, IntArray, IntArray]:
    """Return cause, first and second (see `Edges`) for pairs of rays on different patches."""
    origin = np.asarray(stop.origin, dtype=np.float64).T
    direction = np.asarray(stop.direction, dtype=np.float64).T
    distance = np.where(valid, np.asarray(stop.distance, dtype=np.float64), np.inf)
    one, other = rows, rows + count
    near = np.minimum(distance[one], distance[other])
    reach = [origin[ray] + near[:, None] * direction[ray] for ray in (one, other)]
    gap = np.linalg.norm(reach[0] - reach[1], axis=1)
    within = NEAR * gap + ROUNDING

    best = np.full(len(rows), np.inf)
    first, second = np.zeros(len(rows), dtype=np.int64), np.zeros(len(rows), dtype=np.int64)
    for ray in (one, other):
        # A surface that lies farther away does not end here; it is covered.
        stopped = valid[ray] & (distance[ray] <= near + within)
        corners = np.asarray(scene.faces, dtype=np.int64)[np.where(valid[ray], face[ray], 0)]
        for k in range(3):
            a, b = corners[:, k], corners[:, (k + 1) % 3]
            start, end = (np.asarray(scene.vertices, dtype=np.float64)[v] for v in (a, b))
            aside = np.cross(end - start, direction[ray])
            length = np.maximum(np.linalg.norm(aside, axis=1), 1e-12)
            off = np.abs(np.einsum("ij,ij->i", aside, origin[ray] - start)) / length
            better = stopped & (off < best)
            best[better], first[better], second[better] = off[better], a[better], b[better]
    edge = best <= within
    crossing = ~edge & valid[one] & valid[other]
    cause = np.where(
        edge, Discontinuity.EDGE, np.where(crossing, Discontinuity.CROSSING, Discontinuity.UNKNOWN)
    )
    first = np.where(crossing, face[one], first)
    second = np.where(crossing, face[other], second)
    return cause.astype(np.int64), first, second

"""Chief rays from the pixels to the sensing surface, with ideal refraction and reflection."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from optisense.errors import RenderError
from optisense.optics.backend.arrays import floats
from optisense.optics.camera.projection import RayCamera
from optisense.optics.scene.assembly import SMOOTH_METAL
from optisense.optics.scene.ray_scene import Ray, RayScene
from optisense.optics.scene.surface_table import surface_light
from optisense.optics.scene.surfaces import Region, Surface, SurfaceKind
from optisense.optics.transport.interact import RayKind, interact

HASH_FACTOR = 0x9E3779B1
"""Multiplier that mixes the surfaces or patches of a ray's path into one number: 2^32 over the
golden ratio, as in Knuth's multiplicative hashing."""

MIRROR_BITS = 32
"""Number of bits that record the mirrors a ray has met: the bits of an unsigned integer of the
kernel. Mirrors whose surface numbers differ by a multiple of it share a bit."""


class RayOutcome(IntEnum):
    """The outcome of a chief ray."""

    HIT = 0  # reached the inside of the sensing surface (or an indenter pressed into it)
    ESCAPED = 1  # left the sensor
    ABSORBED = 2  # ended on a blocker, a light, the outside of the coating, or anything opaque
    TOTAL_REFLECTION = 3  # was totally reflected on its way and did not reach the surface
    DEPTH_LIMIT = 4  # still on its way after `interact.MAX_DEPTH` surfaces


@dataclass(frozen=True, eq=False)
class ChiefRays:
    """The chief rays of a picture, one per pixel; entries other than ``outcome`` and ``lamp`` are
    valid where ``outcome`` is HIT.

    Attributes:
        points: (h, w, 3) end points, mm.
        normals: (h, w, 3) unit normals, on the ray's side.
        directions: (h, w, 3) unit vectors, the direction of travel on arrival.
        incidence: (h, w) cosine of the angle between ray and normal (1 is perpendicular).
        outcome: (h, w) `RayOutcome` of each ray.
        face: (h, w) number of the triangle in the mesh of the sensing surface.
        region: (h, w) 1 for the sensing surface, 2 for an indenter.
        mirrors: (h, w) bits; bit n % 32 is set where surface n of the scene, a mirror, has
            reflected the ray.
        reflections: (h, w) code of the surfaces that have reflected the ray, in order, be it a
            mirror or by total reflection; 0 for a ray that nothing has reflected. Where neighbours
            have different codes, the surface appears folded between them.
        lamp: (h, w) number + 1 of the light whose emitting face the ray ends on, else 0.
    """

    points: NDArray[np.float32]
    normals: NDArray[np.float32]
    directions: NDArray[np.float32]
    incidence: NDArray[np.float32]
    outcome: NDArray[np.uint8]
    face: NDArray[np.int64]
    region: NDArray[np.uint8]
    mirrors: NDArray[np.uint32]
    reflections: NDArray[np.uint32]
    lamp: NDArray[np.uint32]

    @property
    def hit(self) -> NDArray[np.bool_]:
        """Mask (h, w) of the pixels that see the sensing surface."""
        return self.outcome == RayOutcome.HIT

    @property
    def contact_mask(self) -> NDArray[np.bool_]:
        """Mask (h, w) of the pixels that see an indenter."""
        return self.hit & (self.region == Region.INDENTER)


@dr.syntax
def _trace(scene: RayScene, patches: mi.UInt32 | None, ray: Ray) -> tuple[Any, ...]:
    outcome = mi.UInt32(int(RayOutcome.DEPTH_LIMIT))
    total = mi.Bool(False)
    point = mi.Point3f(0)
    normal = mi.Vector3f(0)
    region = mi.UInt32(0)
    face = mi.UInt32(0)
    mirrors = mi.UInt32(0)
    reflections = mi.UInt32(0)
    lamp = mi.UInt32(0)
    path = mi.UInt32(0)
    while dr.hint(ray.active, exclude=[scene, patches]):
        step = interact(scene, ray, RayKind.CHIEF)
        hit = step.hit
        outcome = dr.select(ray.active & ~hit.valid, int(RayOutcome.ESCAPED), outcome)
        outcome = dr.select(step.ended, int(RayOutcome.ABSORBED), outcome)
        outcome = dr.select(step.sensed, int(RayOutcome.HIT), outcome)
        point = dr.select(step.sensed, hit.point, point)
        normal = dr.select(step.sensed, hit.shading_normal * step.side, normal)
        region = dr.select(step.sensed, step.region, region)
        face = dr.select(step.sensed, hit.face, face)
        if dr.hint(patches is not None, mode="scalar"):
            patch = dr.gather(mi.UInt32, patches, hit.face, hit.valid)
            code = patch * 2 + dr.select(step.totally, mi.UInt32(1), mi.UInt32(0))
            path = dr.select(hit.valid, (path ^ code) * HASH_FACTOR + 1, path)
        lit = step.light & (step.side > 0)
        lamp = dr.select(lit, surface_light(scene.table, hit.surface, lit) + 1, lamp)
        total |= step.totally
        mirrors |= dr.select(step.scattered, mi.UInt32(1) << (hit.surface % MIRROR_BITS), 0)
        reflections = dr.select(
            step.turned, (reflections ^ (hit.surface + 1)) * HASH_FACTOR + 1, reflections
        )
        ray = step.ray
    failed = total & (outcome != int(RayOutcome.HIT))
    outcome = dr.select(failed, int(RayOutcome.TOTAL_REFLECTION), outcome)
    return outcome, point, normal, ray.direction, region, face, mirrors, reflections, lamp, path


def trace_path_codes(
    scene: RayScene, camera: RayCamera, x: NDArray[np.floating], y: NDArray[np.floating]
) -> NDArray[np.uint32]:
    """Return the codes (k,) of the paths of chief rays, as `trace_to_skin` does.

    Args:
        x, y: (k,) film positions, pixels.
    """
    return _coded(scene, Ray(*camera.rays(floats(x), floats(y)), mi.Bool(True)))[0]


def trace_to_skin(
    scene: RayScene, origin: NDArray[np.floating], direction: NDArray[np.floating]
) -> tuple[NDArray[np.uint32], NDArray[np.float64]]:
    """Follow rays from given origins to the sensing surface.

    The code of a path is a hash of the smooth patches that the ray meets, in order, and of its
    total reflections. Between rays of the same code the path changes smoothly.

    Args:
        origin: (k, 3) origins, mm.
        direction: (k, 3) unit directions.

    Returns:
        The codes (k,), 0 for rays that do not arrive at the sensing surface, and never 0 for the
        others; and the end points (k, 3), mm.
    """
    start, way = (
        dr.unravel(kind, floats(each.ravel()))
        for kind, each in ((mi.Point3f, origin), (mi.Vector3f, direction))
    )
    codes, point = _coded(scene, Ray(start, way, mi.Bool(True)))
    return codes, np.asarray(point, dtype=np.float64).T


def _coded(scene: RayScene, ray: Ray) -> tuple[NDArray[np.uint32], mi.Point3f]:
    outcome, point, *_others, path = _trace(scene, scene.patches, ray)
    codes = dr.select(outcome == int(RayOutcome.HIT), path | 1, 0)
    dr.eval(codes, point)
    return np.asarray(codes).astype(np.uint32), point


def trace_chief_rays(
    scene: RayScene, camera: RayCamera, sensing_faces: NDArray[np.int64] | None = None
) -> ChiefRays:
    """Follow the ray through the middle of every pixel.

    Args:
        sensing_faces: (n,) for each of the scene's first n triangles, the number of the triangle of
            the sensing surface, or -1 for other surfaces; further triangles count as -1. Without
            it, ``face`` is -1 everywhere.
    """
    shape = camera.height, camera.width
    index = dr.arange(mi.UInt32, camera.width * camera.height)
    width = dr.opaque(mi.UInt32, camera.width)
    x = mi.Float(index % width) + 0.5
    y = mi.Float(index // width) + 0.5
    outcome, point, normal, arriving, region, face, mirrors, reflections, lamp, _path = _trace(
        scene, None, Ray(*camera.rays(x, y), mi.Bool(True))
    )
    incidence = -dr.dot(arriving, normal)
    if sensing_faces is None:
        sensing_faces = np.zeros(0, dtype=np.int64)
    dr.eval(outcome, point, normal, arriving, region, face, mirrors, reflections, lamp, incidence)

    def image(values: object) -> NDArray[np.float32]:
        return np.asarray(values, dtype=np.float32).T.reshape(*shape, 3)

    return ChiefRays(
        points=image(point),
        normals=image(normal),
        directions=image(arriving),
        incidence=np.asarray(incidence, dtype=np.float32).reshape(shape),
        outcome=np.asarray(outcome).astype(np.uint8).reshape(shape),
        face=np.append(sensing_faces, -1)[np.minimum(np.asarray(face), len(sensing_faces))].reshape(
            shape
        ),
        region=np.asarray(region).astype(np.uint8).reshape(shape),
        mirrors=np.asarray(mirrors).astype(np.uint32).reshape(shape),
        reflections=np.asarray(reflections).astype(np.uint32).reshape(shape),
        lamp=np.asarray(lamp).astype(np.uint32).reshape(shape),
    )


def pixel_areas(rays: ChiefRays) -> NDArray[np.float64]:
    """Return the area (h, w), mm^2, of the surface that each pixel sees.

    It is computed from the points of the pixel's neighbours, and is 0 where these do not hit.
    """
    p = rays.points.astype(np.float64)
    along_x = np.zeros_like(p)
    along_y = np.zeros_like(p)
    along_x[:, 1:-1] = (p[:, 2:] - p[:, :-2]) / 2
    along_x[:, 0], along_x[:, -1] = p[:, 1] - p[:, 0], p[:, -1] - p[:, -2]
    along_y[1:-1] = (p[2:] - p[:-2]) / 2
    along_y[0], along_y[-1] = p[1] - p[0], p[-1] - p[-2]
    area = np.linalg.norm(np.cross(along_x, along_y), axis=2)
    hit = rays.hit
    whole = hit.copy()
    whole[:, 1:] &= hit[:, :-1]
    whole[:, :-1] &= hit[:, 1:]
    whole[1:] &= hit[:-1]
    whole[:-1] &= hit[1:]
    return np.where(whole, area, 0.0)


def picture_directions(
    rays: ChiefRays, place: NDArray[np.floating]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the ways over the surface (3,), mm, to the pixels on the right and above at a place.

    They are taken at the pixel that shows the place, and if several do, as with mirrors, at the one
    that shows it largest.

    Args:
        place: (3,) a point of the sensing surface, mm.

    Raises:
        RenderError: no pixel sees the surface together with its four neighbours.
    """
    area = pixel_areas(rays)[1:-1, 1:-1]
    codes, middle = rays.reflections, rays.reflections[1:-1, 1:-1]
    for neighbour in (codes[1:-1, 2:], codes[1:-1, :-2], codes[2:, 1:-1], codes[:-2, 1:-1]):
        area = np.where(neighbour == middle, area, 0.0)
    if not area.any():
        raise RenderError(
            "the camera sees too little of the sensing surface for directions on it",
            hint="Check the camera's position, direction and field of view",
        )
    p = rays.points.astype(np.float64)
    distance = np.linalg.norm(p[1:-1, 1:-1] - place, axis=2)
    away = np.where(area > 0.0, distance**2 + area, np.inf)
    row, column = np.unravel_index(np.argmin(away), away.shape)
    right = (p[row + 1, column + 2] - p[row + 1, column]) / 2
    up = (p[row, column + 1] - p[row + 2, column + 1]) / 2
    return right, up


def pixel_stretching(rays: ChiefRays) -> NDArray[np.float64]:
    """Return the ratio of length to width of a pixel's footprint on the sensing surface.

    The map from the picture to the surface is linear around a pixel; the result is the ratio of its
    singular values. With 1 all angles are kept; with 3 a ball appears as an ellipse three times as
    long as wide.

    Returns:
        The ratio (h, w), at least 1; NaN where the pixel or a neighbour does not see the surface.
    """
    p = rays.points.astype(np.float64)
    found = np.full(rays.hit.shape, np.nan)
    if min(found.shape) < 3:
        return found
    along_x = p[1:-1, 2:] - p[1:-1, :-2]
    along_y = p[2:, 1:-1] - p[:-2, 1:-1]
    hit = rays.hit
    whole = hit[1:-1, 2:] & hit[1:-1, :-2] & hit[2:, 1:-1] & hit[:-2, 1:-1] & hit[1:-1, 1:-1]
    xx, yy, xy = (
        np.einsum("ijk,ijk->ij", one, other)
        for one, other in ((along_x, along_x), (along_y, along_y), (along_x, along_y))
    )
    # Eigenvalues of the Gram matrix are the squares of the singular values.
    middle, half = (xx + yy) / 2, np.hypot((xx - yy) / 2, xy)
    least = np.maximum(middle - half, 1e-12 * middle)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.sqrt((middle + half) / least)
    found[1:-1, 1:-1] = np.where(whole & (middle > 0.0), ratio, np.nan)
    return found


def shares_by_mirrors(
    rays: ChiefRays, mirrors: list[tuple[int, str]]
) -> dict[frozenset[str], float]:
    """Return the shares of the rays that arrive, by the set of mirrors that reflect them.

    Args:
        mirrors: pairs of a bit of ``rays.mirrors`` and the name of the mirror that it stands for.
    """
    met, counts = np.unique(rays.mirrors[rays.hit], return_counts=True)
    shares: dict[frozenset[str], float] = {}
    for bits, count in zip(met.tolist(), counts.tolist(), strict=True):
        names = frozenset(name for bit, name in mirrors if bits & bit)
        shares[names] = shares.get(names, 0.0) + count / int(counts.sum())
    return shares


def sees_nothing(rays: ChiefRays, scene: RayScene) -> RenderError:
    """Return the error to raise if no chief ray meets the sensing surface of a scene; it reports
    their outcomes, and how rough mirrors may be if there are rough ones.
    """
    names = {outcome: outcome.name.lower().replace("_", " ") for outcome in RayOutcome}
    counts = {names[o]: int((rays.outcome == o).sum()) for o in RayOutcome}
    met = ", ".join(f"{name}: {count}" for name, count in counts.items() if count)
    hint = (
        "Check the camera's position, direction and field of view, what is in its way, and that "
        "the normals of the sensing surface point to its side"
    )
    if any(_is_rough_metal(piece.surface) for piece in scene.pieces):
        hint += f". Mirrors show an image if their roughness is below {SMOOTH_METAL:g}"
    return RenderError(
        "the camera sees nothing of the sensing surface",
        where=f"of {rays.outcome.size} rays, {met}",
        hint=hint,
    )


def _is_rough_metal(surface: Surface) -> bool:
    opaque = surface.kind is SurfaceKind.OPAQUE and surface.region is Region.OTHER
    return opaque and surface.specularity == 1.0

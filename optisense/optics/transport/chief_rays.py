"""Chief rays: where on the sensing surface each pixel looks, refracted and reflected ideally."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from optisense.errors import RenderError
from optisense.optics.backend.arrays import floats
from optisense.optics.camera.projection import RayCamera
from optisense.optics.scene.bsdf import refract, surface_kind, surface_region
from optisense.optics.scene.ray_scene import Hit, RayScene, intersect, leave
from optisense.optics.scene.surfaces import Region, SurfaceKind

MAX_DEPTH = 32
"""Largest number of surfaces that a chief ray meets."""

HASH_FACTOR = 0x9E3779B1
"""Multiplier that mixes the patches of a ray's path into one number: 2^32 over the golden ratio,
as in Knuth's multiplicative hashing."""


class RayOutcome(IntEnum):
    """What became of a chief ray."""

    HIT = 0  # reached the sensing surface (or an indenter pressed into it)
    ESCAPED = 1  # left the sensor
    ABSORBED = 2  # ended on a blocker, a light, or another opaque surface
    TOTAL_REFLECTION = 3  # was totally reflected on its way and did not reach the surface
    DEPTH_LIMIT = 4  # still on its way after MAX_DEPTH surfaces


@dataclass(frozen=True)
class ChiefRays:
    """One chief ray a pixel; arrays are (h, w, ...). Entries other than ``outcome`` count where
    it is HIT.

    points: mm; normals: unit, towards the ray; incidence: cosine of the angle between ray and
    normal (1 is perpendicular); directions: unit, the way the ray travels when it arrives;
    face: triangle of the sensing surface hit, in the order of its mesh; region: 1 sensing
    surface, 2 indenter.
    """

    points: NDArray[np.float32]
    normals: NDArray[np.float32]
    directions: NDArray[np.float32]
    incidence: NDArray[np.float32]
    outcome: NDArray[np.uint8]
    face: NDArray[np.int64]
    region: NDArray[np.uint8]

    @property
    def hit(self) -> NDArray[np.bool_]:
        """(h, w): which pixels see the sensing surface."""
        return self.outcome == RayOutcome.HIT

    @property
    def contact_mask(self) -> NDArray[np.bool_]:
        """(h, w): which pixels see an indenter."""
        return self.hit & (self.region == Region.INDENTER)


class Step(NamedTuple):
    """What chief rays do at the next surface that they meet.

    Attributes:
        hit: where that is.
        eta: the surface's relative refractive index.
        region: of `Region`.
        arrived: the ray ends on the sensing surface or an indenter.
        ended: it ends on another opaque surface, a blocker or a light.
        totally: it is totally reflected.
        turned: it is reflected, by a mirror or totally; else it is refracted.
        goes_on: it neither ends nor escapes.
        origin, direction: of the ray that goes on; unchanged where none does.
    """

    hit: Hit
    eta: mi.Float
    region: mi.UInt32
    arrived: mi.Bool
    ended: mi.Bool
    totally: mi.Bool
    turned: mi.Bool
    goes_on: mi.Bool
    origin: mi.Point3f
    direction: mi.Vector3f


def next_step(
    scene: mi.Scene,
    rows: mi.Float,
    corners: mi.Float,
    surfaces: mi.Float,
    origin: mi.Point3f,
    direction: mi.Vector3f,
    active: mi.Bool,
) -> Step:
    """One surface further, by ideal refraction and reflection; symbolic loops may call it."""
    hit = intersect(scene, rows, corners, origin, direction, active, True)
    kind, eta, _alpha = surface_kind(surfaces, hit.surface, hit.valid)
    region = surface_region(surfaces, hit.surface, hit.valid)
    opaque = hit.valid & (kind == int(SurfaceKind.OPAQUE))
    arrived = opaque & (region != int(Region.OTHER))
    absorbing = (kind == int(SurfaceKind.ABSORBER)) | (kind == int(SurfaceKind.LIGHT))
    ended = hit.valid & ~arrived & (opaque | absorbing)
    goes_on = active & hit.valid & ~arrived & ~ended
    reflectance, reflected, transmitted, _relative = refract(direction, hit.shading_normal, eta)
    mirror = kind == int(SurfaceKind.MIRROR)
    totally = goes_on & ~mirror & (reflectance >= 1)
    turned = goes_on & (mirror | totally)
    onward = dr.select(goes_on, dr.select(turned, reflected, transmitted), direction)
    start = dr.select(goes_on, leave(hit.point, hit.normal, onward), origin)
    return Step(hit, eta, region, arrived, ended, totally, turned, goes_on, start, onward)


@dr.syntax
def _trace(
    scene: mi.Scene,
    rows: mi.Float,
    corners: mi.Float,
    surfaces: mi.Float,
    patches: mi.UInt32 | None,
    origin: mi.Point3f,
    direction: mi.Vector3f,
    limit: mi.UInt32,
) -> tuple[Any, ...]:
    active = mi.Bool(True)
    depth = mi.UInt32(0)
    outcome = mi.UInt32(int(RayOutcome.DEPTH_LIMIT))
    total = mi.Bool(False)
    point = mi.Point3f(0)
    normal = mi.Vector3f(0)
    region = mi.UInt32(0)
    face = mi.UInt32(0)
    path = mi.UInt32(0)
    while active:
        step = next_step(scene, rows, corners, surfaces, origin, direction, active)
        hit = step.hit
        outcome = dr.select(active & ~hit.valid, int(RayOutcome.ESCAPED), outcome)
        outcome = dr.select(step.ended, int(RayOutcome.ABSORBED), outcome)
        outcome = dr.select(step.arrived, int(RayOutcome.HIT), outcome)
        side = -dr.sign(dr.dot(direction, hit.normal))
        point = dr.select(step.arrived, hit.point, point)
        normal = dr.select(step.arrived, hit.shading_normal * side, normal)
        region = dr.select(step.arrived, step.region, region)
        face = dr.select(step.arrived, hit.face, face)
        if patches is not None:
            patch = dr.gather(mi.UInt32, patches, hit.face, hit.valid)
            code = patch * 2 + dr.select(step.totally, mi.UInt32(1), mi.UInt32(0))
            path = dr.select(hit.valid, (path ^ code) * HASH_FACTOR + 1, path)
        total |= step.totally
        origin = step.origin
        direction = step.direction
        depth += 1
        active = step.goes_on & (depth < limit)
    failed = total & (outcome != int(RayOutcome.HIT))
    outcome = dr.select(failed, int(RayOutcome.TOTAL_REFLECTION), outcome)
    return outcome, point, normal, direction, region, face, path


def trace_path_codes(
    scene: RayScene, camera: RayCamera, x: NDArray[np.floating], y: NDArray[np.floating]
) -> NDArray[np.uint32]:
    """Which smooth patches chief rays meet one after the other, and where they are totally
    reflected, as one number for each ray: rays of the same number move smoothly into one another.

    Args:
        scene: the surfaces.
        camera: whose rays.
        x, y: (k,) film positions, pixels.

    Returns:
        (k,): 0 for rays that do not arrive at the sensing surface, and never 0 for the others.
    """
    origin, direction = camera.rays(floats(x), floats(y))
    traced = _trace(
        scene.scene,
        scene.rows,
        scene.corners,
        scene.table,
        scene.patches,
        origin,
        direction,
        dr.opaque(mi.UInt32, MAX_DEPTH),
    )
    outcome, path = traced[0], traced[-1]
    codes = dr.select(outcome == int(RayOutcome.HIT), path | 1, 0)
    return np.asarray(codes).astype(np.uint32)


def trace_chief_rays(
    scene: RayScene, camera: RayCamera, sensing_faces: NDArray[np.int64] | None = None
) -> ChiefRays:
    """Follow the ray through the middle of every pixel.

    ``sensing_faces`` maps the scene's triangles to those of the sensing surface (-1, as for any
    triangles that follow: another); without it ``face`` is -1 everywhere.
    """
    shape = camera.height, camera.width
    index = dr.arange(mi.UInt32, camera.width * camera.height)
    x = mi.Float(index % camera.width) + 0.5
    y = mi.Float(index // camera.width) + 0.5
    origin, direction = camera.rays(x, y)
    outcome, point, normal, arriving, region, face, _path = _trace(
        scene.scene,
        scene.rows,
        scene.corners,
        scene.table,
        None,
        origin,
        direction,
        dr.opaque(mi.UInt32, MAX_DEPTH),
    )
    incidence = -dr.dot(arriving, normal)
    if sensing_faces is None:
        sensing_faces = np.zeros(0, dtype=np.int64)
    dr.eval(outcome, point, normal, arriving, region, face, incidence)

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
    )


def pixel_areas(rays: ChiefRays) -> NDArray[np.float64]:
    """(h, w) mm^2 of surface behind each pixel, from its neighbours' points; 0 where these do
    not hit.
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


def pixel_stretching(rays: ChiefRays) -> NDArray[np.float64]:
    """How much longer than wide a small circle of the picture is on the sensing surface.

    The map from the picture to the surface is linear around a pixel; the value is the ratio of its
    singular values. 1 keeps all angles; 3 shows a ball as an ellipse three times as long as wide.

    Returns:
        (h, w), 1 or more; NaN where the pixel or a neighbour does not see the surface.
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


def sees_nothing(rays: ChiefRays) -> RenderError:
    """The error to raise where no chief ray meets the sensing surface; says what became of them."""
    names = {outcome: outcome.name.lower().replace("_", " ") for outcome in RayOutcome}
    counts = {names[o]: int((rays.outcome == o).sum()) for o in RayOutcome}
    met = ", ".join(f"{name}: {count}" for name, count in counts.items() if count)
    return RenderError(
        "the camera sees nothing of the sensing surface",
        where=f"of {rays.outcome.size} rays, {met}",
        hint="Check the camera's position, direction and field of view, and what is in its way",
    )

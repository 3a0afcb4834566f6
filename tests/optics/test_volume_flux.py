"""Light on a ball that is raised into grazing light, compared with a closed form."""

from __future__ import annotations

from dataclasses import replace

import mitsuba as mi
import numpy as np
import pytest
from numpy.typing import NDArray
from reference_scenes import diffuse_coating, floor, quad

from optisense.geometry import Sphere
from optisense.optics.camera.projection import RayCamera
from optisense.optics.imaging.cached import render_cached
from optisense.optics.imaging.sampling import SamplingPlan
from optisense.optics.radiance_cache.lit_scene import LitScene
from optisense.optics.radiance_cache.store import CacheStore
from optisense.optics.radiance_cache.tracing_limits import TracingLimits
from optisense.optics.scene.contact_scenes import ContactScenes
from optisense.optics.scene.emitters import Emitter, EmitterShape, emitter_table
from optisense.optics.scene.lamp_windows import LampWindows
from optisense.optics.scene.ray_scene import Piece, RayScene
from optisense.optics.scene.surfaces import Region, Surface
from optisense.optics.transport.chief_rays import ChiefRays, trace_chief_rays

REFLECTANCE = 0.02
"""Reflectance of the coating, so low that interreflection between ball and surface does not matter.
"""
RADIUS, DEPTH = 1.5, 0.8
ABOVE_RIM = 0.25
"""Height (mm) on the ball below which pixels also see the surface beside it."""
PHOTONS = 1_500_000
AGREEMENT = 0.03
"""The noise of so many photons is 1.5 %. Read from where light lands, the flank lacks 20 %."""
SMALL_AGREEMENT = 0.05
"""The same on a small skin. The noise is 2 to 3 %, as photons are sent up to 2 mm beyond the view;
without the layer, the flank lacks 15 %."""
LAMP = Emitter(
    0, (12.0, 0.0, 1.4), (-1.0, 0.0, 0.0), (0.0, 0.0, 1.0), EmitterShape.RECTANGLE, size=(2.4, 2.4)
)
OVERHEAD = Emitter(
    0, (0.0, 0.0, 12.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0), EmitterShape.RECTANGLE, size=(2.4, 2.4)
)
BRIGHT = 0.7
"""Reflectance of a coating whose interreflection matters."""
FEW_PHOTONS = 300_000
"""Number of photons for comparisons of images whose photons take the same paths."""
ABSORBED = 0.005
"""Their relative difference is 0.0004. It is 0.13 on the side in shadow if the layer holds light
that leaves the skin, as the layer does not know which part of the skin the ball covers."""
CAMERA = RayCamera((0.0, 0.0, 24.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0), 12.0, 64, 48)
OBLIQUE = RayCamera(
    (17.0, 0.0, 17.0), (-(0.5**0.5), 0.0, -(0.5**0.5)), (-(0.5**0.5), 0.0, 0.5**0.5), 12.0, 64, 48
)
"""A camera on the side of the lamp. If points read the light where their lines of sight, continued
behind the ball, meet the skin, the flank is 8 % too dark, as the skin there is farther from the
lamp."""
WALL = 0.9
"""Reflectance of the wall."""
BELOW_CEILING = RayCamera((0.0, 0.0, 7.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0), 40.0, 64, 48)


def coating(region: Region, reflectance: float = REFLECTANCE) -> Surface:
    return replace(diffuse_coating(reflectance), region=region)


def ball(reflectance: float = REFLECTANCE) -> Piece:
    """A ball's cap, pressed in from below by DEPTH."""
    mesh = Sphere(radius=RADIUS).mesh(1.2 * DEPTH).transformed(np.diag([1.0, -1.0, -1.0, 1.0]))
    vertices = mesh.vertices + [0.0, 0.0, DEPTH]
    return Piece("ball", vertices, mesh.faces, coating(Region.INDENTER, reflectance), mesh.normals)


def skin(reflectance: float = REFLECTANCE) -> Piece:
    return floor(coating(Region.SENSING, reflectance))


def ceiling() -> Piece:
    """A black plate above camera and lamp, where most light that leaves the skin ends."""
    corners = [(-15, -15, 8), (-15, 15, 8), (15, 15, 8), (15, -15, 8)]
    return quad("ceiling", corners, coating(Region.OTHER, 0.0))


def wall() -> Piece:
    """A white wall behind the ball, which the lamp lights."""
    corners = [(-5, -8, 0), (-5, 8, 0), (-5, 8, 3), (-5, -8, 3)]
    return quad("wall", corners, coating(Region.OTHER, WALL))


def store(pieces: list[Piece], lamp: Emitter, seen: NDArray[np.floating]) -> CacheStore:
    return CacheStore(LitScene(RayScene(pieces), pieces, emitter_table([lamp], 1), False), seen)


def irradiance(points: NDArray[np.floating], normals: NDArray[np.floating]) -> NDArray[np.float64]:
    """(n,) of a Lambertian lamp of 1 mW at points that see all of it, by the sum over its face."""
    steps = (np.arange(40) + 0.5) / 40 - 0.5
    across, up, towards = LAMP.frame
    total = np.zeros(len(points))
    for a in steps * LAMP.size[0]:
        for b in steps * LAMP.size[1]:
            way = np.asarray(LAMP.position) + a * across + b * up - points
            squared = (way**2).sum(axis=1)
            cosines = np.maximum((way * normals).sum(axis=1), 0) * np.maximum(-way @ towards, 0)
            total += cosines / squared**2
    return np.asarray(total / len(steps) ** 2 / np.pi)


def from_wall(points: NDArray[np.floating], normals: NDArray[np.floating]) -> NDArray[np.float64]:
    """(n,) of the light that the wall reflects, at points above the skin, by the sum over it."""
    u, v = (np.indices((64, 24)).reshape(2, -1) + 0.5) / [[64], [24]]
    spots = np.stack([np.full(len(u), -5.0), 16 * u - 8, 3 * v], axis=1)
    facing = np.tile([1.0, 0.0, 0.0], (len(spots), 1))
    radiance = WALL / np.pi * irradiance(spots, facing)
    way = spots[None] - points[:, None]
    squared = (way**2).sum(axis=2)
    cosines = np.maximum((way * normals[:, None]).sum(axis=2), 0) * np.maximum(-way[..., 0], 0)
    return np.asarray((radiance * cosines / squared**2).sum(axis=1) * 16 * 3 / len(spots))


def picture(
    fixed: list[Piece],
    cap: Piece,
    camera: RayCamera,
    photons: int,
    guided_by: RayCamera | None = None,
    lamp: Emitter = LAMP,
) -> tuple[NDArray[np.floating], ChiefRays]:
    """The radiance (h, w) of a ball's cap in the light of the lamp, and the chief rays; photons are
    sent to what the camera sees, or to what ``guided_by`` sees.
    """
    full = RayScene([*fixed, cap])
    numbers = list(range(len(fixed)))
    still = RayScene(fixed, numbers, full.table)
    pressed = RayScene([cap], [len(fixed)], full.table)
    middle = cap.vertices.mean(axis=0)
    reach = np.linalg.norm(cap.vertices - middle, axis=1).max()
    around = mi.Float(np.append(middle, reach).astype(np.float32))
    scenes = ContactScenes(full, still, pressed, around, convex=True)
    rays = trace_chief_rays(full, camera)
    guide = rays if guided_by is None else trace_chief_rays(full, guided_by)
    light = store(fixed, lamp, guide.points[guide.hit])
    cache = light.radiance_cache(0, TracingLimits(photons), lambda *told: None)
    windows, plan = LampWindows.of([lamp]), SamplingPlan()
    layers = render_cached(cache, scenes, camera, rays, windows, 0, plan, None, None)
    return layers.radiance[0, ..., 0], rays


def of_flank(
    found: tuple[NDArray[np.floating], ChiefRays], side: float = 1.0, factor: float = 1.0
) -> tuple[float, NDArray[np.floating], NDArray[np.floating]]:
    """The mean radiance, the points and the normals of a ball's flank, on one side of it along x;
    lengths are divided by a factor.
    """
    image, rays = found
    normals, points = rays.normals.astype(float), rays.points.astype(float) / factor
    across = side * normals[..., 0]
    flank = (rays.region == Region.INDENTER) & (across > 0.3)
    flank &= (np.abs(normals[..., 1]) < across) & (points[..., 2] > ABOVE_RIM)
    assert flank.sum() > 50
    return float(image[flank].mean()), points[flank], normals[flank]


@pytest.mark.parametrize(
    ("factor", "height", "side"),
    [(1.0, 41.2, 0.5), (4.0, 5.0, 0.5), (4.0, 21.2, 1.0), (4.0, 41.2, 80 / 30 / 2)],
)
def test_cells_of_a_large_skin_grow_with_the_distance_of_the_lamp(
    factor: float, height: float, side: float
) -> None:
    large = replace(skin(), vertices=factor * skin().vertices)  # 20 or 80 mm
    lamp = replace(OVERHEAD, position=(0.0, 0.0, height))
    cells = store([large], lamp, np.zeros((1, 3))).cells
    assert 1 / np.asarray(cells.inverse_size)[0] == pytest.approx(side)


@pytest.mark.parametrize("camera", [CAMERA, OBLIQUE])
def test_raised_flank_in_grazing_light_is_lit_as_in_the_open(camera: RayCamera) -> None:
    got, *places = of_flank(picture([skin()], ball(), camera, PHOTONS, guided_by=CAMERA))
    wanted = REFLECTANCE / np.pi * irradiance(*places).mean()
    assert got == pytest.approx(wanted, rel=AGREEMENT)


@pytest.mark.parametrize("extent", [9.5, 4.0])
def test_raised_flank_on_a_small_skin_is_lit_as_on_a_large_one(extent: float) -> None:
    """A sensor that is smaller by a factor is brighter by its inverse square, and else the same as
    one with a skin of 10 mm.
    """
    factor = extent / 10
    place = (LAMP.position[0] * factor, 0.0, LAMP.position[2] * factor)
    lamp = replace(LAMP, position=place, size=(LAMP.size[0] * factor,) * 2)
    camera = replace(CAMERA, position=(0.0, 0.0, CAMERA.position[2] * factor))
    plate = replace(skin(), vertices=skin().vertices * (extent / 20))
    cap = replace(ball(), vertices=ball().vertices * factor)
    got, *places = of_flank(picture([plate], cap, camera, PHOTONS, lamp=lamp), factor=factor)
    wanted = REFLECTANCE / np.pi * irradiance(*places).mean() / factor**2
    assert got == pytest.approx(wanted, rel=SMALL_AGREEMENT)


def test_a_flank_is_lit_by_the_foot_of_a_white_wall() -> None:
    """Light that rises from the foot of the wall to the flank lands nowhere on the skin."""
    found = picture([skin(), wall()], ball(), CAMERA, PHOTONS, guided_by=CAMERA)
    got, *places = of_flank(found, side=-1.0)
    wanted = REFLECTANCE / np.pi * from_wall(*places).mean()
    assert got == pytest.approx(wanted, rel=AGREEMENT)


def test_a_black_ceiling_that_shades_nothing_leaves_the_image_as_it_is() -> None:
    """Light from the skin that the ceiling absorbs reaches the ball as light that escapes does."""
    cap, plate = ball(BRIGHT), skin(BRIGHT)
    alone, rays = picture([plate], cap, BELOW_CEILING, FEW_PHOTONS)
    covered, _ = picture([plate, ceiling()], cap, BELOW_CEILING, FEW_PHOTONS)
    normals = rays.normals
    pressed = rays.region == Region.INDENTER
    for side in (normals[..., 0] > 0.3, normals[..., 0] < -0.3, np.abs(normals[..., 1]) > 0.5):
        part = pressed & side
        assert part.sum() > 50
        assert covered[part].mean() == pytest.approx(alone[part].mean(), rel=ABSORBED)


@pytest.mark.parametrize(("lamp", "grazes"), [(LAMP, True), (OVERHEAD, False)])
def test_only_light_that_grazes_is_followed_above_the_surface(lamp: Emitter, grazes: bool) -> None:
    light = store([skin()], lamp, np.zeros((1, 3)))
    cache, _ = light.radiance_cache(0, TracingLimits(50_000), lambda *told: None)
    assert (cache.binned.above is not None) == grazes

"""Small scenes with known answers, and the ways to render one: photon mapping, the pooled light
field, Mitsuba's path.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from benchmarks.mitsuba_export import Colour, mitsuba_scene
from optisense.design.emitters import Intensity
from optisense.optics.camera.projection import RayCamera
from optisense.optics.imaging.cached import render_cached
from optisense.optics.imaging.sampling import SamplingPlan
from optisense.optics.imaging.sppm import render_sppm
from optisense.optics.radiance_cache.lit_scene import LitScene
from optisense.optics.radiance_cache.store import CacheStore
from optisense.optics.radiance_cache.tracing_limits import TracingLimits
from optisense.optics.scene.contact_scenes import ContactScenes
from optisense.optics.scene.emitters import (
    Emitter,
    EmitterShape,
    EmitterTable,
    emitter_table,
)
from optisense.optics.scene.lamp_windows import LampWindows
from optisense.optics.scene.ray_scene import Piece, RayScene
from optisense.optics.scene.surfaces import Region, Surface, SurfaceKind, is_coloured
from optisense.optics.transport.chief_rays import ChiefRays, RayOutcome, trace_chief_rays
from optisense.optics.transport.emission_guide import uniform_guide
from optisense.optics.transport.photon_map import SURFACE_SHIFT, PhotonMap
from optisense.optics.transport.photons import Emission, trace_photons

FloatArray = NDArray[np.floating]

GEL_INDEX = 1.41
REFEREE_SLAB = (16.0, 12.0, 4.0)
REFEREE_RADIANCE = 40.0
REFEREE_INTENSITY = 400.0
REFEREE_BUMP = (3.0, 0.8)
"""Radius of the sphere and how deep it is pressed in, mm."""


@dataclass(frozen=True)
class ReferenceScene:
    """Surfaces, lights and a camera. ``flux`` is mW per channel of each light of a group."""

    pieces: list[Piece]
    emitters: list[Emitter]
    flux: list[Colour]
    camera: RayCamera

    def ray_scene(self) -> RayScene:
        """The scene for rays."""
        return RayScene(self.pieces)

    def table(self) -> EmitterTable:
        """The lights, on the device."""
        return emitter_table(self.emitters, len(self.flux))

    def _coloured(self) -> bool:
        return any(is_coloured(piece.surface) for piece in self.pieces)

    def chief_rays(self) -> ChiefRays:
        """One ray through the middle of every pixel."""
        count = sum(len(piece.faces) for piece in self.pieces)
        return trace_chief_rays(self.ray_scene(), self.camera, np.arange(count))

    def _scaled(self, layers: FloatArray) -> FloatArray:
        return np.asarray(layers, np.float64) * np.asarray(self.flux)[:, None, None, :]

    def pairwise(
        self, passes: int, per_light: int, seed: int = 0, radius: float = 0.1
    ) -> tuple[FloatArray, FloatArray]:
        """Progressive photon mapping: radiance (groups, h, w, 3), and the same from either half
        of the passes.
        """
        result = render_sppm(
            self.ray_scene(),
            Emission(self.table(), uniform_guide(len(self.emitters)), per_light, seed),
            self.camera,
            passes,
            coloured=self._coloured(),
            radius=radius,
        )
        return self._scaled(result.layers), np.stack([self._scaled(h) for h in result.halves])

    def pooled(self, photons: int, seed: int = 0) -> FloatArray:
        """The pooled radiance cache: radiance (groups, h, w, 3)."""
        scene = self.ray_scene()
        surfaces = [piece.surface for piece in self.pieces]
        opaque = [i for i, s in enumerate(surfaces) if s.kind is SurfaceKind.OPAQUE]
        rays = trace_chief_rays(scene, self.camera, np.zeros(len(scene.faces), dtype=np.int64))
        lobes = [surfaces[i].alpha for i in opaque if surfaces[i].specularity > 0]
        lit = LitScene(
            scene,
            [self.pieces[i] for i in opaque],
            self.table(),
            self._coloured(),
            min(lobes, default=None),
        )
        store = CacheStore(lit, rays.points[rays.hit])
        light = store.radiance_cache(
            seed, TracingLimits(photons), lambda stage, part, traced, noise: None
        )
        fixed = RayScene([self.pieces[i] for i in opaque], opaque, scene.table)
        scenes = ContactScenes(scene, fixed, None, mi.Float())
        windows, plan = LampWindows.of(self.emitters), SamplingPlan()
        layers = render_cached(light, scenes, self.camera, rays, windows, seed, plan, None, None)
        return self._scaled(layers.radiance)

    def path(self, samples: int, seed: int = 0) -> FloatArray:
        """Mitsuba's path tracer: radiance (h, w, 3) of all groups together."""
        described = mitsuba_scene(
            self.pieces,
            self.emitters,
            self.camera,
            self.flux,
            samples=samples,
        )
        return np.asarray(mi.render(mi.load_dict(described), seed=seed), dtype=np.float64)


def isotropic() -> Intensity:
    """The same intensity all around."""
    return Intensity(np.array([0.0, 180.0]), np.zeros(1), np.ones((1, 2)))


def narrow_beam(half_angle: float = 0.02) -> Intensity:
    """The same intensity within an angle (degrees) from the axis, and none beyond."""
    return Intensity(np.array([0.0, half_angle]), np.zeros(1), np.ones((1, 2)))


def fresnel(angle: float, ratio: float) -> tuple[float, float]:
    """Unpolarised reflectance, and the refracted angle; ratio is far over near index."""
    inside = np.arcsin(np.sin(angle) / ratio)
    s = (np.sin(angle - inside) / np.sin(angle + inside)) ** 2
    p = (np.tan(angle - inside) / np.tan(angle + inside)) ** 2
    return float((s + p) / 2), float(inside)


class Landings:
    """Photons as arrays: place (n, 3), direction (n, 3), power (n,) or (n, 3), surface (n,)."""

    def __init__(self, found: PhotonMap) -> None:
        place, travel = (np.asarray(x)[: 4 * found.count] for x in (found.place, found.travel))
        self.place = place.reshape(-1, 4)[:, :3].astype(float)
        self.surface = place[3::4].copy().view(np.uint32) >> SURFACE_SHIFT
        self.direction = travel.reshape(-1, 4)[:, :3].astype(float)
        power = np.asarray(found.power)[: (4 if found.coloured else 1) * found.count].astype(float)
        self.power = power.reshape(-1, 4)[:, :3] if found.coloured else power


def landings_of(
    pieces: list[Piece], emitters: list[Emitter], photons: int, coloured: bool = False
) -> Landings:
    """The landings of one pass from lights of one group."""
    count = len(emitters)
    emission = Emission(emitter_table(emitters, 1), uniform_guide(count), photons // count, 1)
    return Landings(trace_photons(RayScene(pieces), emission, coloured=coloured))


def pixel_middles(camera: RayCamera) -> tuple[mi.UInt32, mi.Point2f]:
    """The number and the middle of every pixel."""
    pixel = dr.arange(mi.UInt32, camera.width * camera.height)
    width = camera.width
    return pixel, mi.Point2f(mi.Float(pixel % width) + 0.5, mi.Float(pixel // width) + 0.5)


def rays_that_hit(points: np.ndarray, region: np.ndarray | Region = Region.SENSING) -> ChiefRays:
    """Chief rays straight down that hit points (h, w, 3), in one region or in a map (h, w)."""
    shape = points.shape[:2]
    up = np.broadcast_to(np.array([0.0, 0.0, 1.0], np.float32), points.shape)
    return ChiefRays(
        points=points,
        normals=up,
        directions=-up,
        incidence=np.ones(shape, np.float32),
        outcome=np.full(shape, RayOutcome.HIT, np.uint8),
        face=np.zeros(shape, np.int64),
        region=np.broadcast_to(region, shape).astype(np.uint8),
        mirrors=np.zeros(shape, np.uint32),
        reflections=np.zeros(shape, np.uint32),
        lamp=np.zeros(shape, np.uint32),
    )


def diffuse_coating(reflectance: float) -> Surface:
    """A Lambertian sensing surface."""
    return Surface(SurfaceKind.OPAQUE, 1.0, 1.0, 0.0, (reflectance,) * 3, region=Region.SENSING)


def metal_coating(alpha: float, eta: Colour, k: Colour, specularity: float = 1.0) -> Surface:
    """A rough metal (GGX) as sensing surface; below specularity 1, blended with a diffuse
    reflectance of 0.5.
    """
    return Surface(
        SurfaceKind.OPAQUE,
        1.0,
        alpha,
        specularity,
        (0.5, 0.5, 0.5),
        eta,
        k,
        region=Region.SENSING,
    )


def quad(name: str, corners: Sequence[Sequence[float]], surface: Surface) -> Piece:
    """A plane quadrilateral; its normal follows the right hand along the corners."""
    return Piece(name, np.asarray(corners, float), np.array([[0, 1, 2], [0, 2, 3]]), surface)


def floor(surface: Surface, half: float = 10.0, z: float = 0.0) -> Piece:
    """A level square about the z axis that faces up."""
    corners = [(-half, -half, z), (half, -half, z), (half, half, z), (-half, half, z)]
    return quad("floor", corners, surface)


def box(
    name: str,
    low: Sequence[float],
    high: Sequence[float],
    surface: Surface,
    without: Sequence[str] = (),
    inward: bool = False,
) -> Piece:
    """An axis-parallel box of two triangles a side, normals outward unless ``inward``.

    ``without`` leaves out sides, named "-x", "+x", ... "+z".
    """
    points = np.array(
        [[(low, high)[i][0], (low, high)[j][1], (low, high)[k][2]]
         for i in range(2) for j in range(2) for k in range(2)],
        dtype=float,
    )  # fmt: skip
    sides = {
        "-x": (0, 1, 3, 2), "+x": (4, 6, 7, 5), "-y": (0, 4, 5, 1),
        "+y": (2, 3, 7, 6), "-z": (0, 2, 6, 4), "+z": (1, 5, 7, 3),
    }  # fmt: skip
    faces = []
    for side, (a, b, c, d) in sides.items():
        if side not in without:
            faces += [[a, b, c], [a, c, d]]
    turned = np.array(faces)
    return Piece(name, points, turned[:, ::-1] if inward else turned, surface)


def bumped_plane(
    surface: Surface,
    size: tuple[float, float] = REFEREE_SLAB[:2],
    ball: tuple[float, float] = REFEREE_BUMP,
    spacing: float = 0.1,
) -> Piece:
    """The plane z = 0 about the origin, a ball of (radius, depth) pressed in along +z in its
    middle; flat facets.
    """
    counts = [round(s / spacing) + 1 for s in size]
    x, y = (np.linspace(-s / 2, s / 2, n) for s, n in zip(size, counts, strict=True))
    grid_x, grid_y = np.meshgrid(x, y, indexing="ij")
    radius, depth = ball
    cap = np.sqrt(np.maximum(radius**2 - grid_x**2 - grid_y**2, 0.0)) - (radius - depth)
    points = np.stack([grid_x, grid_y, np.maximum(cap, 0.0)], axis=-1).reshape(-1, 3)
    index = np.arange(len(points)).reshape(counts)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    faces = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)]).reshape(-1, 3)
    return Piece("coating", points, faces, surface)


def referee_scene(
    coating: Surface,
    slab: bool = True,
    lights: str = "area",
    resolution: tuple[int, int] = (160, 120),
) -> ReferenceScene:
    """A coated slab of gel with a bump, lit from three sides through its walls, seen from above.

    Args:
        coating: of the bottom, z = 0.
        slab: whether there is gel; without it the coating lies bare.
        lights: "area" (4 x 2 mm, radiance REFEREE_RADIANCE, outside the slab), "point"
            (intensity REFEREE_INTENSITY, at the same places), or "embedded" (smaller area
            lights inside the gel, tilted so that the camera sees their dark backs).
        resolution: pixels, width and height.
    """
    half_x, half_y, height = REFEREE_SLAB[0] / 2, REFEREE_SLAB[1] / 2, REFEREE_SLAB[2]
    pieces = [bumped_plane(coating)]
    if slab:
        gel = Surface(SurfaceKind.DIELECTRIC, eta=GEL_INDEX)
        low, high = (-half_x, -half_y, 0.0), (half_x, half_y, height)
        pieces.append(box("slab", low, high, gel, without=["-z"]))
    size = (4.0, 2.0)
    distances = (9.5, 9.5, 7.5)
    if lights == "embedded":
        size, distances = (3.0, 1.0), (7.0, 7.0, 5.0)
    ways = ((1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, -1.0, 0.0))
    emitters, flux = [], []
    for number, (way, distance) in enumerate(zip(ways, distances, strict=True)):
        place = (-way[0] * distance, -way[1] * distance, height / 2)
        colour = np.eye(3)[number]
        if lights == "embedded":
            way = (way[0], way[1], -1.0)
        if lights == "point":
            emitter = Emitter(number, place, way, intensity=isotropic())
            power = 4 * np.pi * REFEREE_INTENSITY
        else:
            emitter = Emitter(number, place, way, shape=EmitterShape.RECTANGLE, size=size)
            power = np.pi * size[0] * size[1] * REFEREE_RADIANCE
            pieces.append(emitting_face(number, emitter))
        emitters.append(emitter)
        flux.append((float(colour[0] * power), float(colour[1] * power), float(colour[2] * power)))
    camera = RayCamera((0.0, 0.0, 24.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0), 42.0, *resolution)
    return ReferenceScene(pieces, emitters, flux, camera)


def side_lit_block(glass: Surface, side: Surface | None = None) -> ReferenceScene:
    """A coated block, lit by a lamp in air through its side, which may have a surface of its own,
    seen from above.
    """
    lamp = Emitter(0, (-7.0, 0, 2), (1, 0, 0), (0, 0, 1), EmitterShape.RECTANGLE, (6.0, 3.0))
    low, high = (-6, -5, 0), (6, 5, 4)
    pieces = [box("block", low, high, glass, without=["-z"] if side is None else ["-z", "-x"])]
    if side is not None:
        pieces.append(box("side", low, high, side, without=["-z", "+z", "+x", "-y", "+y"]))
    pieces += [emitting_face(0, lamp), floor(diffuse_coating(0.6), 6.0)]
    camera = RayCamera((0, 0, 24), (0, 0, -1), (0, 1, 0), 22, 32, 24)
    return ReferenceScene(pieces, [lamp], [(100.0,) * 3], camera)


def emitting_face(number: int, emitter: Emitter) -> Piece:
    """The face of a rectangular area light, for cameras to see and light to end on."""
    s, t, _ = emitter.frame
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * (np.array(emitter.size) / 2)
    points = np.asarray(emitter.position) + corners[:, :1] * s + corners[:, 1:] * t
    return quad(f"light {number}", points.tolist(), Surface(SurfaceKind.LIGHT, light=number))

"""Pictures of a small region by light tracing: photons that land there are connected to the camera.

A photon that lands at a point adds to the pixel that sees this point (particle tracing, Arvo 1986).
The film position of the point, and the area that the pixel covers there, follow from four camera
rays. In contrast to progressive photon mapping, nothing is gathered within a radius, so that the
mean over a pixel has no bias, also where skin and contact meet. More photons are sent where they
reach the region. The camera must see the region through smooth interfaces.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from optisense import OpticalModel
from optisense.errors import RenderError
from optisense.geometry import TriangleMesh
from optisense.optics.backend.arrays import indices
from optisense.optics.camera.projection import RayCamera
from optisense.optics.imaging._film import Film
from optisense.optics.imaging.sppm import build_grid, estimate_radiance
from optisense.optics.scene.coating_bsdf import coating_of, evaluate_coating
from optisense.optics.scene.emitters import EmitterTable
from optisense.optics.scene.lamp_windows import LampWindows
from optisense.optics.scene.ray_scene import Ray, RayScene
from optisense.optics.scene.surface_cells import build_cells, cells_near
from optisense.optics.transport.camera_paths import (
    PathEnd,
    film_samples,
    find_visible_points,
    follow,
    generator,
)
from optisense.optics.transport.emission_guide import EmissionGuide, learn_guide, uniform_guide
from optisense.optics.transport.interact import RayKind
from optisense.optics.transport.photon_map import GROUP_MASK, PhotonMap
from optisense.optics.transport.photons import Emission, TargetCells, trace_photons, trace_pilot

FloatArray = NDArray[np.floating]

DEGREE = 3
"""Degree of the polynomial that maps points of the region to film positions. Its error is 0.006
pixels on GelSight Svelte, the largest of the built-in sensors. A correction by the difference
between the polynomial at the photon and at the point that a camera ray hits removes it."""
BOX_MARGIN = 0.1
"""Distance (mm) by which the box in which photons are looked at exceeds the points that the middles
of pixels see. Between them, the tip of a ball rises above them: in the contact of the cylindrical
GelSight Mini, 0.3 % of the light would be lost without it."""
HIT_DISTANCE = 0.01
"""Distance (mm) between a photon and the hit of its camera ray above which the camera does not see
the photon. Corrected rays miss it by less than 0.0001 mm, and occluders are farther away."""
DIFFERENCE = 0.05
"""Shift (pixels) of the camera rays from which the area of a pixel is computed: small against a
pixel, and large against the rounding of film positions, of at most 0.00003 pixels."""
MIN_COSINE = 1e-3
"""Lower bound on the cosine of incidence (89.9 degrees) that a photon's power is divided by."""
MARGIN = 1.0
"""Distance (mm) around the points of the region within which pilot photons count as arriving: light
that lands there would meet the flank of an indenter, which stands off the surface by up to 1 mm."""
PILOT_CELL_SIZE = 0.5
"""Side (mm) of the cells that decide whether a pilot photon arrives: half of `MARGIN`."""
PILOT_PHOTONS = 3_000_000
"""Number of photons of the pilot pass, ten times that of an image, since few reach the region."""
REFLECTED_RADIUS = 0.3
"""Gather radius (mm) for the light that interfaces reflect into the camera. It is at
most 8 % of the light (on GelSight Svelte; none on GelSight Mini), and varies over millimetres."""


@dataclass(frozen=True)
class FilmMap:
    """Polynomial from points of the region to film positions.

    Attributes:
        lower, upper: corners (3,) of the box around the region, mm.
        powers: exponents (terms, 3) of the terms.
        coefficients: coefficients (terms, 2) in the box's coordinates from -1 to 1.
    """

    lower: FloatArray
    upper: FloatArray
    powers: NDArray[np.integer]
    coefficients: FloatArray

    @classmethod
    def fit(cls, points: FloatArray, film: FloatArray) -> FilmMap:
        """Fit the map to visible points (n, 3), mm, and their film positions (n, 2), pixels."""
        lower, upper = points.min(axis=0) - BOX_MARGIN, points.max(axis=0) + BOX_MARGIN
        every = itertools.product(range(DEGREE + 1), repeat=3)
        powers = np.array([each for each in every if sum(each) <= DEGREE])
        unit = 2 * (points - lower) / (upper - lower) - 1
        terms = np.prod(unit[:, None] ** powers, axis=2)
        return cls(lower, upper, powers, np.linalg.lstsq(terms, film, rcond=1e-9)[0])

    def contains(self, point: mi.Point3f) -> mi.Bool:
        """Return a mask (n,) of the points in the box."""
        low, high = mi.Point3f(*map(float, self.lower)), mi.Point3f(*map(float, self.upper))
        return dr.all(point >= low) & dr.all(point <= high)

    def __call__(self, point: mi.Point3f) -> mi.Point2f:
        """Return the approximate film positions (2, n) of points."""
        middle, half = (self.lower + self.upper) / 2, (self.upper - self.lower) / 2
        unit = [(point[k] - float(middle[k])) / float(half[k]) for k in range(3)]
        raised = [[mi.Float(1), u, u * u, u * u * u] for u in unit]
        found = mi.Point2f(0)
        for (i, j, k), (x, y) in zip(self.powers, self.coefficients, strict=True):
            term = raised[0][i] * raised[1][j] * raised[2][k]
            found += mi.Point2f(float(x) * term, float(y) * term)
        return found


def light_traced(
    model: OpticalModel, scene: RayScene, camera: RayCamera, photons: int, passes: int
) -> Callable[[int], FloatArray]:
    """Return a function that renders the picture (h, w, 3) of a region with a given seed.

    Args:
        scene: the surfaces with contacts.
        camera: the camera, of the region's pixels alone.
        photons: number of photons of each of the passes of a picture.

    Raises:
        RenderError: the camera does not see the region through smooth interfaces.
    """
    if scene.rough or scene.dispersive:
        raise RenderError(
            "Light tracing connects photons to the camera by one ray, which rough or dispersive "
            "interfaces do not have"
        )
    points, film = _seen(scene, camera)
    film_map = FilmMap.fit(points, film)
    table = model.scenes.emitter_table
    coloured = model.scenes.coloured
    per_light = max(1, photons // table.count)
    guide = _guide(model, points)
    flux = np.array([model.design.lights[name].channel_flux() for name in model.groups])

    def render(seed: int) -> FloatArray:
        layers = np.zeros((table.groups, camera.height, camera.width, 3))
        for number in range(passes):
            emission = Emission(table, guide, per_light, seed, first=number * per_light)
            landed = trace_photons(scene, emission, coloured=coloured)
            layers += _direct(scene, camera, film_map, landed, table.groups) / passes
            if number == 0:
                layers += _reflected(scene, camera, landed, table, seed)
        return np.asarray(np.einsum("ghwc,gc->hwc", layers, flux))

    return render


def _seen(scene: RayScene, camera: RayCamera) -> tuple[FloatArray, FloatArray]:
    """Return the points (n, 3), mm, that the middles of pixels see, and their film positions."""
    index = dr.arange(mi.UInt32, camera.width * camera.height)
    x, y = index % camera.width, index // camera.width
    film = mi.Point2f(mi.Float(x) + 0.5, mi.Float(y) + 0.5)
    end = _end(scene, camera, film)
    dr.eval(end, film)
    if not np.asarray(end.valid).all():
        raise RenderError("A pixel of the region sees no opaque surface")
    return np.asarray(end.point, dtype=np.float64).T, np.asarray(film, dtype=np.float64).T


def _end(scene: RayScene, camera: RayCamera, film: mi.Point2f) -> PathEnd:
    """Return the ends of the main paths of film positions."""
    count = dr.width(film)
    start = Ray(*camera.rays(film.x, film.y), dr.full(mi.Bool, True, count))
    if scene.absorbing:
        start.absorption = mi.Color3f(0)
    unused = generator(dr.arange(mi.UInt32, count))
    return follow(scene, start, mi.Color3f(1), unused, RayKind.CAMERA).end


def _guide(model: OpticalModel, points: FloatArray) -> EmissionGuide:
    """Return an emission guide towards points (n, 3), mm, learned without contacts."""
    scenes = model.scenes
    mesh = TriangleMesh.joined([TriangleMesh(p.vertices, p.faces) for p in scenes.opaque])
    cells = build_cells(mesh.vertices, mesh.faces, PILOT_CELL_SIZE)
    near = cells_near(cells, points, MARGIN)
    lights = scenes.emitter_table.count
    per_light = max(1, PILOT_PHOTONS // lights)
    arrived, _ = trace_pilot(
        scenes.full,
        Emission(scenes.emitter_table, uniform_guide(lights), per_light, seed=1),
        TargetCells(cells, indices(near)),
        scenes.coloured,
    )
    return learn_guide(arrived, lights, per_light)


def _direct(
    scene: RayScene, camera: RayCamera, film_map: FilmMap, photons: PhotonMap, groups: int
) -> FloatArray:
    """Return the light (groups, h, w, 3) of photons that the camera sees where they land."""
    width, height = camera.width, camera.height
    every = dr.arange(mi.UInt32, photons.count)
    place = dr.gather(mi.Vector4f, photons.place, every)
    point = mi.Point3f(place.x, place.y, place.z)
    film = film_map(point)
    near = film_map.contains(point)
    near &= (film.x > -1) & (film.x < width + 1) & (film.y > -1) & (film.y < height + 1)
    kept = dr.compress(near)
    place = dr.gather(mi.Vector4f, photons.place, kept)
    travel = dr.gather(mi.Vector4f, photons.travel, kept)
    if photons.coloured:
        four = dr.gather(mi.Vector4f, photons.power, kept)
        power = mi.Color3f(four.x, four.y, four.z)
    else:
        power = mi.Color3f(dr.gather(mi.Float, photons.power, kept))
    group = dr.reinterpret_array(mi.UInt32, place.w) & GROUP_MASK
    point = mi.Point3f(place.x, place.y, place.z)
    direction = mi.Vector3f(travel.x, travel.y, travel.z)
    wanted = film_map(point)
    film = mi.Point2f(wanted)
    dr.eval(point, direction, power, group, wanted, film)
    film += wanted - film_map(_end(scene, camera, film).point)
    dr.eval(film)
    end = _end(scene, camera, film)
    dr.eval(end)
    sides = []
    for shift in (mi.Point2f(DIFFERENCE, 0), mi.Point2f(0, DIFFERENCE)):
        beside = _end(scene, camera, film + shift)
        along = beside.towards_eye
        reach = dr.dot(end.face_normal, end.point - beside.point) / dr.dot(end.face_normal, along)
        sides.append(beside.point + along * reach)
        dr.eval(sides)
    area = dr.norm(dr.cross(sides[0] - end.point, sides[1] - end.point)) / DIFFERENCE**2
    seen = end.valid & (dr.norm(end.point - point) < HIT_DISTANCE)
    seen &= (film.x >= 0) & (film.x < width) & (film.y >= 0) & (film.y < height)
    seen &= dr.dot(end.face_normal, direction) < 0
    coating = coating_of(scene.table, end.surface, seen)
    light = evaluate_coating(coating, end.normal, -direction, end.towards_eye)
    light *= power * end.weight / (dr.maximum(travel.w, MIN_COSINE) * area)
    pixel = mi.UInt32(film.x) + width * mi.UInt32(film.y)
    total = dr.zeros(mi.Float, groups * width * height * 3)
    for k in range(3):
        dr.scatter_add(total, light[k], (group * (width * height) + pixel) * 3 + k, seen)
    return np.asarray(total, dtype=np.float64).reshape(groups, height, width, 3)


def _reflected(
    scene: RayScene, camera: RayCamera, photons: PhotonMap, table: EmitterTable, seed: int
) -> FloatArray:
    """Return the light (groups, h, w, 3) that interfaces reflect into the camera."""
    width, height = camera.width, camera.height
    pixel = dr.arange(mi.UInt32, width * height)
    film = film_samples(pixel, width, dr.opaque(mi.UInt32, 1), seed)
    image = Film(width * height, table.groups)
    image.count(pixel)
    _, points = find_visible_points(scene, camera, pixel, mi.UInt32(1), film, seed)
    if points is None:
        return np.zeros((table.groups, height, width, 3))
    grid = build_grid(photons, *scene.bounds, REFLECTED_RADIUS)
    radius = dr.opaque(mi.Float, REFLECTED_RADIUS)
    image.add(points, estimate_radiance(grid, scene.table, points, radius, table.groups))
    image.add_light(points, LampWindows.of(table.emitters))
    return image.layers(width, height)

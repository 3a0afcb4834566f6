"""Stochastic progressive photon mapping (SPPM), the reference estimator.

Every pass traces photons through the scene with its contacts, and gathers them at new visible
points with a radius that shrinks as passes^(-1/6) (area as passes^(-1/3), the rate of Knaus and
Zwicker 2011, alpha = 2/3), so that both noise and bias go to zero. It is slower than the radiance
cache, which is verified against it.

A photon's power is divided by the cosine at the place where *it* landed. The quotient is the flux
through a plane across its path, which hardly changes in the neighbourhood, while the density of
landings follows the local tilt. Reflection is then evaluated with the visible point's own normal.
The kernel is Epanechnikov's, over a disc of radius r.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from optisense.optics.camera.projection import RayCamera
from optisense.optics.imaging._film import Film
from optisense.optics.scene.coating_bsdf import coating_of, evaluate_coating
from optisense.optics.scene.lamp_windows import LampWindows
from optisense.optics.scene.ray_scene import RayScene
from optisense.optics.transport.camera_paths import VisiblePoints, film_samples, find_visible_points
from optisense.optics.transport.photon_map import GROUP_MASK, PhotonMap
from optisense.optics.transport.photons import Emission, trace_photons

MIN_COSINE = 0.03
"""Lower bound on the cosine of incidence (88 degrees) that a photon's power is divided by, so that
an isolated grazing photon does not become a bright spot. It darkens light below 2 degrees, which is
a small part of all light."""
FIRST_RADIUS = 0.3
"""Gather radius (mm) of the first pass. As the radius shrinks with each pass, it affects how fast
noise falls and not the limit of the image. 0.3 mm is five pixels of GelSight Mini at 320 pixels.
`OpticalModel.render` takes a smaller one on small sensing surfaces (see `fineness`)."""


@dataclass
class PhotonGrid:
    """Photons in the order of the cells of a uniform grid.

    Attributes:
        lower: lower corner of the grid, mm.
        inverse_size: inverse of the side of a cell, 1/mm.
        counts: numbers of cells along x, y and z.
        starts: (cells + 1,) index of the first photon of each cell, and the number of photons.
        place, travel, power, coloured: as in `PhotonMap`.
    """

    lower: mi.Point3f
    inverse_size: mi.Float
    counts: mi.Vector3u
    starts: mi.UInt32
    place: mi.Float
    travel: mi.Float
    power: mi.Float
    coloured: bool


def _cell(
    point: mi.Point3f, lower: mi.Point3f, inverse: mi.Float, counts: mi.Vector3u
) -> mi.Vector3u:
    relative = (point - lower) * inverse
    return mi.Vector3u(
        *(mi.UInt32(dr.clip(relative[i], 0.0, mi.Float(counts[i] - 1))) for i in range(3))
    )


def build_grid(
    photons: PhotonMap, lower: NDArray[np.floating], upper: NDArray[np.floating], radius: float
) -> PhotonGrid:
    """Sort photons into the cells of a grid by counting sort.

    Args:
        lower, upper: corners (3,) of the box that the grid fills, mm.
        radius: side (mm) of the cells; larger where there would be more than 30 million cells.
    """
    size = [max(float(upper[i] - lower[i]), radius) for i in range(3)]
    cell_size = max(radius, max(size) / 1000)
    while True:
        counts = [int(s / cell_size) + 1 for s in size]
        if counts[0] * counts[1] * counts[2] < 30_000_000:
            break
        cell_size *= 1.3
    lower3 = mi.Point3f(*map(float, lower))
    inverse = dr.opaque(mi.Float, 1 / cell_size)
    counts3 = mi.Vector3u(*counts)
    dr.make_opaque(lower3, counts3)
    cells = counts[0] * counts[1] * counts[2]
    index = dr.arange(mi.UInt32, photons.count)
    place = dr.gather(mi.Vector4f, photons.place, index)
    cell = _cell(mi.Point3f(place.x, place.y, place.z), lower3, inverse, counts3)
    flat = cell.x + counts3.x * (cell.y + counts3.y * cell.z)
    tally = dr.zeros(mi.UInt32, cells + 1)
    rank = dr.scatter_inc(tally, flat)
    dr.eval(rank, tally)
    starts = dr.prefix_sum(tally)
    target = dr.gather(mi.UInt32, starts, flat) + rank
    out_place = dr.zeros(mi.Float, photons.count * 4)
    out_travel = dr.zeros(mi.Float, photons.count * 4)
    out_power = dr.zeros(mi.Float, photons.count * (4 if photons.coloured else 1))
    dr.scatter(out_place, place, target)
    dr.scatter(out_travel, dr.gather(mi.Vector4f, photons.travel, index), target)
    if photons.coloured:
        dr.scatter(out_power, dr.gather(mi.Vector4f, photons.power, index), target)
    else:
        dr.scatter(out_power, dr.gather(mi.Float, photons.power, index), target)
    dr.eval(out_place, out_travel, out_power, starts)
    return PhotonGrid(
        lower3, inverse, counts3, starts, out_place, out_travel, out_power, photons.coloured
    )


@dr.syntax
def estimate_radiance(
    grid: PhotonGrid,
    surfaces: mi.Float,
    points: VisiblePoints,
    radius: mi.Float,
    groups: int,
) -> list[mi.Color3f]:
    """Return the radiance (3, n) of visible points towards the camera for each light group, with
    lights of 1 mW.

    Args:
        surfaces: the table of surfaces (`surface_table`).
        radius: radius (mm) of the disc over which photons are counted.
        groups: number of light groups.
    """
    coating = coating_of(surfaces, points.surface, points.valid)
    centre = _cell(points.point, grid.lower, grid.inverse_size, grid.counts)
    r2 = radius * radius
    totals = [mi.Color3f(0) for _ in range(groups)]
    step = mi.UInt32(0)
    reach = mi.UInt32(dr.ceil(radius * grid.inverse_size))
    low = mi.Vector3u(centre - dr.minimum(reach, centre))
    high = mi.Vector3u(dr.minimum(centre + reach, grid.counts - 1))
    span = high - low + 1
    # Cells along x are neighbours in memory, so that each (y, z) has one contiguous range of
    # photons.
    rows = dr.select(points.valid, span.y * span.z, 0)
    while step < rows:
        y = low.y + step % span.y
        z = low.z + step // span.y
        base = grid.counts.x * (y + grid.counts.y * z)
        j = dr.gather(mi.UInt32, grid.starts, base + low.x)
        end = dr.gather(mi.UInt32, grid.starts, base + high.x + 1)
        while j < end:
            place = dr.gather(mi.Vector4f, grid.place, j)
            offset = mi.Point3f(place.x, place.y, place.z) - points.point
            distance2 = dr.squared_norm(offset)
            if distance2 < r2:
                travel = dr.gather(mi.Vector4f, grid.travel, j)
                direction = mi.Vector3f(travel.x, travel.y, travel.z)
                kernel = 2 * (1 - distance2 / r2) / dr.maximum(travel.w, MIN_COSINE)
                value = (
                    evaluate_coating(coating, points.normal, -direction, points.towards_eye)
                    * kernel
                )
                value = dr.select(dr.dot(points.face_normal, direction) < 0, value, 0)
                if dr.hint(grid.coloured, mode="scalar"):
                    power = dr.gather(mi.Vector4f, grid.power, j)
                    value *= mi.Color3f(power.x, power.y, power.z)
                else:
                    value *= dr.gather(mi.Float, grid.power, j)
                group = dr.reinterpret_array(mi.UInt32, place.w) & GROUP_MASK
                for g in range(groups):
                    totals[g] += dr.select(group == g, value, 0)
            j += 1
        step += 1
    return [total / (dr.pi * r2) for total in totals]


@dataclass
class SppmResult:
    """The result of SPPM.

    Attributes:
        layers: (groups, h, w, 3) radiance for lights of 1 mW.
        halves: (2, groups, h, w, 3) the layers of the even and of the odd passes.
        passes: number of passes.
        photons: number of emitted photons.
    """

    layers: NDArray[np.float32]
    halves: NDArray[np.float32]
    passes: int
    photons: int

    @property
    def noise(self) -> float:
        """Relative RMS noise of the layers, from the difference of their halves; infinite after a
        single pass.
        """
        if self.passes < 2:
            return math.inf
        mean = float(self.layers.mean())
        difference = self.halves[0] - self.halves[1]
        return float(np.sqrt((difference**2).mean()) / 2 / mean) if mean > 0 else 0.0


def render_sppm(
    scene: RayScene,
    emission: Emission,
    camera: RayCamera,
    passes: int,
    *,
    coloured: bool,
    radius: float = FIRST_RADIUS,
    samples: int = 1,
    stop: Callable[[int], bool] | None = None,
) -> SppmResult:
    """Render the average of several passes.

    Args:
        scene: the surfaces, contacts included.
        emission: the photons of the first pass; the other passes continue its sequence.
        radius: gather radius (mm) of the first pass.
        samples: number of camera samples of each pixel in a pass. If the gather discs are much
            smaller than a pixel, a single sample misses most photons of the pixel.
        stop: function that is called with the number of passes done; tracing ends early if it
            returns True.
    """
    table, seed = emission.table, emission.seed
    windows = LampWindows.of(table.emitters)
    width, height = camera.width, camera.height
    pixel = dr.arange(mi.UInt32, width * height)
    halves = np.zeros((2, table.groups, height, width, 3), dtype=np.float64)
    done = emitted = 0
    for number in range(passes):
        sent = replace(emission, first=number * emission.per_light)
        photons = trace_photons(scene, sent, coloured=coloured)
        gather_radius = radius * (number + 1) ** (-1 / 6)
        grid = build_grid(photons, *scene.bounds, gather_radius)
        image = Film(width * height, table.groups)
        for each in range(samples):
            sample = dr.opaque(mi.UInt32, number * samples + each + 1)
            film = film_samples(pixel, width, sample, seed)
            image.count(pixel)
            ways = [
                find_visible_points(scene, camera, pixel, sample, film, seed, channel=channel)
                for channel in scene.channels
            ]
            for points in (end for pair in ways for end in pair if end is not None):
                light = estimate_radiance(
                    grid, scene.table, points, dr.opaque(mi.Float, gather_radius), table.groups
                )
                image.add(points, light)
                image.add_light(points, windows)
        halves[number % 2] += image.layers(width, height)
        done, emitted = number + 1, emitted + photons.emitted
        if stop is not None and stop(done):
            break
    counts = np.array([max((done + 1) // 2, 1), max(done // 2, 1)], dtype=float)
    layers = halves.sum(axis=0) / done
    halves /= counts[:, None, None, None, None]
    return SppmResult(layers.astype(np.float32), halves.astype(np.float32), done, emitted)

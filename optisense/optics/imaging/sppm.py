"""Stochastic progressive photon mapping (SPPM), the reference estimator.

Every pass traces photons through the scene with its contacts, and gathers them at new visible
points with a radius that shrinks as passes^(-1/6) (area as passes^(-1/3), the rate of Knaus and
Zwicker 2011, alpha = 2/3), so that both noise and bias go to zero. It is slower than the radiance
cache, which is verified against it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from optisense.optics.camera.projection import RayCamera
from optisense.optics.imaging._density_estimation import build_grid, estimate_radiance
from optisense.optics.imaging._film import Film
from optisense.optics.scene.lamp_windows import LampWindows
from optisense.optics.scene.ray_scene import RayScene
from optisense.optics.transport.camera_paths import film_samples, find_visible_points
from optisense.optics.transport.photons import Emission, trace_photons

FIRST_RADIUS = 0.3
"""Gather radius (mm) of the first pass. As the radius shrinks with each pass, it affects how fast
noise falls and not the limit of the image. 0.3 mm is five pixels of GelSight Mini at 320 pixels.
`OpticalModel.render` takes a smaller one on small sensing surfaces (see `fineness`)."""


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

"""From the light field to the layers of an image: camera samples, shading, and what is true
about each pixel.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter

from optisense.optics.camera import RayCamera
from optisense.optics.chief_rays import ChiefRays
from optisense.optics.emitters import Emitter
from optisense.optics.light_field import LightField
from optisense.optics.sampling import seed_of
from optisense.optics.shading import ContactScenes, shade
from optisense.optics.sppm import SppmResult
from optisense.optics.surfaces import Region
from optisense.optics.visible_points import VisiblePoints, film_samples, find_visible_points

CONTACT_SAMPLES = 8
"""Camera samples of a pixel in and around contacts, where tilt and shadow change within it."""
REFINED = 8.0 / 320.0
"""How far around a contact, as a part of the image width."""


@dataclass
class ImageLayers:
    """radiance (groups, h, w, 3) for lights of 1 mW in each channel, and the ground truth of an
    image.
    """

    radiance: NDArray[np.float32]
    normals: NDArray[np.float32]
    points: NDArray[np.float32]
    contact_mask: NDArray[np.bool_]
    photons: int
    noise: float
    samples: list[int]
    interrupted: bool
    light_seconds: float
    image_seconds: float

    @classmethod
    def from_sppm(cls, result: SppmResult, rays: ChiefRays, began: float) -> ImageLayers:
        """Layers of progressive photon mapping, with ground truth from chief rays."""
        hit = rays.hit
        difference = result.halves[0] - result.halves[1]
        mean = float(result.layers.mean())
        noise = float(np.sqrt((difference**2).mean()) / 2 / mean) if mean > 0 else 0.0
        return cls(
            radiance=result.layers,
            normals=masked(rays.normals, hit),
            points=masked(rays.points, hit),
            contact_mask=hit & (rays.region == Region.INDENTER),
            photons=result.photons,
            noise=noise if result.passes > 1 else float("inf"),
            samples=[result.passes, result.passes],
            interrupted=False,
            light_seconds=0.0,
            image_seconds=time.perf_counter() - began,
        )


def masked(values: NDArray[np.float32], where: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Values (h, w, 3) with NaN outside a mask."""
    return np.where(where[..., None], values, np.nan).astype(np.float32)


class _Film:
    """Sums of radiance and of samples per pixel and group."""

    def __init__(self, pixels: int, groups: int) -> None:
        self.sums = [dr.zeros(mi.Float, pixels * 3) for _ in range(groups)]
        self.counts = dr.zeros(mi.Float, pixels)

    def count(self, pixel: mi.UInt32) -> None:
        dr.scatter_add(self.counts, mi.Float(1), pixel)

    def add(self, points: VisiblePoints, radiance: list[mi.Color3f]) -> None:
        for total, value in zip(self.sums, radiance, strict=True):
            weighted = points.weight * value
            for k in range(3):
                dr.scatter_add(total, weighted[k], points.pixel * 3 + k, points.valid)

    def add_light(self, points: VisiblePoints, emitters: list[Emitter], areas: list[float]) -> None:
        """The windows of flat lights that are seen directly; a Lambertian window of 1 mW has
        radiance 1 / (pi A).
        """
        radiance = [1 / (np.pi * area) if area > 0 else 0.0 for area in areas]
        values = mi.Float(np.array([0.0, *radiance], dtype=np.float32))
        groups = mi.UInt32(np.array([0, *(e.group for e in emitters)], dtype=np.uint32))
        seen = points.light > 0
        value = dr.gather(mi.Float, values, points.light, seen)
        group = dr.gather(mi.UInt32, groups, points.light, seen)
        for number, total in enumerate(self.sums):
            for k in range(3):
                dr.scatter_add(
                    total,
                    points.weight[k] * value,
                    points.pixel * 3 + k,
                    seen & (group == number),
                )

    def layers(self, width: int, height: int) -> NDArray[np.float32]:
        share = 1 / np.maximum(np.asarray(self.counts), 1).reshape(height, width, 1)
        out = [np.asarray(total).reshape(height, width, 3) * share for total in self.sums]
        return np.stack(out).astype(np.float32)


def render_field(
    light: tuple[LightField, bool],
    scenes: ContactScenes,
    camera: RayCamera,
    rays: ChiefRays,
    emitters: list[Emitter],
    areas: list[float],
    seed: int,
) -> ImageLayers:
    """Shade an image from a light field: one sample a pixel, more in and around contacts."""
    began = time.perf_counter()
    field, interrupted = light
    width, height = camera.width, camera.height
    film = _Film(width * height, field.groups)

    def sample(pixel: mi.UInt32, number: mi.UInt32, thorough: bool) -> None:
        spots = film_samples(pixel, width, number, seed_of(seed, 3))
        own = seed_of(seed, 4, int(thorough))
        main, reflected = find_visible_points(scenes.full, camera, pixel, spots, own)
        film.count(pixel)
        for points, close in ((main, thorough), (reflected, False)):
            if points is not None:
                film.add(points, shade(field, scenes, points, own, close))
                film.add_light(points, emitters, areas)

    region_image = np.where(rays.hit, rays.region, 0)
    mask = region_image == Region.INDENTER
    near = np.zeros_like(mask)
    samples = [1, 1]
    if mask.any():
        near = maximum_filter(mask, 2 * max(1, round(REFINED * width)) + 1)
        pixel = np.flatnonzero(near).astype(np.uint32)
        number = np.repeat(np.arange(1, CONTACT_SAMPLES + 1, dtype=np.uint32), len(pixel))
        sample(mi.UInt32(np.tile(pixel, CONTACT_SAMPLES)), mi.UInt32(number), True)
        samples = [1, CONTACT_SAMPLES]
    far = mi.UInt32(np.flatnonzero(~near).astype(np.uint32))
    if dr.width(far):
        sample(far, dr.zeros(mi.UInt32, dr.width(far)), False)
    layers = film.layers(width, height)
    return ImageLayers(
        radiance=layers,
        normals=masked(rays.normals, rays.hit),
        points=masked(rays.points, rays.hit),
        contact_mask=mask,
        photons=field.photons,
        noise=field.noise,
        samples=samples,
        interrupted=interrupted,
        light_seconds=0.0,
        image_seconds=time.perf_counter() - began,
    )

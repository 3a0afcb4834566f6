"""From the light field to the layers of an image: camera samples, shading, and what is true
about each pixel.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from optisense.optics.backend.sequences import seed_of
from optisense.optics.camera.projection import RayCamera
from optisense.optics.imaging.film import Film
from optisense.optics.imaging.pixel_interpolation import agreed, between_rays, fill
from optisense.optics.radiance_cache.beams import beams_near
from optisense.optics.radiance_cache.cache import LightField
from optisense.optics.radiance_cache.shading import shade
from optisense.optics.scene.contact_scenes import ContactScenes
from optisense.optics.scene.emitters import Emitter
from optisense.optics.scene.surfaces import Region
from optisense.optics.transport.camera_paths import film_samples, find_visible_points
from optisense.optics.transport.chief_rays import ChiefRays

if TYPE_CHECKING:
    from optisense.optics.imaging.sppm import SppmResult

CONTACT_SAMPLES = 12
"""Camera samples of a pixel in contacts, where tilt and shadow change within it, in an image of
USUAL_WIDTH; finer images have smaller pixels and take fewer."""
LEAST_OF_CONTACTS = 16_000
"""Camera samples in contacts in all: where they fill few pixels, more changes within each."""
MOST_SAMPLES = 64
"""Of a pixel, for that."""
RIM_SAMPLES = 6
"""The same around contacts."""
DRAFT_SAMPLES = 3, 1
"""The same of drafts, in contacts and around them."""
ROUGH_SAMPLES = 2
"""The same of those pixels of contacts that nobody reads by themselves."""
USUAL_WIDTH = 320
REFINED = 8.0 / 320.0
"""How far around a contact, as a part of the image width."""

MANY_BEAMS = 1.5e7
"""Beams to sum in an image, about two tenths of a second's work, above which only every second
pixel is shaded where it is smooth."""
GRAIN_SAMPLES = 4
"""So many more camera samples, or as many as half the work again, where the rest of it is grainy:
where neighbouring cells of the light field differ much, one sample, which reads one of them, shows
which.
"""
GRAIN = 0.03
"""Deviation from the neighbours, relative, above which an image is grainy: a few times a camera's
own noise, which is about 0.01."""
CROSS = np.array([[0, 1, 0], [1, 0, 1], [0, 1, 0]], dtype=np.float32) / 4
DARK = 0.02
"""Of the mean: what is darker may be grainy."""
GRAIN_REACH = 9
"""Pixels across that are judged, and sampled again, together."""


Careful = Callable[[ChiefRays], NDArray[np.bool_] | NDArray[np.floating]]
"""Says which pixels (h, w) of contacts are read, and not only looked at in passing: the part, 0 to
1, of the camera samples that each deserves."""


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


def _repeated(mask: NDArray[np.bool_], times: int) -> tuple[mi.UInt32, mi.UInt32]:
    """Every pixel of a mask (one or more) ``times`` times, and the number of the sample, from 1."""
    # Made on the device: arrays handed over from numpy differ in alignment, and so would kernels.
    chosen = dr.compress(mi.Bool(mask.ravel()))
    lane = dr.arange(mi.UInt32, dr.width(chosen) * times)
    count = dr.opaque(mi.UInt32, dr.width(chosen))
    return dr.gather(mi.UInt32, chosen, lane % count), lane // count + 1


def _grainy(image: NDArray[np.float32], where: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(h, w) which pixels of a mask lie in grainy places: where an image (h, w) often differs from
    the mean of the four neighbours, by more than a smooth image can.
    """
    if not where.any():
        return where
    inner = ndimage.binary_erosion(where) & (image > DARK * image[where].mean())
    mean = ndimage.convolve(image, CROSS, mode="nearest")
    # A lit pixel among black ones is as far off as can be told.
    least = np.maximum(0.01 * np.abs(image), np.finfo(np.float32).tiny)
    off = np.where(inner, (image - mean) / np.maximum(np.abs(mean), least), 0.0)
    share = ndimage.uniform_filter(inner.astype(np.float32), GRAIN_REACH)
    square = ndimage.uniform_filter((off**2).astype(np.float32), GRAIN_REACH)
    return where & (square > GRAIN**2 * np.maximum(share, 1e-6))


def masked(values: NDArray[np.float32], where: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Values (h, w, 3) with NaN outside a mask."""
    return np.where(where[..., None], values, np.nan).astype(np.float32)


def render_field(
    light: tuple[LightField, bool],
    scenes: ContactScenes,
    camera: RayCamera,
    rays: ChiefRays,
    emitters: list[Emitter],
    areas: list[float],
    seed: int,
    only_contacts: bool = False,
    careful: Careful | None = None,
    draft: bool = False,
) -> ImageLayers:
    """Shade an image from a light field: one sample a pixel, more in and around contacts.

    ``only_contacts`` leaves all pixels but those that see an indenter dark; of these, each gets the
    part of the samples that ``careful`` says, but a few at least. A ``draft`` takes few samples in
    contacts, and leaves grain as it is.
    """
    began = time.perf_counter()
    field, interrupted = light
    width, height = camera.width, camera.height
    # What interfaces reflect towards the eye is little: it is sampled once in a pixel or in those
    # beside it.
    film, mirrored = (Film(width * height, field.groups) for _ in range(2))

    near_beams = field.beams
    if scenes.indenters is not None:
        near_beams = beams_near(field.beams, field.cells, field.groups, scenes.balls)

    def sample(pixel: mi.UInt32, number: mi.UInt32, thorough: bool, again: bool = False) -> None:
        spots = film_samples(pixel, width, number, seed_of(seed, 3))
        own = seed_of(seed, 4, int(thorough))
        main, reflected = find_visible_points(
            scenes.full, camera, pixel, number, spots, own, only_main=again
        )
        film.count(pixel)
        film.add(main, shade(field, scenes, near_beams, main, thorough, False))
        film.add_light(main, emitters, areas)
        if not again:
            mirrored.count(pixel)
        if reflected is not None:
            mirrored.add(reflected, shade(field, scenes, near_beams, reflected, False, True))
            mirrored.add_light(reflected, emitters, areas)

    region_image = np.where(rays.hit, rays.region, 0)
    mask = region_image == Region.INDENTER
    near = np.zeros_like(mask)
    samples = [1]
    if mask.any():
        distance = ndimage.distance_transform_edt(~mask)
        near = distance <= max(2.0, REFINED * width)
        share = min(1.0, USUAL_WIDTH / width)
        inner, outer = (max(2, round(n * share)) for n in (CONTACT_SAMPLES, RIM_SAMPLES))
        inner = max(inner, min(MOST_SAMPLES, LEAST_OF_CONTACTS // int(mask.sum())))
        if draft:
            inner, outer = DRAFT_SAMPLES
        if only_contacts:
            part = np.ones_like(mask) if careful is None else careful(rays)
            counts = np.maximum(np.round(inner * np.clip(part, 0, 1)), min(inner, ROUGH_SAMPLES))
            wanted = [(mask & (counts == times), int(times)) for times in np.unique(counts[mask])]
        else:
            wanted = [(distance <= 1.0, inner), (near & (distance > 1.0), outer)]
        tiers = [_repeated(pixels, times) for pixels, times in wanted if pixels.any()]
        pixel, number = (dr.concat(each) for each in zip(*tiers, strict=True))
        dr.eval(pixel, number)
        sample(pixel, number, True)
        samples = [1, outer, inner]
    far = ~near
    layers = reflections = None
    if far.any() and not only_contacts:
        # Beams to go through: where they are many, every second pixel will do, if its neighbours
        # are like it.
        beams = dr.width(field.beams.ways) / 4 / field.cells.cells
        sparse = int(far.sum()) * beams > MANY_BEAMS
        filled = between_rays(rays, far) if sparse else np.zeros_like(far)
        first = far & ~filled
        pixel = dr.compress(mi.Bool(first.ravel()))
        sample(pixel, dr.zeros(mi.UInt32, dr.width(pixel)), False)
        reflections = mirrored.layers(width, height)
        if sparse:
            fill(reflections, filled)
        layers = film.layers(width, height) + reflections
        step = 2 if sparse else 1
        grainy = np.zeros_like(far)
        grainy[::step, ::step] = _grainy(
            layers[:, ::step, ::step].sum(axis=0) @ np.ones(3, dtype=np.float32),
            (far & rays.hit & (not draft))[::step, ::step],
        )
        if grainy.any():
            affordable = int(first.sum()) // (2 * int(grainy.sum()))
            pixel, number = _repeated(grainy, min(GRAIN_SAMPLES, max(1, affordable)))
            dr.eval(pixel, number)
            sample(pixel, number, False, again=True)
            layers = None
        if sparse:
            if layers is None:
                layers = film.layers(width, height) + reflections
            alike = agreed(layers, filled)
            if (apart := filled & ~alike).any():
                # Once in their middle as the others, and once more where those beside them were
                # sampled again.
                again = apart & np.kron(grainy[::2, ::2], np.ones((2, 2), bool))[:height, :width]
                tiers = [_repeated(each, 1) for each in (apart, again) if each.any()]
                tiers[0] = tiers[0][0], dr.zeros(mi.UInt32, dr.width(tiers[0][0]))
                pixel, number = (dr.concat(each) for each in zip(*tiers, strict=True))
                dr.eval(pixel, number)
                sample(pixel, number, False, again=True)
                layers = film.layers(width, height) + reflections
            fill(layers, alike)
    if layers is None:
        if reflections is None:
            reflections = mirrored.layers(width, height)
        layers = film.layers(width, height) + reflections
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

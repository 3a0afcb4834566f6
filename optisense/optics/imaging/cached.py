"""The estimator that reads the radiance cache: camera samples, their shading, and the ground truth
of each pixel.
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
from optisense.optics.imaging._contact_light import (
    MIRRORED_ROUGHNESS,
    beside_layers,
    mirrored_contact_layers,
)
from optisense.optics.imaging._film import REFERENCE_WIDTH, Film, repeated
from optisense.optics.imaging._pixel_interpolation import agreed, between_rays, fill
from optisense.optics.imaging.known_view import KnownView
from optisense.optics.radiance_cache.beams import cull_beams
from optisense.optics.radiance_cache.cache import RadianceCache
from optisense.optics.radiance_cache.shading import shade, shade_in_contacts
from optisense.optics.scene.contact_scenes import ContactScenes
from optisense.optics.scene.emitters import Emitter
from optisense.optics.scene.surfaces import Region
from optisense.optics.transport.camera_paths import (
    MAX_PIXEL_SAMPLES,
    film_samples,
    find_visible_points,
)
from optisense.optics.transport.chief_rays import ChiefRays

if TYPE_CHECKING:
    from optisense.optics.imaging.sppm import SppmResult

CONTACT_SAMPLES = 12
"""Number of camera samples per pixel inside contacts, where tilt and shadow vary within a pixel, in
an image `REFERENCE_WIDTH` wide. Twelve keep the noise of the samples below 1 % in the contact of a
1.5 mm ball on GelSight Mini. Finer images have smaller pixels and take fewer."""
MIN_CONTACT_SAMPLES = 16_000
"""Lower bound on the number of camera samples in all contacts together: that of 1,300 pixels of
twelve samples. If contacts fill fewer pixels, tilt and shadow vary more within each pixel, and each
gets more samples; without it, the error in a contact of GelSight Svelte is up to 26 % larger
(benchmarks/ablation.md)."""
RIM_SAMPLES = 6
"""Number of camera samples per pixel around contacts, in an image `REFERENCE_WIDTH` wide: half of
those inside, as the skin is not tilted there."""
DRAFT_SAMPLES = 3, 1
"""Numbers of camera samples per pixel of a draft, in contacts and around them: a quarter or less of
those of a full image, as the light of a draft is some 9 % off (see `DRAFT_CELL_SCALE`)."""
MIN_PIXEL_SAMPLES = 2
"""Number of camera samples of a contact pixel of importance 0, which is only averaged with others:
a sixth of the usual number or less."""
RIM_WIDTH = 8.0 / 320.0
"""Width of the rim around a contact that gets `RIM_SAMPLES`, as a fraction of the image width: 0.5
mm on GelSight Mini, about the depth of a contact."""

SPARSE_SHADING_BEAMS = 1.5e7
"""Number of beams to sum for an image above which only every second pixel is shaded where the image
is smooth. Summing so many beams takes about 0.2 s on two cores."""
SPARSE_METALLIC_BEAMS = 4e6
"""Value of `SPARSE_SHADING_BEAMS` for metallic coatings. They take longer for each beam, as they
evaluate a metallic lobe, and sum all beams, while diffuse ones sum those near indenters."""
GRAIN_SAMPLES = 4
"""Largest number of further camera samples per pixel in grainy places outside contacts, which
halves the grain; they are limited to half of the image's samples. A sample reads one cell of the
cache, so that neighbouring cells that differ much show as grain. Without them, the error outside
the contact of GelSight Svelte is 26 % larger (benchmarks/ablation.md)."""
GRAIN_THRESHOLD = 0.03
"""Threshold of the relative RMS deviation of pixels from the mean of their neighbours above which a
place is grainy: three times a camera's own noise, which is about 0.01."""
NEIGHBOUR_MEAN = np.array([[0, 1, 0], [1, 0, 1], [0, 1, 0]], dtype=np.float32) / 4
"""Convolution kernel that gives the mean of the four neighbours of a pixel."""
DARK_FRACTION = 0.02
"""Fraction of the mean brightness below which grain is ignored, as it is hardly visible in places
so dark."""
GRAIN_WINDOW = 9
"""Side (pixels) of the square over which grain is measured and resampled. The deviations of its 81
pixels give the root mean square to a tenth."""

MIRRORED_RANGE = 0.1
"""Distance from a contact, as a fraction of the image width, within which metallic coatings are
shaded with the light that the contact reflects through the interfaces: 2 mm on GelSight Mini."""
LEAST_LEFT = 0.5
"""Lower bound on the share of a pixel's light that remains after the light of the skin hidden by
contacts is subtracted. Mirror images of hidden skin are a small part of a pixel's light; a loss of
more than half is the noise of a few bright rays."""

BESIDE_RANGE = 0.1
"""Distance from a contact, as a fraction of the image width, within which the skin is shaded with
light that the contact reflects to it: 2 mm on GelSight Mini. This is half a per cent of a diffuse
coating's light there; with narrow lobes, single rays would be bright blotches."""

INTERREFLECTION_WIDTH = 1.0 / 107.0
"""Width over which interreflected light is averaged in contacts of coatings with broad metallic
lobes, as a fraction of the image width: 3 pixels of 320. In a contact of GelSight Mini of
specularity 0.6, where interreflection is a tenth of the light, this reduces the noise of the
picture's rays from 3.7 to 1 % of the mean and adds a blur of 1 %."""

PixelImportance = Callable[[ChiefRays], NDArray[np.bool_] | NDArray[np.floating]]
"""A function of the chief rays that gives the importance (h, w) of each contact pixel to a score,
0 to 1: the share of the camera samples that it gets."""


@dataclass
class ImageLayers:
    """The layers of an image for lights of 1 mW in each channel, and its ground truth.

    Attributes:
        radiance: (groups, h, w, 3) radiance by light group, mW/(mm^2 sr).
        normals: (h, w, 3) unit normals; NaN where the camera sees no coating.
        points: (h, w, 3) points of the coating, mm; NaN where the camera sees none.
        contact_mask: (h, w) mask of the pixels that see an indenter.
        photons: number of emitted photons.
        noise: relative RMS noise of the light; infinite if it is not known.
        worst_noise: relative RMS noise that the noisiest 5 % of the area have at least; None if it
            is not known.
        samples: numbers of camera samples per pixel far from, around and in contacts.
        interrupted: whether Ctrl-C ended the photon tracing early.
        light_seconds: time (s) of the photon tracing.
        image_seconds: time (s) of the shading.
    """

    radiance: NDArray[np.float32]
    normals: NDArray[np.float32]
    points: NDArray[np.float32]
    contact_mask: NDArray[np.bool_]
    photons: int
    noise: float
    worst_noise: float | None
    samples: list[int]
    interrupted: bool
    light_seconds: float
    image_seconds: float

    @classmethod
    def from_sppm(cls, result: SppmResult, rays: ChiefRays, began: float) -> ImageLayers:
        """Return the layers of progressive photon mapping, with ground truth from chief rays."""
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
            worst_noise=None,
            samples=[result.passes, result.passes],
            interrupted=False,
            light_seconds=0.0,
            image_seconds=time.perf_counter() - began,
        )


def _grainy(image: NDArray[np.float32], where: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return a mask (h, w) of the pixels of ``where`` that lie in grainy places.

    In these, the image (h, w) often differs from the mean of the four neighbours by more than a
    smooth image does.
    """
    if not where.any():
        return where
    inner = ndimage.binary_erosion(where) & (image > DARK_FRACTION * image[where].mean())
    mean = ndimage.convolve(image, NEIGHBOUR_MEAN, mode="nearest")
    # The lower bound avoids a division by zero at a lit pixel among black ones.
    least = np.maximum(0.01 * np.abs(image), np.finfo(np.float32).tiny)
    off = np.where(inner, (image - mean) / np.maximum(np.abs(mean), least), 0.0)
    share = ndimage.uniform_filter(inner.astype(np.float32), GRAIN_WINDOW)
    square = ndimage.uniform_filter((off**2).astype(np.float32), GRAIN_WINDOW)
    return where & (square > GRAIN_THRESHOLD**2 * np.maximum(share, 1e-6))


def masked(values: NDArray[np.float32], where: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Return values (h, w, 3) with NaN outside a mask."""
    return np.where(where[..., None], values, np.nan).astype(np.float32)


@dataclass(frozen=True)
class SamplingPlan:
    """The pixels that are shaded, and their camera samples.

    Attributes:
        only_contacts: whether all pixels that do not see an indenter stay dark.
        importance: function that gives, with ``only_contacts``, the share of the samples of each
            pixel; a pixel gets at least `MIN_PIXEL_SAMPLES`.
        draft: whether few samples are taken in contacts and grain is not resampled.
    """

    only_contacts: bool = False
    importance: PixelImportance | None = None
    draft: bool = False


FULL_SAMPLING = SamplingPlan()
"""Full number of samples in all pixels."""


def render_cached(
    light: tuple[RadianceCache, bool],
    scenes: ContactScenes,
    camera: RayCamera,
    rays: ChiefRays,
    emitters: list[Emitter],
    seed: int,
    plan: SamplingPlan = FULL_SAMPLING,
    known: KnownView | None = None,
) -> ImageLayers:
    """Shade an image from a radiance cache: one sample per pixel, more in and around contacts.

    Args:
        light: the cache, and whether Ctrl-C ended its photon tracing early.
        scenes: the sensor with its contacts.
        camera: the camera.
        rays: chief rays through the same scene and camera.
        emitters: the lights, whose windows may be in view.
        seed: seed of the camera samples.
        plan: the pixels that are shaded, and their samples.
        known: parts of an earlier draft that are reused, to which those that are missing are added.
    """
    began = time.perf_counter()
    cache, interrupted = light
    draft, only_contacts = plan.draft, plan.only_contacts
    width, height = camera.width, camera.height
    # Interfaces reflect little light towards the camera, so their reflections are sampled once in a
    # pixel or in its neighbours. Lamps are so bright that the rare path (one in a thousand) that
    # meets one would be a speck.
    film, between, mirrored, glints = (Film(width * height, cache.binned.groups) for _ in range(4))

    culled_beams = cache.beams
    if scenes.indenters is not None:
        culled_beams = cull_beams(
            cache.beams, cache.binned.cells, cache.binned.groups, scenes.balls
        )

    def sample(
        pixel: mi.UInt32,
        number: mi.UInt32,
        thorough: bool,
        again: bool = False,
        count: mi.UInt32 | None = None,
    ) -> None:
        spots = film_samples(pixel, width, number, seed_of(seed, 3), count)
        own = seed_of(seed, 4, int(thorough))
        film.count(pixel)
        if thorough:
            between.count(pixel)
        if not again:
            mirrored.count(pixel)
            glints.count(pixel)
        for channel in scenes.full.channels:
            points = None
            if known is not None and not again:
                points = known.points.get((thorough, sparse, channel))
            if points is None:
                only_main = again or faint_known
                points = find_visible_points(
                    scenes.full, camera, pixel, number, spots, own, only_main, channel
                )
                if known is not None and not again:
                    known.points[thorough, sparse, channel] = points
            main, reflected = points
            if faint_known:
                reflected = None
            if thorough:
                direct, exchanged = shade_in_contacts(cache, scenes, main, not faint_known)
                film.add(main, direct)
                if exchanged is not None:
                    between.add(main, exchanged)
            else:
                film.add(main, shade(cache, scenes, culled_beams, main, False))
            film.add_light(main, emitters)
            if reflected is not None:
                mirrored.add(reflected, shade(cache, scenes, culled_beams, reflected, True))
                glints.add_light(reflected, emitters)

    sparse = False
    faint_known = known is not None and known.faint is not None
    region_image = np.where(rays.hit, rays.region, 0)
    mask = region_image == Region.INDENTER
    near = np.zeros_like(mask)
    samples = [1]
    bent = region_image == Region.BENT
    mirrored_contacts = beside = None
    if mask.any() or bent.any():
        distance = ndimage.distance_transform_edt(~mask) if mask.any() else np.full(mask.shape, 2.0)
        near = bent | (distance <= max(2.0, RIM_WIDTH * width))
        share = min(1.0, REFERENCE_WIDTH / width)
        inner, outer = (max(2, round(n * share)) for n in (CONTACT_SAMPLES, RIM_SAMPLES))
        inner = max(inner, min(MAX_PIXEL_SAMPLES, MIN_CONTACT_SAMPLES // max(1, int(mask.sum()))))
        if draft:
            inner, outer = DRAFT_SAMPLES
        if only_contacts:
            part = np.ones_like(mask) if plan.importance is None else plan.importance(rays)
            counts = np.maximum(
                np.round(inner * np.clip(part, 0, 1)), min(inner, MIN_PIXEL_SAMPLES)
            )
            wanted = [(mask & (counts == times), int(times)) for times in np.unique(counts[mask])]
        else:
            wanted = [(distance <= 1.0, inner), (near & (distance > 1.0), outer)]
        counted = [
            (*(tier := repeated(pixels, times)), dr.opaque(mi.UInt32, times, dr.width(tier[0])))
            for pixels, times in wanted
            if pixels.any()
        ]
        pixel, number, count = (dr.concat(each) for each in zip(*counted, strict=True))
        dr.eval(pixel, number, count)
        sample(pixel, number, True, count=count)
        samples = [1, outer, inner]
        if not (draft or only_contacts or cache.binned.narrow_lobes):
            skin = region_image == Region.SENSING
            ring = skin & ~near & (distance <= BESIDE_RANGE * width)
            beside = beside_layers(cache, scenes, camera, ring, seed)
        if cache.roughness is not None and cache.roughness < MIRRORED_ROUGHNESS and not draft:
            lit = mask if only_contacts else rays.hit & (distance <= MIRRORED_RANGE * width)
            mirrored_contacts = mirrored_contact_layers(
                cache, scenes, camera, lit, lit & ~mask, seed
            )
    far = ~near
    layers = reflections = None
    if far.any() and not only_contacts:
        # The number of beams to sum. If it is large, only every second pixel is shaded where its
        # neighbours are similar.
        beams = dr.width(cache.beams.ways) / 4 / cache.binned.cells.cells
        most = SPARSE_METALLIC_BEAMS if cache.metallic else SPARSE_SHADING_BEAMS
        sparse = int(far.sum()) * beams > most
        filled = between_rays(rays, far) if sparse else np.zeros_like(far)
        first = far & ~filled
        pixel = dr.compress(mi.Bool(first.ravel()))
        sample(pixel, dr.zeros(mi.UInt32, dr.width(pixel)), False)
        reflections = mirrored.layers(width, height) + glints.without_specks(width, height, near)
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
            pixel, number = repeated(grainy, min(GRAIN_SAMPLES, max(1, affordable)))
            dr.eval(pixel, number)
            sample(pixel, number, False, again=True)
            layers = None
        if sparse:
            if layers is None:
                layers = film.layers(width, height) + reflections
            alike = agreed(layers, filled)
            if (apart := filled & ~alike).any():
                # These pixels get a sample in their middle like the others, and a further one where
                # their neighbours were resampled.
                again = apart & np.kron(grainy[::2, ::2], np.ones((2, 2), bool))[:height, :width]
                tiers = [repeated(each, 1) for each in (apart, again) if each.any()]
                tiers[0] = tiers[0][0], dr.zeros(mi.UInt32, dr.width(tiers[0][0]))
                pixel, number = (dr.concat(each) for each in zip(*tiers, strict=True))
                dr.eval(pixel, number)
                sample(pixel, number, False, again=True)
                layers = film.layers(width, height) + reflections
            fill(layers, alike)
    if reflections is None:
        reflections = mirrored.layers(width, height) + glints.without_specks(width, height, near)
        layers = None
    if layers is None:
        layers = film.layers(width, height) + reflections
    main_light = None if known is None else layers - reflections
    if near.any() and not faint_known:
        reach = 1
        if cache.metallic and not cache.binned.narrow_lobes:
            reach = round(INTERREFLECTION_WIDTH * width) | 1
        layers = layers + between.averaged_layers(width, height, [(mask, reach)])
    if known is not None and main_light is not None:
        if known.faint is None:
            known.keep_faint(main_light, layers - main_light)
        else:
            layers = known.with_faint(main_light)
    if beside is not None:
        layers = layers + beside
    if mirrored_contacts is not None:
        # A contact also hides skin that would reflect light, but never a large share of the light.
        layers = np.maximum(layers + mirrored_contacts, layers * LEAST_LEFT)
    return ImageLayers(
        radiance=layers,
        normals=masked(rays.normals, rays.hit),
        points=masked(rays.points, rays.hit),
        contact_mask=mask,
        photons=cache.photons,
        noise=cache.noise,
        worst_noise=cache.worst_noise,
        samples=samples,
        interrupted=interrupted,
        light_seconds=0.0,
        image_seconds=time.perf_counter() - began,
    )

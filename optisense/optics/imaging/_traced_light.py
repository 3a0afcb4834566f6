"""The light in narrow metallic lobes, which rays of `traced_lobes` bring."""

from __future__ import annotations

import math
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from optisense.optics.backend.arrays import FEWEST_LANES
from optisense.optics.backend.sequences import seed_of
from optisense.optics.camera.projection import RayCamera
from optisense.optics.imaging._film import Film, average_pixels, repeated
from optisense.optics.imaging.lamp_images import without_specks
from optisense.optics.imaging.sampling import OUTLINE_SAMPLES, PixelRegions, SamplingPlan, outline
from optisense.optics.radiance_cache.cache import RadianceCache
from optisense.optics.radiance_cache.traced_lobes import LobeRays, LobeTracer
from optisense.optics.scene.coating_bsdf import (
    CoatingBsdf,
    coating_of,
    evaluate_coating,
    evaluate_peak,
)
from optisense.optics.scene.contact_scenes import ContactScenes
from optisense.optics.scene.lamp_windows import LampWindows
from optisense.optics.transport.camera_paths import (
    VisiblePoints,
    film_samples,
    find_visible_points,
)

CONTACT_RAYS = 4.0
"""Number of rays from contacts for each photon of the cache. With four, the noise over patches of a
contact of GelSight Mini of specularity 1 is 2.3 % with 300,000 photons, about that of a diffuse
coating with 560,000; with one, the same noise takes three times the time."""
SCORE_RAYS = 1.0
"""The same in images of contacts alone, which scores take from a cache of many photons. With five
million on GelSight Mini, the noise over patches is 1.2 %, as that of a diffuse coating; four rays
for each photon would triple the time of a score."""
MOST_RAYS = 2_000_000
"""Largest number of rays that are traced together; their light takes up to 200 MB."""
BENT_RAYS = 1.0
"""Number of rays from elastic skin that is bent beside contacts for each photon of the cache. On
GelSight Mini with a million photons, the noise of pixels within 4 pixels of a contact is 6 to 9 %;
with an eighth as many rays, it is 16 to 19 %, visible as coloured specks."""
NEAR_RAYS = 0.15
"""Number of rays from other pixels around contacts (`PixelRegions.near`) for each photon. With a
fifth as many, the means of quarters of the skin around a contact of GelSight360 have a noise of 9
to 20 instead of 2 to 3 %, with two million photons."""
BESIDE_RAYS = 0.2
"""Number of rays from the skin within `BESIDE_RANGE` of contacts for each photon of the cache: two
million photons give the mean of this skin a noise of 2 % on GelSight Mini."""
BESIDE_RANGE = 0.1
"""Distance from contacts as a fraction of the image width: 2 mm on GelSight Mini. The interfaces
and the skin mirror contacts to the skin within it."""
SKIN_RAYS = 0.4
"""Number of rays from all other pixels that see the skin for each photon of the cache."""
MIRRORED_SHARE = 0.25
"""Number of rays from a point that the camera sees by reflection at an interface, as a share of
those from a point that it sees directly. On the skin around a contact of GelSight Svelte of
specularity 1, a tenth of the light comes from such points."""
SKIN_WIDTH = 1 / 32
"""Width over which the light of traced peaks is averaged outside contacts, as a fraction of the
image width: 0.6 mm on GelSight Mini, whose flat skin blurs images of lamps over 1 mm and more.
Without the average, pixels of GelSight Svelte's skin of specularity 1 have a noise of 50 %."""
NEAR_WIDTH = 1 / 160
"""The same around contacts (`PixelRegions.near`), where the skin is bent or shows the contact and
most of the blur is undone. With this blur, twice the width, and half the rays, the error of the
skin within 1 mm of a contact of GelSight360 would be 8 instead of 3 %."""
BESIDE_WIDTH = 1 / 64
"""The same within `BESIDE_RANGE` of contacts, where the skin is curved and shows them."""
SKIN_SPECK_WIDTH = 1 / 16
"""Width over which the light of lone bright pixels outside contacts is spread, as a fraction of the
image width. Over twice this width, it would lighten the skin between the lamps in the corner of
GelSight Mini's view, by an error of 6.5 %."""
BESIDE_SPECK_WIDTH = 1 / 40
"""The same within `BESIDE_RANGE` of contacts, which are bright and show in the skin around them.
Over a sixteenth of the width, the error of GelBelt's skin within 1 mm of a contact is 3.1 instead
of 2.8 %; without spreading, single rays are spots of five pixels."""


@dataclass(frozen=True)
class LobeSamples:
    """Pixels whose camera samples draw rays from narrow lobes.

    Attributes:
        pixels: (h, w) mask of the pixels.
        count: number of camera samples of each pixel.
        directions: number of rays from each sample.
        gathers: whether the rays end on the skin that they meet (see `LobeTracer.trace`).
        passes: number of passes in which the samples draw rays.
    """

    pixels: NDArray[np.bool_]
    count: int
    directions: int
    gathers: bool = True
    passes: int = 1

    @classmethod
    def of_contacts(cls, pixels: NDArray[np.bool_], count: int, rays: float) -> LobeSamples:
        """Return samples of pixels on contacts or bent skin, which draw rays together."""
        passes = max(1, math.ceil(rays / MOST_RAYS))
        directions = _directions(rays / passes, pixels, count)
        return cls(pixels, count, directions, gathers=False, passes=passes)

    @classmethod
    def of_skin(cls, pixels: NDArray[np.bool_], rays: float) -> LobeSamples:
        """Return the samples of pixels outside contacts, which draw a number of rays together."""
        return cls(pixels, 1, _directions(rays, pixels, 1))


def _directions(rays: float, pixels: NDArray[np.bool_], count: int) -> int:
    samples = max(1, int(np.count_nonzero(pixels)) * count)
    return max(1, round(min(rays, MOST_RAYS) / samples))


def _lobe_samples(plan: SamplingPlan, regions: PixelRegions, photons: int) -> list[LobeSamples]:
    """Return the samples of an image from a cache of a number of photons."""
    tiers = plan.of_contacts(regions) if regions.near.any() else []
    if plan.only_contacts:
        rays = SCORE_RAYS * photons
        total = sum(int(np.count_nonzero(pixels)) for pixels, _ in tiers)
        shares = [np.count_nonzero(pixels) / max(1, total) for pixels, _ in tiers]
        return [
            LobeSamples.of_contacts(pixels, count, rays * share)
            for (pixels, count), share in zip(tiers, shares, strict=True)
        ]

    inside = tiers[0][0] if tiers else np.zeros_like(regions.near)
    bent = regions.bent & ~inside
    near = regions.near & ~(inside | bent)
    beside = regions.within(BESIDE_RANGE) & ~(inside | bent | near)
    hit = regions.rays.hit
    skin = LobeSamples.of_skin(~(inside | bent | near | beside) & hit, SKIN_RAYS * photons)
    edge = outline(hit) & ~(inside | hit)
    samples = [
        LobeSamples.of_skin(near & hit, NEAR_RAYS * photons),
        LobeSamples.of_skin(beside & hit, BESIDE_RAYS * photons),
        skin,
        LobeSamples(edge, OUTLINE_SAMPLES, skin.directions),
        LobeSamples(~(inside | hit | edge), count=1, directions=1),
    ]
    if tiers:
        samples.append(LobeSamples.of_contacts(*tiers[0], CONTACT_RAYS * photons))
        samples.append(LobeSamples.of_contacts(bent, tiers[1][1], BENT_RAYS * photons))
    return samples


@dataclass(frozen=True)
class _SmoothedRegion:
    """A region in which the light of traced peaks is averaged.

    Attributes:
        pixels: (h, w) mask of the region.
        weight: (h, w) weight of the averaged light; the weights of all regions add up to 1, and
            where there is none, light is not averaged.
        spread: width over which the light of lone bright pixels is spread within the region before,
            as a fraction of the image width; 0 if it is not.
        averaged: width over which all light is averaged, as a fraction of the image width; 0 if it
            is not.
        deblurred: whether most of the blur of this average is undone (see `Film.averaged_layers`).
    """

    pixels: NDArray[np.bool_]
    weight: NDArray[np.floating]
    spread: float
    averaged: float
    deblurred: bool = False

    def smoothed(self, layers: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return averaged layers (groups, h, w, 3)."""
        if self.spread > 0:
            layers = without_specks(layers, np.zeros_like(self.pixels), self.pixels, self.spread)
        else:
            layers = layers.copy()
        reach = round(self.averaged * layers.shape[2]) | 1
        average_pixels(layers, self.pixels.astype(np.float32), self.pixels, reach, self.deblurred)
        return layers


def _smoothed_regions(plan: SamplingPlan, regions: PixelRegions) -> list[_SmoothedRegion]:
    """Return the regions in each of which the light of traced peaks is averaged."""
    if plan.only_contacts:
        return []
    hit = regions.rays.hit
    outside = regions.distance > 1.0
    near = outside & regions.near
    skin = outside & hit & ~near
    beside = skin & regions.within(BESIDE_RANGE)
    # Two regions overlap, so that no edge shows between them.
    far = skin & ~regions.within(BESIDE_RANGE / 2)
    x = np.clip(2 * regions.distance / (BESIDE_RANGE * regions.width) - 1, 0, 1)
    farness = np.where(skin, x * x * (3 - 2 * x), 0)
    # Pixels at the outline of the skin see different parts of it, and are not averaged.
    beyond = outside & ~(near | hit)
    edge = beyond & outline(hit)
    beyond &= ~edge
    return [
        _SmoothedRegion(near, near.astype(float), 0, NEAR_WIDTH, deblurred=True),
        _SmoothedRegion(beside, np.where(beside, 1 - farness, 0), BESIDE_SPECK_WIDTH, BESIDE_WIDTH),
        _SmoothedRegion(far, farness, SKIN_SPECK_WIDTH, SKIN_WIDTH),
        _SmoothedRegion(edge, edge.astype(float), SKIN_SPECK_WIDTH, 0),
        _SmoothedRegion(beyond, beyond.astype(float), SKIN_SPECK_WIDTH, BESIDE_WIDTH),
    ]


def traced_layers(
    cache: RadianceCache,
    scenes: ContactScenes,
    camera: RayCamera,
    lamps: LampWindows,
    plan: SamplingPlan,
    regions: PixelRegions,
    seed: int,
) -> NDArray[np.float32]:
    """Return the radiance (groups, h, w, 3), mW/(mm^2 sr) for lights of 1 mW, of the light in
    narrow lobes.

    Args:
        cache: the radiance cache, which holds the light in the tails of these lobes.
        scenes: the scenes of the image.
        lamps: the windows of the lights.
        plan: the pixels that are shaded, and their camera samples.
        regions: the pixels in contacts, around them, and far from them.
        seed: seed of the image.
    """
    width, height = camera.width, camera.height
    film = Film(width * height, cache.binned.groups)
    image = _Image(cache, scenes, camera, lamps, film, seed)
    for each in _lobe_samples(plan, regions, cache.photons):
        if not each.pixels.any():
            continue
        for number in range(each.passes):
            image.add(each, number)
    layers = film.layers(width, height)
    smooth = np.zeros_like(layers)
    total = np.zeros((height, width, 1), dtype=np.float32)
    for region in _smoothed_regions(plan, regions):
        if region.pixels.any():
            weight = region.weight[..., None].astype(np.float32)
            smooth += weight * region.smoothed(layers)
            total += weight
    return smooth + (1 - total) * layers


@dataclass(frozen=True)
class _Image:
    """An image to whose film the light of rays is added; the arguments of `traced_layers`."""

    cache: RadianceCache
    scenes: ContactScenes
    camera: RayCamera
    lamps: LampWindows
    film: Film
    seed: int

    def add(self, samples: LobeSamples, earlier: int) -> None:
        """Add the samples of one pass, which follows a number of ``earlier`` ones."""
        scene, film, seed = self.scenes.full, self.film, self.seed
        pixel, number = repeated(samples.pixels, samples.count)
        later = number + dr.opaque(mi.UInt32, earlier * samples.count)
        dr.eval(pixel, number, later)
        film.count(pixel)
        count = dr.opaque(mi.UInt32, samples.count, dr.width(pixel))
        spots = film_samples(pixel, self.camera.width, number, seed_of(seed, 3), count)
        for channel in scene.channels:
            points, mirrored = find_visible_points(
                scene, self.camera, pixel, later, spots, seed_of(seed, 13), channel=channel
            )
            tracer = LobeTracer(self.cache, self.scenes, self.lamps, channel)
            rays = tracer.trace(points, samples.directions, samples.gathers)
            _add_light(film, rays, points, scene.table, 1 / samples.directions)
            dr.eval(film.sums)
            if mirrored is not None:
                directions = max(1, round(MIRRORED_SHARE * samples.directions))
                rays = tracer.trace(mirrored, directions, samples.gathers)
                _add_light(film, rays, mirrored, scene.table, 1 / directions)
                dr.eval(film.sums)


def _lit_rays(rays: LobeRays, groups: int) -> mi.UInt32:
    """Return the numbers of the rays along which light arrives."""
    first = dr.arange(mi.UInt32, dr.width(rays.owner)) * (groups * 3)
    total = mi.Float(0)
    for i in range(groups * 3):
        total += dr.gather(mi.Float, rays.light, first + i)
    return dr.compress((total != 0) & (rays.density > 0))


def _add_light(
    film: Film, rays: LobeRays, seen: VisiblePoints, table: mi.Float, share: float
) -> None:
    """Add the light that arrives along rays to their pixels, times ``share``, that of one ray."""
    lit = _lit_rays(rays, film.groups)
    if dr.width(lit) < FEWEST_LANES:
        return
    points = dr.gather(VisiblePoints, seen, dr.gather(mi.UInt32, rays.owner, lit))
    coating = coating_of(table, points.surface, points.valid)
    direction = dr.gather(mi.Vector3f, rays.direction, lit)
    whole = dr.gather(mi.Bool, rays.whole, lit)
    value = _reflected(points, coating, direction, whole) * points.weight
    value *= dr.opaque(mi.Float, share) / dr.gather(mi.Float, rays.density, lit)
    for g in range(film.groups):
        light = dr.gather(mi.Color3f, rays.light, lit * film.groups + g)
        film.scatter(light * value, points.pixel, mi.UInt32(g), mi.Bool(True))


def _reflected(
    points: VisiblePoints, coating: CoatingBsdf, direction: mi.Vector3f, whole: mi.Bool
) -> mi.Color3f:
    """Return the BSDF times the cosine (3, n) of a lobe's peak or of the ``whole`` coating."""
    peak = evaluate_peak(coating, points.normal, direction, points.towards_eye)
    every = evaluate_coating(coating, points.normal, direction, points.towards_eye)
    return dr.select(whole, every, peak)

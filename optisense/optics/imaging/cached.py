"""The estimator that reads the radiance cache: the shading of the camera samples of an image."""

from __future__ import annotations

from functools import reduce

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from optisense.optics.backend.arrays import joined, padded
from optisense.optics.backend.sequences import seed_of
from optisense.optics.camera.projection import RayCamera
from optisense.optics.imaging._contact_light import beside_layers
from optisense.optics.imaging._film import Film, repeated
from optisense.optics.imaging._pixel_interpolation import agreed, between_rays, fill
from optisense.optics.imaging._traced_light import NEAR_WIDTH, traced_layers
from optisense.optics.imaging.image_layers import ImageLayers, KnownView
from optisense.optics.imaging.lamp_images import LampImages, without_specks
from optisense.optics.imaging.sampling import (
    GRAIN_SAMPLES,
    OUTLINE_SAMPLES,
    PixelRegions,
    SamplingPlan,
    grainy,
    sharp_edges,
)
from optisense.optics.radiance_cache.beams import cull_beams
from optisense.optics.radiance_cache.cache import RadianceCache
from optisense.optics.radiance_cache.shading import (
    DRAG_EFFORT,
    FULL_EFFORT,
    shade,
    shade_in_contacts,
)
from optisense.optics.scene.contact_scenes import ContactScenes
from optisense.optics.scene.lamp_windows import LampWindows
from optisense.optics.scene.surfaces import Region
from optisense.optics.transport.camera_paths import (
    VisiblePoints,
    film_samples,
    find_visible_points,
)
from optisense.optics.transport.chief_rays import ChiefRays

SPARSE_SHADING_BEAMS = 1.5e7
"""Number of beams to sum for an image above which only every second pixel is shaded where the image
is smooth; it takes about 0.2 s on two cores. Without the interpolation, an image of GelSight360
with a specularity of 0.6 from a finished cache takes 17 % longer."""
SPARSE_METALLIC_BEAMS = 4e6
"""Value of `SPARSE_SHADING_BEAMS` for metallic coatings. They take longer for each beam, as they
evaluate a metallic lobe, and sum all beams, while diffuse ones sum those near indenters."""
AVERAGED_ROUGHNESS = 0.18
"""GGX alpha of metallic lobes from which on interreflected light is averaged over pixels in
contacts (see `INTERREFLECTION_WIDTH`). At 0.2 this reduces the noise of the camera samples in a
contact of GelSight Mini from 2.6 to 1.1 %, with an error of 0.5 %, which is larger for narrower
lobes."""
BESIDE_RANGE = 0.1
"""Distance from a contact, as a fraction of the image width, within which the skin is shaded with
light that the contact reflects to it: 2 mm on GelSight Mini. This is half a per cent of a diffuse
coating's light there; with narrow lobes, single rays would be bright blotches."""


def render_cached(
    light: tuple[RadianceCache, bool],
    scenes: ContactScenes,
    camera: RayCamera,
    rays: ChiefRays,
    windows: LampWindows,
    seed: int,
    plan: SamplingPlan,
    known: KnownView | None,
    lamps: LampImages | None,
) -> ImageLayers:
    """Shade an image from a radiance cache: one sample per pixel, more in and around contacts.

    Args:
        light: the cache, and whether Ctrl-C ended its photon tracing early.
        scenes: the sensor with its contacts.
        rays: chief rays through the same scene and camera.
        windows: the windows of the lights, which may be in view.
        plan: the pixels that are shaded, and their samples.
        known: parts of an earlier draft that are reused, to which those that are missing are added.
        lamps: mirror images and glare of lamps, which are added to the image; None if it has the
            lamps that single samples meet beyond rough faces, as in drafts.
    """
    cache, interrupted = light
    regions = PixelRegions.of(rays)
    image = _Shading(cache, scenes, camera, windows, regions, seed, plan, known, lamps is not None)
    samples = [1]
    if regions.near.any():
        image.sample_near()
        samples = [1, *reversed(plan.contact_samples(regions))]
    if plan.only_contacts or regions.near.all():
        reflections = image.reflections()
        layers = image.main_layers() + reflections
    else:
        layers, reflections = image.sample_far()
    main = layers - reflections if known is not None else None
    if cache.traced_lobes:
        # Light of skin that mirrored contacts hide is subtracted, with noise.
        traced = traced_layers(cache, scenes, camera, windows, plan, regions, seed)
        layers = np.maximum(layers + traced, 0)
    elif regions.near.any() and not image.faint_known:
        layers = layers + image.interreflection()
    if known is not None and main is not None:
        if image.faint_known:
            layers = known.with_faint(main)
        else:
            known.keep_faint(main, layers - main)
    narrow = cache.traced_lobes or cache.binned.narrow_lobes
    if regions.near.any() and not (plan.draft or plan.only_contacts or narrow):
        layers = image.with_light_of_contacts(layers)
    mirrored = None if lamps is None else lamps.layers(camera, seed)
    if mirrored is not None:
        layers = layers + (
            mirrored * regions.contacts[..., None] if plan.only_contacts else mirrored
        )
    return ImageLayers(
        radiance=layers,
        photons=cache.photons,
        noise=cache.noise,
        worst_noise=cache.worst_noise,
        samples=samples,
        interrupted=interrupted,
    )


class _Shading:
    """The camera samples of one image, which are added to films as they are shaded.

    Interfaces reflect little light towards the camera, so their reflections are sampled once in a
    pixel or in its neighbours (``mirrored``). The lamps among them are left to `LampImages`.
    """

    def __init__(
        self,
        cache: RadianceCache,
        scenes: ContactScenes,
        camera: RayCamera,
        windows: LampWindows,
        regions: PixelRegions,
        seed: int,
        plan: SamplingPlan,
        known: KnownView | None,
        glare_apart: bool,
    ) -> None:
        self.cache, self.scenes, self.camera, self.windows = cache, scenes, camera, windows
        self.regions, self.seed, self.plan, self.known = regions, seed, plan, known
        self.size = camera.width, camera.height
        self.glare_apart = glare_apart  # whether lamps beyond rough faces are left to `LampImages`
        self.faint_known = known is not None and known.faint is not None
        self.effort = DRAG_EFFORT if self.faint_known else FULL_EFFORT
        self.film, self.between, self.mirrored = (
            Film(camera.width * camera.height, cache.binned.groups) for _ in range(3)
        )
        self.culled_beams = cache.beams
        if scenes.indenters is not None:
            self.culled_beams = cull_beams(
                cache.beams, cache.binned.cells, cache.binned.groups, scenes.balls
            )
        self._sparse = False  # whether only some of the pixels far from contacts are sampled

    def main_layers(self) -> NDArray[np.float32]:
        """Return the layers without reflections of interfaces and interreflection."""
        smooth = []
        if self.cache.traced_lobes:
            # The tails of narrow lobes differ between the cells of the cache.
            around = self.regions.near & (self.regions.distance > 1.0)
            smooth = [(around, round(NEAR_WIDTH * self.camera.width) | 1)]
        return self.film.averaged_layers(*self.size, smooth, deblurred=True)

    def reflections(self) -> NDArray[np.float32]:
        """Return the layers of reflections at interfaces; zero if they are known as faint light."""
        if self.faint_known:
            return np.zeros((self.film.groups, *self.size[::-1], 3), dtype=np.float32)
        return self.mirrored.layers(*self.size)

    def interreflection(self) -> NDArray[np.float32]:
        """Return the layers of the light that skin and contacts reflect to contacts."""
        reach = 1
        roughness = self.cache.roughness
        if roughness is not None and roughness >= AVERAGED_ROUGHNESS:
            reach = self.plan.interreflection_width(self.regions)
        return self.between.averaged_layers(*self.size, [(self.regions.contacts, reach)], True)

    def sample(
        self,
        pixel: mi.UInt32,
        number: mi.UInt32,
        in_contacts: bool,
        again: bool = False,
        count: mi.UInt32 | None = None,
    ) -> None:
        """Shade one camera sample of each pixel, and add it to the films.

        Args:
            number: (n,) number of each sample in its pixel.
            in_contacts: whether the light between contacts and skin is sampled.
            again: whether the pixels have been sampled before; their reflections are kept.
            count: (n,) number of samples of each pixel; unknown by default.
        """
        spots = film_samples(pixel, self.camera.width, number, seed_of(self.seed, 3), count)
        self.film.count(pixel)
        if in_contacts:
            self.between.count(pixel)
        if not again:
            self.mirrored.count(pixel)
        for channel in self.scenes.full.channels:
            main, reflected = self._visible_points(
                pixel, number, spots, in_contacts, again, channel
            )
            if in_contacts:
                direct, exchanged = shade_in_contacts(
                    self.cache,
                    self.scenes,
                    main,
                    self.effort,
                    not (self.faint_known or self.cache.traced_lobes),
                )
                self.film.add(main, direct)
                if exchanged is not None:
                    self.between.add(main, exchanged)
            else:
                self.film.add(main, self._shade(main, False))
            if self.glare_apart:
                main.light = dr.select(main.scattered, 0, main.light)
            self.film.add_light(main, self.windows)
            if reflected is not None:
                self.mirrored.add(reflected, self._shade(reflected, True))

    def _visible_points(
        self,
        pixel: mi.UInt32,
        number: mi.UInt32,
        spots: mi.Point2f,
        in_contacts: bool,
        again: bool,
        channel: int | None,
    ) -> tuple[VisiblePoints, VisiblePoints | None]:
        """Return main and reflected visible points of samples, known ones if there are any."""
        known = None if self.known is None or again else self.known.points
        key = in_contacts, self._sparse, channel
        points = None if known is None else known.get(key)
        if points is None:
            points = find_visible_points(
                self.scenes.full,
                self.camera,
                pixel,
                number,
                spots,
                seed_of(self.seed, 4, int(in_contacts)),
                again or self.faint_known,
                channel,
            )
            if known is not None:
                known[key] = points
        main, reflected = points
        return main, None if self.faint_known else reflected

    def _shade(self, points: VisiblePoints, reflected: bool) -> list[mi.Color3f]:
        return shade(self.cache, self.scenes, self.culled_beams, points, self.effort, reflected)

    def sample_near(self) -> None:
        """Sample the pixels in contacts and around them."""
        counted = [
            (*(tier := repeated(pixels, times)), dr.opaque(mi.UInt32, times, dr.width(tier[0])))
            for pixels, times in self.plan.of_contacts(self.regions)
            if pixels.any()
        ]
        if not counted:
            return
        pixel, number, count = reduce(joined, counted)
        dr.eval(pixel, number, count)
        self.sample(pixel, number, True, count=count)

    def sample_far(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Sample the pixels far from contacts, and return the layers of the image without
        interreflection, and those of its reflections.

        If there are many beams to sum, only every second pixel is shaded where its neighbours are
        similar. Pixels in grainy places and at the outlines of the skin and of lamps get further
        samples.
        """
        far = ~self.regions.near
        rays = self.regions.rays
        beams = dr.width(self.cache.beams.ways) / 4 / self.cache.binned.cells.cells
        most = SPARSE_METALLIC_BEAMS if self.cache.metallic else SPARSE_SHADING_BEAMS
        sparse = self._sparse = int(far.sum()) * beams > most
        filled = between_rays(rays, far) if sparse else np.zeros_like(far)
        first = far & ~filled
        edge = np.zeros_like(far) if self.plan.draft else first & sharp_edges(rays)
        if (once := first & ~edge).any():
            pixel = dr.compress(mi.Bool(padded(once.ravel())))
            self.sample(pixel, dr.zeros(mi.UInt32, dr.width(pixel)), False)
        if edge.any():
            pixel, number = repeated(edge, OUTLINE_SAMPLES)
            count = dr.opaque(mi.UInt32, OUTLINE_SAMPLES, dr.width(pixel))
            dr.eval(pixel, number, count)
            self.sample(pixel, number, False, count=count)
        reflections = self.reflections()
        if sparse:
            # Where few samples meet such reflections, each would show as a dot: at 320x240 pixels,
            # an eighth of the pixels of GelBelt would differ by more than 2 %.
            shaded = (far & rays.hit)[::2, ::2]
            reflections[:, ::2, ::2] = without_specks(
                reflections[:, ::2, ::2], np.zeros_like(shaded), shaded
            )
            fill(reflections, filled)
        layers = self.main_layers() + reflections
        step = 2 if sparse else 1
        grain = np.zeros_like(far)
        grain[::step, ::step] = grainy(
            layers[:, ::step, ::step].sum(axis=0) @ np.ones(3, dtype=np.float32),
            (far & rays.hit & (not self.plan.draft))[::step, ::step],
        )
        grain &= ~edge
        if grain.any():
            affordable = int(first.sum()) // (2 * int(grain.sum()))
            pixel, number = repeated(grain, min(GRAIN_SAMPLES, max(1, affordable)))
            dr.eval(pixel, number)
            self.sample(pixel, number, False, again=True)
            layers = self.main_layers() + reflections
        if sparse:
            alike = agreed(layers, filled)
            if (apart := filled & ~alike).any():
                self._sample_apart(apart, grain)
                layers = self.main_layers() + reflections
            fill(layers, alike)
        return layers, reflections

    def _sample_apart(self, apart: NDArray[np.bool_], grain: NDArray[np.bool_]) -> None:
        """Sample pixels (h, w) whose neighbours differ: the middle, and again where grainy."""
        width, height = self.size
        again = apart & np.kron(grain[::2, ::2], np.ones((2, 2), bool))[:height, :width]
        tiers = [repeated(each, 1) for each in (apart, again) if each.any()]
        tiers[0] = tiers[0][0], dr.zeros(mi.UInt32, dr.width(tiers[0][0]))
        pixel, number = reduce(joined, tiers)
        dr.eval(pixel, number)
        self.sample(pixel, number, False, again=True)

    def with_light_of_contacts(self, layers: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return layers with the light that contacts reflect to the skin beside them."""
        regions = self.regions
        skin = regions.rays.hit & (regions.rays.region == Region.SENSING)
        ring = skin & ~regions.near & regions.within(BESIDE_RANGE)
        beside = beside_layers(self.cache, self.scenes, self.camera, ring, self.seed)
        return layers if beside is None else layers + beside

"""A sensor design prepared for rendering: its scenes, emission guide and radiance caches."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass, field
from typing import Self

import drjit as dr
import numpy as np
from numpy.typing import NDArray

from optisense.design import SensorDesign
from optisense.geometry import Contact, TriangleMesh
from optisense.geometry.contact import refuse_no_contacts
from optisense.keyword_types import plain_numbers
from optisense.mechanics import ELASTIC, PressedSkin, SkinMesh
from optisense.mechanics.skins import refuse_drags
from optisense.optics._ray_model import RayModel
from optisense.optics._render_settings import check_choices, check_pixels, number_of_photons
from optisense.optics._skin_view import VIEW_ACROSS, SkinView
from optisense.optics.backend.interrupts import reraise_interrupts
from optisense.optics.backend.memory import bound_memory
from optisense.optics.backend.stages import RenderProgress, Stage, StageCallback, stage_callback
from optisense.optics.backend.variant import versions
from optisense.optics.camera.projection import RayCamera
from optisense.optics.estimators import RADIANCE_CACHE, SPPM
from optisense.optics.imaging.cached import render_cached
from optisense.optics.imaging.image_layers import ImageLayers, KnownView
from optisense.optics.imaging.lamp_images import LampImages
from optisense.optics.imaging.markers import MarkerDots, MarkerPlaces, ink_factor, off_skin_notes
from optisense.optics.imaging.sampling import PixelImportance, SamplingPlan
from optisense.optics.imaging.tactile_image import RADIANCE_UNIT, TactileImage
from optisense.optics.radiance_cache.lit_scene import LitScene
from optisense.optics.radiance_cache.store import CacheStore
from optisense.optics.radiance_cache.tracing_limits import TracingLimits
from optisense.optics.scene.contact_scenes import ContactScenes
from optisense.optics.scene.sensor_scenes import SensorScenes
from optisense.optics.scene.surface_cells import fineness
from optisense.optics.transport.chief_rays import ChiefRays, sees_nothing, trace_chief_rays
from optisense.optics.transport.emission_guide import EmissionGuide
from optisense.optics.transport.photons import Emission
from optisense.quality import PICTURE_PHOTONS, SCORE_PHOTONS

SPPM_PASS_PHOTONS = 1_000_000
"""Largest number of photons of one pass of the `sppm` estimator: enough that a disc of 0.3 mm on
GelSight Mini gets some 300 landings, and a photon map of 60 MB."""


@dataclass(frozen=True)
class ContactView:
    """What the camera sees of a sensor with contacts, before its light is known.

    Attributes:
        camera: the camera.
        placed: meshes of the contacts' indenters in the design's frame, mm.
        pressed: the elastic skin under the contacts; None without one.
        scenes: the sensor with its contacts.
        rays: the chief rays.
        skin: the mesh of the elastic skin under the contacts; None without one.
        known: parts of the image that drafts reuse.
    """

    camera: RayCamera
    placed: list[TriangleMesh]
    pressed: PressedSkin | None
    scenes: ContactScenes
    rays: ChiefRays
    skin: SkinMesh | None = None
    known: KnownView = field(default_factory=KnownView)


class OpticalModel(RayModel):
    """A sensor prepared for rendering many images.

    The scene of the sensor, the emission guide and the radiance cache are computed once. A contact
    adds only its own surface, and a light's flux or colour only scales its layer. A coating's
    specularity changes only its row of the surface table in the scene, but photons are traced anew.
    """

    is_draft = False
    """Whether images are drafts, coarser and faster."""

    store_type: type[CacheStore] = CacheStore
    """Kind of the store of radiance caches."""

    listener: Callable[[RenderProgress], None] | None = None
    """A function that is called with the progress of images if `render` is given no other."""

    _caches: CacheStore | None = None
    """The radiance caches, once they are used."""

    _lamps: LampImages | None = None
    """The mirror images of the lamps, once an image has been rendered."""

    @property
    def _store(self) -> CacheStore:
        if self._caches is None:
            self._caches = self._new_store()
        return self._caches

    def _new_store(self) -> CacheStore:
        rays = self.chief_rays(self._design.camera.size_at(VIEW_ACROSS))
        return self.store_type(LitScene.of(self.scenes, not self.is_draft), rays.points[rays.hit])

    def _set(self, design: SensorDesign, scenes: SensorScenes, view: SkinView) -> None:
        is_same = scenes.assembly is self.scenes.assembly and view is self._view
        if not is_same:
            self._lamps = None
        if self._caches is not None:
            if not is_same:
                self._caches = None
            elif scenes is not self.scenes:
                self._caches = self._caches.coated(LitScene.of(scenes, not self.is_draft))
        super()._set(design, scenes, view)

    def relit(self, design: SensorDesign) -> Self:
        """Return the model of a design that differs from this one's only in the colours and powers
        of its lights and must not be modified. It shares this one's scenes and radiance caches.
        """
        other = copy(self)
        other._design, other._caches = design, self._store
        return other

    def forget_light(self, guide: bool = False) -> None:
        """Drop the radiance caches (hundreds of MB); the next image traces its light again.

        Args:
            guide: whether the emission guide and the surface cells are dropped as well.
        """
        if self._caches is not None:
            self._caches = (
                None if guide else self._caches.coated(LitScene.of(self.scenes, not self.is_draft))
            )
            dr.flush_malloc_cache()

    @property
    def _lamp_images(self) -> LampImages:
        if self._lamps is None:
            scenes = self.scenes
            groups = scenes.emitter_table.groups
            self._lamps = LampImages(scenes.full, scenes.lamp_windows, groups)
        return self._lamps

    def guide(self) -> EmissionGuide:
        """Return the emission guide, which is learned from a pilot pass on first use."""
        return self._store.guide

    @reraise_interrupts
    def render(
        self,
        contacts: Sequence[Contact] = (),
        resolution: tuple[int, int] | None = None,
        photons: int | str | None = None,
        noise: float | None = None,
        seconds: float | None = None,
        seed: int = 0,
        progress: Callable[[RenderProgress], None] | None = None,
        estimator: str = RADIANCE_CACHE,
        only_contacts: bool = False,
        pixel_importance: PixelImportance | None = None,
        partial: bool = False,
        skin: str = ELASTIC,
    ) -> TactileImage:
        """Render the camera's image while ``contacts`` press into the skin.

        Args:
            contacts: indenters, places and depths; none for the untouched sensor.
            resolution: (width, height) pixels; the camera's own by default.
            photons: number of photons to trace, or a level of `optisense.quality`; the normal level
                if no other limit is given.
            noise: relative RMS noise (per cent) of the light on the sensing surface at which
                tracing stops.
            seconds: time limit (s) of the whole render.
            seed: seed of all random numbers. The same seed and settings give the same image
                regardless of earlier renders, except for rounding, which may change a shadow ray in
                single pixels at the edge of a contact.
            progress: function that is called with the progress during the render.
            estimator: "radiance-cache" (fast) or "sppm" (progressive photon mapping, to check it).
            only_contacts: whether only the pixels that see an indenter are shaded and the others
                stay dark; several times faster, for scores that read no other pixels.
            pixel_importance: function of the chief rays that gives, with ``only_contacts``, the
                share (h, w), 0 to 1, of the camera samples of each pixel; each pixel gets at least
                a few.
            partial: whether Ctrl-C after the first photons returns an image of the photons so far
                instead of raising KeyboardInterrupt.
            skin: "elastic" for a skin that deforms like a gel, also around contacts; "conforming"
                for a skin that takes the shape of the indenters where they overlap and stays flat
                around them, as in the objectives of the OptiSense paper.

        Returns:
            The image; ``interrupted`` is set if `partial` and Ctrl-C ended the tracing early.

        Raises:
            ContactError: a contact is off the surface or deeper than the gel, or has a shift or a
                twist on a conforming skin, or `contacts` is no list of contacts.
            RenderError: the camera sees nothing of the sensing surface, or a setting is invalid.
        """
        refuse_no_contacts(contacts)
        noise, seconds, seed = plain_numbers((noise, seconds, seed))  # for `settings`
        check_choices(estimator, skin, noise, seconds, seed)
        refuse_drags(contacts, skin)
        check_pixels(resolution)
        number = None if photons is None else number_of_photons(photons)
        began = time.perf_counter()
        bound_memory()
        on_stage = stage_callback(progress or self.listener, began)

        on_stage(Stage.PREPARING, 0.0, 0, None)
        view = self._contact_view(contacts, resolution, skin)
        camera = view.camera
        built = time.perf_counter()

        if estimator == SPPM:
            lit = built
            layers = self._render_sppm(view, number, seconds, seed, began, on_stage)
        else:
            target = None if noise is None else noise / 100
            wanted = number
            if number is None and noise is None and seconds is None:
                wanted = PICTURE_PHOTONS
            store = self._store
            limits = TracingLimits(wanted, target, seconds, began=began)
            light = store.radiance_cache(seed, limits, on_stage, partial)
            lit = time.perf_counter()
            on_stage(Stage.SHADING, 1.0, light[0].photons, light[0].noise)
            layers = render_cached(
                light,
                view.scenes,
                camera,
                view.rays,
                self.scenes.lamp_windows,
                seed,
                SamplingPlan(only_contacts, pixel_importance, self.is_draft),
                view.known if self.is_draft else None,
                None if self.is_draft else self._lamp_images,
            )
        ended = time.perf_counter()
        on_stage(Stage.DONE, 1.0, layers.photons, layers.noise)
        image = self._image(layers, view, contacts)
        notes = self._design.camera.shape_notes((camera.width, camera.height))
        if self._design.markers is not None and image.markers is not None:
            notes += off_skin_notes(self._design.markers, image.markers.coordinates)
        image.settings = {
            "design": self._design.name,
            "seed": seed,
            "resolution": [camera.width, camera.height],
            "notes": notes,
            "estimator": estimator,
            "units": {"radiance": RADIANCE_UNIT, "length": "mm"},
            "photons": layers.photons,
            "photons_asked": number,
            "noise_asked_percent": noise,
            "seconds_asked": seconds,
            "noise_reached_percent": _percent(layers.noise),
            "noise_of_worst_places_percent": _percent(layers.worst_noise),
            "samples_per_pixel": layers.samples,
            "interrupted": layers.interrupted,
            "contacts": [repr(contact) for contact in contacts],
            "skin": skin,
            "presses": [] if view.pressed is None else view.pressed.in_numbers(),
            "seconds": {
                "scene": round(built - began, 4),
                "light": round(lit - built, 4),
                "image": round(ended - lit, 4),
                "total": round(ended - began, 4),
            },
            "versions": versions(self.variant),
        }
        return image

    def _image(
        self, layers: ImageLayers, view: ContactView, contacts: Sequence[Contact]
    ) -> TactileImage:
        """Return the tactile image of an image's layers, with the markers of the skin."""
        units = dict(zip(self._traced_groups, layers.radiance, strict=True))
        hit = view.rays.hit
        points, normals = (
            np.where(hit[..., None], each, np.nan).astype(np.float32)
            for each in (view.rays.points, view.rays.normals)
        )
        markers = None
        if self._design.markers is not None:
            factor, markers = self._marked(points, normals, view.pressed, view.camera)
            units = {name: layer * factor for name, layer in units.items()}
        return TactileImage(
            layers={
                name: layer * self._design.lights[name].channel_flux().astype(np.float32)
                for name, layer in units.items()
            },
            unit_layers=units,
            normals=normals,
            contact_mask=view.rays.contact_mask,
            points=points,
            interrupted=layers.interrupted,
            chain=self.picture_chain,
            indenters=_named(contacts, view.placed),
            pressed=view.pressed,
            markers=markers,
        )

    def _contact_view(
        self, contacts: Sequence[Contact], resolution: tuple[int, int] | None, skin: str
    ) -> ContactView:
        """Press the contacts, and trace the chief rays of an image; see `render`."""
        camera = self.camera(resolution)
        placed = [self.place(contact) for contact in contacts]
        pressed = mesh = None
        if contacts and skin == ELASTIC:
            pressed = self.pressed(contacts, placed)
            mesh = self._view.gel.mesh(contacts)
            scenes = self.scenes.deformed(mesh, pressed)
        else:
            scenes = self.scenes.touched(contacts, placed)
        rays = trace_chief_rays(scenes.full, camera)
        if not rays.hit.any():
            raise sees_nothing(rays, scenes.full)
        return ContactView(camera, placed, pressed, scenes, rays, mesh)

    @property
    def _traced_groups(self) -> list[str]:
        """The names of the light groups whose layers are rendered."""
        return self.groups

    def _marked(
        self,
        seen: NDArray[np.float32],
        normals: NDArray[np.float32],
        pressed: PressedSkin | None,
        camera: RayCamera,
    ) -> tuple[NDArray[np.float32], MarkerPlaces]:
        """Return the factors (h, w, 3) by which markers darken pixels, and the markers' places."""
        markers = self._design.markers
        assert markers is not None
        points = seen.astype(np.float64)
        moved = np.zeros_like(points)
        if pressed is not None:
            moved = pressed.maps(points, normals).displacement
        material = points - moved
        dots = MarkerDots.on(markers, self.surface)
        share = dots.coverage(material)[..., None]
        factor = 1.0 - share + share * ink_factor(markers, self._design.coating)
        untouched = self.chief_rays((camera.width, camera.height))
        return factor.astype(np.float32), dots.places(untouched, material, moved)

    def marker_notes(self) -> list[str]:
        """Return a note on the design's markers that lie off the skin; none if all lie on it."""
        markers = self._design.markers
        if markers is None:
            return []
        return off_skin_notes(markers, MarkerDots.on(markers, self.surface).coordinates)

    def _render_sppm(
        self,
        view: ContactView,
        photons: int | None,
        seconds: float | None,
        seed: int,
        began: float,
        on_stage: StageCallback,
    ) -> ImageLayers:
        from optisense.optics.imaging.sppm import FIRST_RADIUS, render_sppm

        wanted = photons or 16 * SCORE_PHOTONS
        lights = self.scenes.emitter_table.count
        passes = max(1, -(-wanted // SPPM_PASS_PHOTONS))
        per_light = max(1, -(-wanted // (passes * lights)))
        emitted = per_light * lights

        def stop(done: int) -> bool:
            on_stage(Stage.PHOTONS, done / passes, done * emitted, None)
            return seconds is not None and time.perf_counter() - began > seconds

        result = render_sppm(
            view.scenes.full,
            Emission(self.scenes.emitter_table, self.guide(), per_light, seed),
            view.camera,
            passes,
            coloured=self.scenes.coloured,
            radius=FIRST_RADIUS * fineness(self.scenes.opaque),
            stop=stop,
        )
        return ImageLayers(
            radiance=result.layers,
            photons=result.photons,
            noise=result.noise,
            worst_noise=None,
            samples=[result.passes, result.passes],
            interrupted=False,
        )


def _named(contacts: Sequence[Contact], placed: list[TriangleMesh]) -> dict[str, TriangleMesh]:
    """Return the indenters' meshes by name: the kind and a number."""
    named = {}
    for number, (contact, mesh) in enumerate(zip(contacts, placed, strict=True), start=1):
        kind = type(contact.indenter).__name__.removesuffix("Indenter").lower()
        named[f"{kind} {number}"] = mesh
    return named


def _percent(noise: float | None) -> float | None:
    return None if noise is None or not np.isfinite(noise) else round(100 * noise, 4)

"""Drafts: coarse images for interactive editing, by a model that reuses data between designs.

Preparing a changed design takes longer than tracing the light of a small picture. A draft model
therefore keeps the shapes of cages that did not move, contacts and surface cells where the surface
moved by little, and the emission guide, which stays unbiased when lights move (no direction is left
out) and only becomes less efficient. Contacts are pressed in coarsely and get few camera samples.

A coarse image, from which a search learns which designs are worth full scores, is as coarse as a
draft, but reuses nothing of earlier designs: the score of a design does not depend on those scored
before it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optisense.design import SensorDesign
from optisense.geometry import Contact, TriangleMesh
from optisense.geometry.indenter_kinds import FACET_ERROR
from optisense.mechanics import ELASTIC
from optisense.optics._carried_contacts import PressedContacts
from optisense.optics._draft_light import (
    DRAFT_CELL_SCALE,
    DRAFT_PILOT_PHOTONS,
    DraftCacheStore,
    KeptView,
)
from optisense.optics._model import ContactView, OpticalModel
from optisense.optics._ray_model import RayModel
from optisense.optics._skin_view import VIEW_ACROSS, SkinView
from optisense.optics.imaging.tactile_image import TactileImage
from optisense.optics.radiance_cache.lit_scene import LitScene
from optisense.optics.radiance_cache.store import CELL_SIZE, CacheStore
from optisense.optics.scene.assembly import assemble
from optisense.optics.scene.media import same_faces
from optisense.optics.scene.sensor_scenes import SensorScenes
from optisense.optics.transport.chief_rays import sees_nothing, trace_chief_rays
from optisense.quality import photons_of

DRAG_PHOTONS = 0.25
"""Share of a draft's photons that are traced while something moves. On GelSight Mini, the error is
then 10 % of the mean light while a light is dragged and 14 % for a cage point; with half of the
photons, which take a tenth more time, it would be 9 and 11 %."""

CARRY_TOLERANCE = 2.0
"""Largest displacement of the undeformed skin (mm) up to which a draft moves a pressed skin along
with it. In a contact on a GelSight Mini bent by 2 mm, the error against the full picture is then
7.6 %, and 7.3 % if the contact is pressed anew."""

NOT_SHOWN = frozenset({"schema_version", "name", "description", "provenance"})
"""Fields of a design that no picture depends on."""

PLACED_CONTACTS = 64
"""Number of contacts whose placed meshes a draft keeps: more than the presses of any objective, and
about 10 MB of meshes."""


@dataclass(frozen=True)
class _Shown:
    """The last draft, its arguments, and whether it reused data of earlier drafts (``kept``)."""

    contacts: tuple[Contact, ...]
    asked: tuple[Any, ...]
    design: SensorDesign
    image: TactileImage
    kept: bool


class DraftView(SkinView):
    """A view for drafts, which caches placed contacts."""

    facet_error = 10 * FACET_ERROR  # still far below a pixel; shading normals are exact
    coarse = True

    def __init__(self, design: SensorDesign, scenes: SensorScenes) -> None:
        """Prepare the view; the arguments are those of `SkinView`."""
        super().__init__(design, scenes)
        self._placed: Callable[[Contact], TriangleMesh]
        self._placed = lru_cache(maxsize=PLACED_CONTACTS)(super().place)

    def place(self, contact: Contact) -> TriangleMesh:
        """Return the mesh of a contact's indenter, a known one if there is any."""
        return self._placed(contact)


class DraftModel(OpticalModel):
    """An `OpticalModel` for drafts: it renders a slightly blurred picture several times faster if
    successive designs differ by little.
    """

    is_draft = True
    bends_media = True
    view_type = DraftView

    def __init__(
        self, design: SensorDesign, variant: str = "auto", before: RayModel | None = None
    ) -> None:
        """Resolve media and build the scene; the arguments are those of `OpticalModel`."""
        self._rest: dict[str, TriangleMesh] = {}
        self._bent: dict[str, TriangleMesh] = {}
        self._before: DraftCacheStore | None = None
        self._moved: frozenset[int] | None = None
        self._kept: KeptView | None = None
        self._faint: dict[str, NDArray[np.float32]] = {}
        """The faint light (`KnownView.faint`) of each group that drafts reuse."""
        self._last_view: ContactView | None = None
        self._pressed: PressedContacts | None = None
        """The contacts that were pressed in last."""
        self._shown: _Shown | None = None
        super().__init__(self._straightened(design), variant, before)

    def set_design(self, design: SensorDesign) -> None:
        """Adopt another design; see `RayModel.set_design`."""
        super().set_design(self._straightened(design))

    def _view_of(self, design: SensorDesign, scenes: SensorScenes) -> SkinView:
        if _all_but_lights_same(self._design, design):
            return self._view  # the view does not depend on the lights
        return super()._view_of(design, scenes)

    def render(self, contacts: Sequence[Contact] = (), *args: Any, **kwargs: Any) -> TactileImage:
        """Render a draft; see `OpticalModel.render`.

        If the design has changed since the previous draft, fewer photons are traced, and the light
        that interfaces, or contacts and skin, reflect to each other is taken to be the same share
        of the light. If only lights have moved, the layers of the other light groups and the
        visible points are reused, and photons pass through the windows of the moved lights. This
        ignores the shadows that moved lights cast. A second request for the same draft renders it
        completely, with its media resolved; ``settings["kept_layers"]``,
        ``settings["kept_view"]`` and ``settings["kept_media"]`` record what was reused.
        """
        contacts = tuple(contacts)
        asked = args, {k: v for k, v in kwargs.items() if k != "progress"}
        before = self._shown
        if before is not None and not (before.asked == asked and self._are_same(contacts)):
            before = None
        moved = None if before is None else _moved(before.design, self._design)
        still = moved is not None and not moved
        if before is not None and still:
            if not before.kept:
                return self._relit(before.image)
            self._resolve()
            moved = None
        self._shown = None
        if moved != self._moved and self._caches is not None:  # of other light groups
            self._before, self._caches = self._draft_store, None
        self._moved = moved
        self._last_view = None if self._kept is None else self._kept.view
        if moved is None:
            self._kept = None
        if before is None or not _same_picture(before.design, self._design) or still:
            self._faint = {}
        elif "photons" in kwargs:
            kwargs["photons"] = round(DRAG_PHOTONS * photons_of(kwargs["photons"]))
        image = super().render(contacts, *args, **kwargs)
        if not self._faint and self._kept is not None and self._kept.view.known.faint is not None:
            self._faint = dict(zip(self.groups, self._kept.view.known.faint, strict=True))
        kept: list[str] = []
        if before is not None and moved is not None:
            kept = [name for k, name in enumerate(self.groups) if k not in moved]
            layers = before.image.unit_layers | image.unit_layers
            image.unit_layers = {name: layers[name] for name in self.groups}
            image = self._relit(image)
        bent = self.scenes.assembly.media.bent or self._has_old_cells
        view = before is not None and bool(self._faint) and not still
        image.settings |= {"kept_layers": kept, "kept_view": view, "kept_media": bent}
        if not image.interrupted:
            self._shown = _Shown(contacts, asked, self._design, image, bent or view)
        return image

    @property
    def _traced_groups(self) -> list[str]:
        names = self.groups
        return names if self._moved is None else [names[k] for k in sorted(self._moved)]

    def _contact_view(
        self, contacts: Sequence[Contact], resolution: tuple[int, int] | None, skin: str
    ) -> ContactView:
        if self._moved is None or self._kept is None:
            view = self._carried_view(contacts, resolution, skin)
            self._kept = KeptView(view or super()._contact_view(contacts, resolution, skin))
            if view is None:
                self._pressed = PressedContacts(tuple(contacts), self.sensing)
        known = self._kept.view.known
        known.faint = None
        if self._faint:
            known.faint = np.stack([self._faint[name] for name in self._traced_groups])
        return self._kept.view

    def _carried_view(
        self, contacts: Sequence[Contact], resolution: tuple[int, int] | None, skin: str
    ) -> ContactView | None:
        """Return the view whose deformed skin moved along with a cage by little; None if none."""
        if not self._faint or self._last_view is None or self._pressed is None or skin != ELASTIC:
            return None
        old, now = self._pressed.skin, self.sensing
        last, pressed = self._last_view, self._last_view.pressed
        mesh = last.skin
        if pressed is None or mesh is None or mesh.origin is None or not same_faces(old, now):
            return None
        if np.abs(old.vertices - now.vertices).max(initial=0.0) > CARRY_TOLERANCE:
            return None
        camera = self.camera(resolution)
        mesh = mesh.carried(now)
        # Behind the pressed skin, rays meet the undeformed skin before any interface. The scene of
        # the photons thus serves as that of the opaque surfaces, which saves building it.
        scenes = self.scenes.deformed(mesh, pressed, self.scenes.full)
        rays = trace_chief_rays(scenes.full, camera)
        if not rays.hit.any():
            raise sees_nothing(rays, scenes.full)
        return ContactView(camera, last.placed, pressed, scenes, rays, mesh)

    def _are_same(self, contacts: tuple[Contact, ...]) -> bool:
        """Return whether contacts are the last ones, perhaps carried along by a bent skin."""
        assert self._shown is not None
        if contacts == self._shown.contacts:
            return True
        bent = self._shown.design.meshes != self._design.meshes
        return (
            bent and self._pressed is not None and self._pressed.carried_to(contacts, self.sensing)
        )

    @property
    def _draft_store(self) -> DraftCacheStore | None:
        return self._caches if isinstance(self._caches, DraftCacheStore) else None

    @property
    def _has_old_cells(self) -> bool:
        return self._draft_store is not None and self._draft_store.has_old_cells

    def _resolve(self) -> None:
        """Resolve media that were only moved with bent parts, and divide bent skins into cells."""
        store = self._draft_store
        if store is not None and store.has_old_cells:
            store.forget_cells()
            self._before, self._caches = store, None
        if self.scenes.assembly.media.bent:
            assembly = assemble(self._design, self.scenes.assembly)
            scenes = SensorScenes(assembly, self._design.coating, self.scenes)
            self._set(self._design, scenes, self.view_type(self._design, scenes))

    def _relit(self, image: TactileImage) -> TactileImage:
        """Return the same image under the design's own lights."""
        return image.relight(
            {name: self._design.lights[name].channel_flux() for name in image.unit_layers}
        )

    def _set(self, design: SensorDesign, scenes: SensorScenes, view: SkinView) -> None:
        self._before = self._draft_store or self._before
        super()._set(design, scenes, view)

    def _new_store(self) -> DraftCacheStore:
        before = self._before
        if self._moved is not None and self._kept is not None and before is not None:
            lit = self._kept.lit_by(self._moved, self.scenes)
            if before.has_guide_for(lit):
                return DraftCacheStore(lit, before.seen, before, range(len(self._moved)))
        lit = LitScene.of(self.scenes, may_trace_lobes=False)
        if before is not None and before.has_guide_for(lit):
            return DraftCacheStore(lit, before.seen, before)
        rays = self.chief_rays(self._design.camera.size_at(VIEW_ACROSS))
        return DraftCacheStore(lit, rays.points[rays.hit], before)

    def _straightened(self, design: SensorDesign) -> SensorDesign:
        """Return the sensor with bent meshes for cages; unmoved meshes are the same objects."""
        shapes = design.deformed_meshes()
        for name, mesh in shapes.items():
            known = self._bent.get(name)
            if (
                known is not None
                and self._rest[name] is design.meshes[name]
                and np.array_equal(known.vertices, mesh.vertices)
            ):
                shapes[name] = known
        self._rest, self._bent = dict(design.meshes), shapes
        straight = design.copy()
        straight.cages = {}
        straight.meshes.clear()
        straight.meshes.update(shapes)
        return straight


def _all_but_lights_same(one: SensorDesign, other: SensorDesign) -> bool:
    """Return whether designs have the same mesh objects and visible values except for lights."""
    return one.meshes == other.meshes and all(
        getattr(one, field) == getattr(other, field)
        for field in SensorDesign.model_fields.keys() - NOT_SHOWN - {"lights"}
    )


def _same_picture(one: SensorDesign, other: SensorDesign) -> bool:
    """Return whether two designs have the same camera and light groups."""
    return one.camera == other.camera and list(one.lights) == list(other.lights)


def _moved(one: SensorDesign, other: SensorDesign) -> frozenset[int] | None:
    """Return the numbers of groups whose lights moved; None if more than the lights differs."""
    if list(one.lights) != list(other.lights) or not _all_but_lights_same(one, other):
        return None
    pairs = zip(one.lights.values(), other.lights.values(), strict=True)
    return frozenset(
        k
        for k, (a, b) in enumerate(pairs)
        if (a.model, a.emitter, a.lights) != (b.model, b.emitter, b.lights)
    )


class CoarseCacheStore(CacheStore):
    """Store of radiance caches in wide cells."""

    cell_size = DRAFT_CELL_SCALE * CELL_SIZE
    thorough = False
    uses_pilot = False
    pilot_photons = DRAFT_PILOT_PHOTONS


class CoarseModel(OpticalModel):
    """An `OpticalModel` for coarse images, which take about a sixth of the time."""

    is_draft = True
    view_type = DraftView
    store_type = CoarseCacheStore

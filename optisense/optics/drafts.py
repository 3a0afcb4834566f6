"""Drafts: coarse images for interactive editing, by a model that reuses data between designs.

Preparing a changed design takes longer than tracing the light of a small picture. A draft model
therefore keeps the shapes of cages that did not move, contacts and surface cells where the surface
moved by little, and the emission guide, which stays unbiased when lights move (no direction is left
out) and only becomes less efficient. Contacts are pressed in coarsely and get few camera samples.
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
from optisense.optics.imaging.tactile_image import TactileImage
from optisense.optics.model import OpticalModel
from optisense.optics.radiance_cache.lit_scene import LitScene
from optisense.optics.radiance_cache.store import CELL_SIZE, VIEW_MARGIN, CacheStore
from optisense.optics.scene.assembly import assemble
from optisense.optics.scene.ray_scene import Piece
from optisense.optics.scene.sensor_scenes import SensorScenes
from optisense.optics.skin_view import VIEW_RESOLUTION, SkinView

DRAFT_CELL_SCALE = 2.4
"""Ratio of a draft's cell size to that of a full image. With the few photons of a draft, wider
cells give a smaller error against the full image: 9 % instead of 14 % with cells half as wide. They
also take much less time to smooth."""


PLACED_CONTACTS = 64
"""Number of contacts whose placed meshes a draft keeps: more than the presses of any objective, and
about 10 MB of meshes."""

GUIDE_TOLERANCE = 0.5 * VIEW_MARGIN
"""Largest displacement of a vertex (mm) up to which a draft keeps the emission guide that was
learned before the shapes changed: half of `VIEW_MARGIN`."""

CELL_TOLERANCE = 0.25
"""Largest displacement of a vertex (mm) up to which a draft keeps the surface cells of the shape
before: a fifth of the side of a draft's cells. A GelSight Mini bent by 0.225 mm has an error of
7.0 % with them and of 6.6 % with cells of its own."""


@dataclass(frozen=True)
class _Shown:
    """The last draft with its arguments; ``kept`` tells whether it reused layers, media or cells
    of an earlier draft.
    """

    asked: tuple[Any, ...]
    design: SensorDesign
    image: TactileImage
    kept: bool


class DraftCacheStore(CacheStore):
    """Store of radiance caches in coarse cells that reuses data of the store before it."""

    cell_size = DRAFT_CELL_SCALE * CELL_SIZE
    thorough = False
    uses_pilot = False  # saves half of the tracing time, for some per cent on flanks of contacts

    def __init__(
        self, lit: LitScene, seen: NDArray[np.floating], before: DraftCacheStore | None
    ) -> None:
        """Create an empty store; `before` is the store of the previous design, if there is one."""
        super().__init__(lit, seen)
        self.seen = seen
        self.has_old_cells = False
        """Whether the surface cells are those of a shape before."""
        self._learned_on = self._divided = lit.opaque
        if before is None:
            return
        off = _apart(lit.opaque, before._divided)
        same_view = seen is before.seen or np.array_equal(seen, before.seen)
        same_groups = lit.table.groups == before._lit.table.groups
        if off < CELL_TOLERANCE and same_view and same_groups:
            self._cells, self._kernels = before._cells, before._kernels
            self._divided, self.has_old_cells = before._divided, off > 0.0
        if before.has_guide_for(lit):
            self._guide, self._learned_on = before._guide, before._learned_on

    def forget_cells(self) -> None:
        """Drop the surface cells, so that the next store divides its surfaces anew."""
        self._cells = self._kernels = None
        self._divided = []

    def has_guide_for(self, lit: LitScene) -> bool:
        """Return whether the store has an emission guide for the lights of this sensor."""
        known = self._guide is not None and lit.table.count == self._lit.table.count
        return known and _apart(lit.opaque, self._learned_on) < GUIDE_TOLERANCE


class DraftView(SkinView):
    """A view for drafts, which caches placed contacts."""

    facet_error = 10 * FACET_ERROR  # still far below a pixel; shading normals are exact
    coarse = True

    def __init__(self, design: SensorDesign, scenes: SensorScenes) -> None:
        """See `SkinView`."""
        super().__init__(design, scenes)
        self._placed: Callable[[Contact], TriangleMesh]
        self._placed = lru_cache(maxsize=PLACED_CONTACTS)(super().place)

    def place(self, contact: Contact) -> TriangleMesh:
        """Place a contact, from the cache if it is known; see `SkinView.place`."""
        return self._placed(contact)


class DraftModel(OpticalModel):
    """An `OpticalModel` for drafts: it renders a slightly blurred picture several times faster if
    successive designs differ by little.
    """

    is_draft = True
    bends_media = True
    view_type = DraftView

    def __init__(self, design: SensorDesign, variant: str = "auto") -> None:
        """See `OpticalModel`."""
        self._rest: dict[str, TriangleMesh] = {}
        self._bent: dict[str, TriangleMesh] = {}
        self._before: DraftCacheStore | None = None
        self._shown: _Shown | None = None
        super().__init__(self._straightened(design), variant)

    def set_design(self, design: SensorDesign) -> None:
        """Adopt another design; see `RayModel.set_design`."""
        super().set_design(self._straightened(design))

    def _view_of(self, design: SensorDesign, scenes: SensorScenes) -> SkinView:
        if _all_but_lights_same(self.design, design):
            return self._view  # the view does not depend on the lights
        return super()._view_of(design, scenes)

    def render(self, contacts: Sequence[Contact] = (), *args: Any, **kwargs: Any) -> TactileImage:
        """Render a draft; see `OpticalModel.render`.

        If only lights have moved since the previous draft, the layers of the other light groups are
        reused. This ignores the shadows that moved lights cast in the light of the others. A second
        request for the same draft renders it completely, with its media resolved;
        ``settings["kept_layers"]`` and ``settings["kept_media"]`` record what was reused.
        """
        asked = tuple(contacts), args, {k: v for k, v in kwargs.items() if k != "progress"}
        before = self._shown if self._shown is not None and self._shown.asked == asked else None
        moved = None if before is None else _moved(before.design, self.design)
        if before is not None and not moved:  # no light moved, or more than lights
            if moved is not None and not before.kept:
                return self._relit(before.image)
            if moved is not None:
                self._resolve()
            moved = None
        self._shown = None
        self._store.groups = moved
        image = super().render(contacts, *args, **kwargs)
        kept = [] if moved is None else [n for k, n in enumerate(self.groups) if k not in moved]
        if before is not None:
            for name in kept:
                image.unit_layers[name] = before.image.unit_layers[name]
            image = self._relit(image)
        bent = self.scenes.assembly.media.bent or self._has_old_cells
        image.settings |= {"kept_layers": kept, "kept_media": bent}
        if not image.interrupted:
            self._shown = _Shown(asked, self.design, image, bent or bool(kept))
        return image

    @property
    def _has_old_cells(self) -> bool:
        return isinstance(self._caches, DraftCacheStore) and self._caches.has_old_cells

    def _resolve(self) -> None:
        """Resolve media that were only moved along with bent parts, and divide bent surfaces into
        cells.
        """
        if isinstance(self._caches, DraftCacheStore) and self._caches.has_old_cells:
            self._caches.forget_cells()
            self._before, self._caches = self._caches, None
        if self.scenes.assembly.media.bent:
            assembly = assemble(self.design, self.scenes.assembly)
            scenes = SensorScenes(assembly, self.design.coating, self.scenes)
            self._set(self.design, scenes, self.view_type(self.design, scenes))

    def _relit(self, image: TactileImage) -> TactileImage:
        """Return the same image under the design's own lights."""
        return image.relight(
            {name: self.design.lights[name].channel_flux() for name in image.unit_layers}
        )

    def _set(self, design: SensorDesign, scenes: SensorScenes, view: SkinView) -> None:
        if isinstance(self._caches, DraftCacheStore):
            self._before = self._caches
        super()._set(design, scenes, view)

    def _new_store(self) -> DraftCacheStore:
        lit, before = LitScene.of(self.scenes), self._before
        if before is not None and before.has_guide_for(lit):
            return DraftCacheStore(lit, before.seen, before)
        rays = self.chief_rays(VIEW_RESOLUTION)
        return DraftCacheStore(lit, rays.points[rays.hit], before)

    def _straightened(self, design: SensorDesign) -> SensorDesign:
        """Return the same sensor with bent meshes instead of cages.

        Meshes that did not move are the same objects as before, by which a model recognises the
        data that it can reuse.
        """
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
    """Return whether designs without cages have the same shapes, materials and camera."""
    return (
        one.meshes == other.meshes  # the same objects
        and (one.parts, one.materials, one.camera) == (other.parts, other.materials, other.camera)
    )


def _moved(one: SensorDesign, other: SensorDesign) -> frozenset[int] | None:
    """Return the numbers of the light groups that differ in more than flux and colour.

    The result is None if all groups differ, or if anything other than lights differs.
    """
    if (
        list(one.lights) != list(other.lights)
        or one.coating != other.coating
        or not _all_but_lights_same(one, other)
    ):
        return None
    pairs = zip(one.lights.values(), other.lights.values(), strict=True)
    moved = frozenset(
        k
        for k, (a, b) in enumerate(pairs)
        if (a.model, a.emitter, a.lights) != (b.model, b.emitter, b.lights)
    )
    return None if len(moved) == len(one.lights) else moved


def _apart(one: list[Piece], other: list[Piece]) -> float:
    """Return the largest distance (mm) between corresponding vertices; infinite if the faces
    differ.
    """
    if len(one) != len(other):
        return np.inf
    farthest = 0.0
    for a, b in zip(one, other, strict=True):
        if a is b:
            continue
        if len(a.vertices) != len(b.vertices) or not np.array_equal(a.faces, b.faces):
            return np.inf
        farthest = max(farthest, float(np.abs(a.vertices - b.vertices).max(initial=0.0)))
    return farthest

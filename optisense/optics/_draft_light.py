"""What drafts keep of the light and the view of the draft before."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from optisense.optics._model import ContactView
from optisense.optics.radiance_cache.lit_scene import LitScene
from optisense.optics.radiance_cache.store import CELL_SIZE, VIEW_MARGIN, CacheStore
from optisense.optics.scene.emitters import emitter_table
from optisense.optics.scene.ray_scene import Piece, RayScene
from optisense.optics.scene.sensor_scenes import SensorScenes
from optisense.optics.scene.surface_cells import SurfaceCells, cells_near
from optisense.optics.scene.surfaces import SurfaceKind

DRAFT_CELL_SCALE = 2.4
"""Ratio of the side of a draft's cells to `CELL_SIZE`, that of a full image. With the few photons
of a draft, wider cells give a smaller error against the full image: 9 % instead of 14 % with cells
half as wide. They also take much less time to smooth."""

DRAFT_PILOT_PHOTONS = 60_000
"""Number of photons of a draft's pilot pass, a fifth of that of a full image, as no more than a
draft's photons follow the emission guide."""

GUIDE_TOLERANCE = 0.5 * VIEW_MARGIN
"""Largest displacement of a vertex (mm) up to which a draft keeps the emission guide that was
learned before the shapes changed: half of `VIEW_MARGIN`."""

CELL_TOLERANCE = 0.25
"""Largest displacement of a vertex (mm) up to which a draft keeps the surface cells of the shape
before: a fifth of the side of a draft's cells. A GelSight Mini bent by 0.225 mm has an error of
7.0 % with them and of 6.6 % with cells of its own."""


@dataclass
class KeptView:
    """What drafts keep while only lights move: the camera's view of the sensor, and the sensor
    without the windows of the lights that move.
    """

    view: ContactView
    unlit: tuple[list[Piece], RayScene] | None = None

    def lit_by(self, moved: frozenset[int], scenes: SensorScenes) -> LitScene:
        """Return the sensor with the light groups ``moved`` alone, without their windows.

        The groups are numbered from 0 in the order of their numbers; the others get the numbers
        that follow.
        """
        order = sorted(moved)
        emitters = scenes.assembly.emitters
        numbers = [
            number
            for number, piece in enumerate(scenes.pieces)
            if piece.surface.kind is not SurfaceKind.LIGHT
            or emitters[piece.surface.light].group not in moved
        ]
        pieces = [scenes.pieces[number] for number in numbers]
        if self.unlit is None or not _same(self.unlit[0], pieces):
            self.unlit = pieces, RayScene(pieces, numbers, scenes.table)
        place = {group: number for number, group in enumerate(order)}
        renamed = [replace(e, group=place.get(e.group, len(order))) for e in emitters]
        return LitScene(
            self.unlit[1].with_table(scenes.table),
            scenes.opaque,
            emitter_table(renamed, len(order)),
            scenes.coloured,
            scenes.roughness,
        )


class DraftCacheStore(CacheStore):
    """Store of radiance caches in coarse cells that reuses data of the store before it."""

    cell_size = DRAFT_CELL_SCALE * CELL_SIZE
    thorough = False
    pilot_photons = DRAFT_PILOT_PHOTONS
    uses_pilot = False  # saves half of the tracing time, for some per cent on flanks of contacts

    def __init__(
        self,
        lit: LitScene,
        seen: NDArray[np.floating],
        before: DraftCacheStore | None,
        groups: Iterable[int] | None = None,
    ) -> None:
        """Create an empty store.

        Args:
            seen: (n, 3) points (mm) that the camera sees.
            before: the store of the previous design, if there is one.
            groups: the light groups whose light is traced; all groups if None.
        """
        super().__init__(lit, seen)
        self.groups = None if groups is None else frozenset(groups)
        self.seen = seen
        self.has_old_cells = False
        """Whether the surface cells are those of a shape before."""
        self._learned_on = self._divided = lit.opaque
        self.most_groups = lit.table.groups
        """Number of light groups for which the surface cells are large enough."""
        if before is None:
            return
        off = _apart(lit.opaque, before._divided)
        same_view = seen is before.seen or np.array_equal(seen, before.seen)
        # Cells are larger for more groups, and those of all groups do for some of them.
        if off < CELL_TOLERANCE and same_view and lit.table.groups <= before.most_groups:
            self._cells, self._kernels = before._cells, before._kernels
            self._divided, self.has_old_cells = before._divided, off > 0.0
            self.most_groups = before.most_groups
        if before.has_guide_for(lit):
            self._guide, self._learned_on = before._guide, before._learned_on

    @cached_property
    def _target(self) -> tuple[SurfaceCells, NDArray[np.bool_]]:
        """The cells of the light, and the mask of those in or near the view."""
        return self.cells, cells_near(self.cells, self._seen, VIEW_MARGIN)

    def forget_cells(self) -> None:
        """Drop the surface cells, so that the next store divides its surfaces anew."""
        self._cells = self._kernels = None
        self._divided = []

    def has_guide_for(self, lit: LitScene) -> bool:
        """Return whether the store has an emission guide for the lights of this sensor."""
        known = self._guide is not None and lit.table.count == self._lit.table.count
        return known and _apart(lit.opaque, self._learned_on) < GUIDE_TOLERANCE


def _same(one: list[Piece], other: list[Piece]) -> bool:
    """Return whether lists hold the same objects."""
    return len(one) == len(other) and all(a is b for a, b in zip(one, other, strict=True))


def _apart(one: list[Piece], other: list[Piece]) -> float:
    """Return the largest distance (mm) between vertices; infinite if the faces differ."""
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

"""A model for pictures that follow the hand: coarser in space, and kept from change to change.

What a changed design makes new costs more than the light of a small picture, so a draft keeps
whatever it may: shapes of cages that did not move, contacts where the surface did not move, the
cells of surfaces that did not move, and the photon guide, which stays right for lights that moved
(no direction is left out) and only loses effect. In contacts it takes few camera samples.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from optisense.design import SensorDesign
from optisense.geometry import Contact, SensingSurface, TriangleMesh
from optisense.geometry.indenters import FACET_ERROR
from optisense.optics.emitters import EmitterTable
from optisense.optics.field_store import CELL_SIZE, FieldStore
from optisense.optics.model import OpticalModel
from optisense.optics.ray_scene import Piece, RayScene
from optisense.optics.surfaces import SurfaceKind

COARSER = 3.0
"""How much larger the cells of a draft are along a side. Of as few photons as a draft has, wider
cells make a picture that is nearer to the whole one (9 % instead of 14 % with cells half as wide),
and a smoothing costs a small part."""


class DraftStore(FieldStore):
    """Light fields in coarse cells, which takes over what it may from the store before it."""

    cell_size = COARSER * CELL_SIZE
    least_passes = 1

    def __init__(
        self,
        scene: RayScene,
        opaque: list[Piece],
        table: EmitterTable,
        seen: NDArray[np.floating],
        coloured: bool,
        metallic: bool,
        before: DraftStore | None,
    ) -> None:
        """As of `FieldStore`; `before` is the store of the design before, if there is one."""
        super().__init__(scene, opaque, table, seen, coloured, metallic)
        if before is None or not _same_shapes(opaque, before._opaque):
            return
        if table.groups == before._table.groups:
            self._kernels = before._kernels
        if table.count == before._table.count:
            self._guide = before._guide


class DraftModel(OpticalModel):
    """An `OpticalModel` for drafts: the same picture, a little blurred, several times sooner where
    designs differ by little.
    """

    is_draft = True
    facet_error = 10 * FACET_ERROR  # still far below a pixel; normals are those of the exact shape

    def __init__(self, design: SensorDesign, variant: str = "auto") -> None:
        """As of `OpticalModel`."""
        self._rest: dict[str, TriangleMesh] = {}
        self._bent: dict[str, TriangleMesh] = {}
        self._before: DraftStore | None = None
        self._seen: NDArray[np.floating] | None = None
        self._placed: dict[Contact, TriangleMesh] = {}
        self._placed_on: SensingSurface | None = None
        super().__init__(self._straightened(design), variant)

    def become(self, design: SensorDesign) -> None:
        """As of `OpticalModel`."""
        straight, old = self._straightened(design), self.design
        self._before = self.__dict__.get("_store", self._before)
        kept = {name: self.__dict__.get(name) for name in ("surface", "_fixed")}
        super().become(straight)
        if not _all_but_lights_same(old, straight):
            self._seen = None
            return
        for name, value in kept.items():  # what the camera sees does not depend on the lights
            if value is not None:
                setattr(self, name, value)

    def place(self, contact: Contact) -> TriangleMesh:
        """As of `OpticalModel`."""
        if self._placed_on is not self.surface:
            self._placed, self._placed_on = {}, self.surface
        if contact not in self._placed:
            self._placed[contact] = super().place(contact)
        return self._placed[contact]

    @cached_property
    def _store(self) -> FieldStore:
        if self._seen is None:
            rays = self.chief_rays((96, 72))
            self._seen = rays.points[rays.hit]
        return DraftStore(
            self.scene,
            [piece for piece in self._pieces if piece.surface.kind is SurfaceKind.OPAQUE],
            self._emitter_table,
            self._seen,
            self._coloured,
            self._metallic,
            self._before,
        )

    def _straightened(self, design: SensorDesign) -> SensorDesign:
        """The same sensor without cages: its meshes as they are bent, the same objects as before
        where nothing moved, by which a model knows what it need not build again.
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
    """Whether designs without cages have the same shapes, materials and camera."""
    return (
        one.meshes == other.meshes  # the same objects
        and (one.parts, one.materials, one.camera) == (other.parts, other.materials, other.camera)
    )


def _same_shapes(one: list[Piece], other: list[Piece]) -> bool:
    return len(one) == len(other) and all(
        a is b or (np.array_equal(a.vertices, b.vertices) and np.array_equal(a.faces, b.faces))
        for a, b in zip(one, other, strict=True)
    )

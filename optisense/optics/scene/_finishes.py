"""Frosted and painted faces of transparent solids.

Paint is a sheet that lies on the solid, like the coating. Frost divides interfaces: the part on
frosted faces is rough, and the rest does not change.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Self

from optisense.design import SensorDesign
from optisense.design.arrangement import COINCIDENCE_TOLERANCE
from optisense.design.part_faces import finished_faces
from optisense.errors import DesignError
from optisense.geometry import TriangleMesh
from optisense.geometry.coincidence import cut, find_coincident
from optisense.geometry.mesh_points import Anchors, anchored
from optisense.optics.scene._solids import Interface, Sheet, Solid
from optisense.optics.scene.media import same_faces


@dataclass(frozen=True)
class Frost:
    """Faces of a solid with a roughness of their own.

    Attributes:
        name: name of the part and of its faces.
        solid: name of the part.
        mesh: the faces, mm.
        roughness: GGX alpha.
    """

    name: str
    solid: str
    mesh: TriangleMesh
    roughness: float


@dataclass(frozen=True)
class Paint:
    """Opaque paint on faces of a solid.

    Attributes:
        sheet: the paint; its normals point into the solid.
        solid: name of the part.
        material: name of the paint's material in the design.
    """

    sheet: Sheet
    solid: str
    material: str


@dataclass(frozen=True)
class Cutting:
    """Meshes that were cut out of another one.

    Attributes:
        inputs: what they were made from; meshes are recognised by identity.
        name: name of the cutting, by which it is recognised after its mesh has bent.
        whole: the mesh that was cut.
        pieces: the meshes cut out of it.
        source: the cutting of the mesh before it bent; None if these pieces were cut.
    """

    inputs: tuple[Any, ...]
    name: tuple[Any, ...]
    whole: TriangleMesh
    pieces: list[TriangleMesh]
    source: Cutting | None = None

    @cached_property
    def anchors(self) -> list[Anchors] | None:
        """The places of the pieces' vertices on ``whole``; None if they are not all on it."""
        found = [anchored(each.vertices, self.whole, COINCIDENCE_TOLERANCE) for each in self.pieces]
        on = [anchors for anchors, where in found if where.all()]
        return on if len(on) == len(found) else None

    def moved(self, inputs: tuple[Any, ...], whole: TriangleMesh) -> Cutting | None:
        """Return the cutting after its mesh has bent to ``whole``; None if the faces differ."""
        cut = self.source or self
        if not same_faces(cut.whole, whole) or cut.anchors is None:
            return None
        pieces = [
            piece.deformed(anchors.on(whole.vertices))
            for piece, anchors in zip(cut.pieces, cut.anchors, strict=True)
        ]
        return Cutting(inputs, self.name, whole, pieces, cut)


@dataclass
class ShapeCache:
    """Cache of shapes by their inputs; meshes are recognised by identity.

    Attributes:
        before: the cache of a similar design, whose shapes are reused; None if there is none.
        made: the inputs and the result of each shape.
        cut: the meshes that were cut out of others.
        bend: whether those cut out of a mesh that bends are moved along instead of being cut again.
    """

    before: Self | None = None
    made: list[tuple[tuple[Any, ...], Any]] = field(default_factory=list)
    cut: list[Cutting] = field(default_factory=list)
    bend: bool = False

    @property
    def earlier(self) -> Self:
        """The cache of the similar design; an empty one if there is none."""
        return self.before or type(self)()

    def get_or_make(self, key: tuple[Any, ...], make: Callable[[], Any]) -> Any:
        """Return the result of ``make``, or the known one of the same key."""
        known = next((value for old, value in self.earlier.made if old == key), None)
        self.made.append((key, make() if known is None else known))
        return self.made[-1][1]

    def get_or_cut(
        self,
        name: tuple[Any, ...],
        whole: TriangleMesh,
        others: tuple[TriangleMesh, ...],
        make: Callable[[], list[TriangleMesh]],
    ) -> list[TriangleMesh]:
        """Return the pieces of a mesh that ``make`` cuts; those that are known are reused.

        Args:
            name: name of the cutting.
            others: the meshes that divide the whole one.
        """
        inputs, cut = (name, whole, *others), self.earlier.cut
        same = (each for each in cut if each.inputs == inputs)
        known = next((each for each in same if self.bend or each.source is None), None)
        if known is None and self.bend:
            named = (each.moved(inputs, whole) for each in cut if each.name == name)
            known = next((each for each in named if each is not None), None)
        self.cut.append(Cutting(inputs, name, whole, make()) if known is None else known)
        return self.cut[-1].pieces


def finishes_of(
    design: SensorDesign,
    meshes: dict[str, TriangleMesh],
    sheets: Sequence[Sheet],
    shapes: ShapeCache,
) -> tuple[list[Frost], list[Paint]]:
    """Return the frosted and the painted faces of a design.

    Args:
        meshes: the design's parts in their current shape.
        sheets: the opaque parts, which cover paint and frost where they lie on the same faces.

    Raises:
        DesignError: no triangle matches the design's description of the faces, or a sheet covers
            all that do.
    """
    frosts: list[Frost] = []
    paints: list[Paint] = []
    for part, label, finish in (
        (name, label, finish)
        for name, each in design.parts.items()
        for label, finish in (each.faces or {}).items()
    ):
        where = design.where("parts", part, "faces", label)
        name = f"'{label}' of part '{part}'"
        chosen = finished_faces(design.meshes[part], finish, name, where)
        mesh = meshes[part]
        covers = tuple(sheet.mesh for sheet in sheets)
        key = (part, label, chosen.tobytes())

        def bare(mesh: TriangleMesh = mesh, chosen: Any = chosen) -> list[TriangleMesh]:
            return [_uncovered(mesh.with_faces(mesh.faces[chosen]).compacted(), sheets)]

        (patch,) = shapes.get_or_cut(key, mesh, covers, bare)
        if not len(patch.faces):
            raise DesignError(
                f"the coating, or another opaque part, covers all of the faces {name}",
                where=where,
                hint="Name faces of the solid that are bare",
            )
        if finish.paint is None:
            frosts.append(Frost(f"{part}.{label}", part, patch, float(finish.roughness or 0.0)))
            continue
        inward = shapes.get_or_make((patch, "flipped"), patch.flipped)
        paints.append(Paint(Sheet(f"{part}.{label}", inward, "paint"), part, finish.paint))
    return frosts, paints


def _uncovered(patch: TriangleMesh, sheets: Sequence[Sheet]) -> TriangleMesh:
    overlays = [
        find_coincident(patch, sheet.mesh, COINCIDENCE_TOLERANCE, facing=False) for sheet in sheets
    ]
    covered = any(len(overlay.pairs) for overlay in overlays)
    return cut(patch, overlays)[-1] if covered else patch


def frosted(
    interface: Interface,
    frosts: Sequence[Frost],
    solids: Sequence[Solid],
    shapes: ShapeCache,
) -> Iterator[tuple[str, Interface]]:
    """Divide an interface into the parts on frosted faces, and the rest.

    Where a frosted face touches another solid, the rougher of both counts.

    Yields:
        The name of the frost (empty for none) and the part of the interface.
    """
    own = [frost for frost in frosts if frost.solid in interface.names]
    if not own:
        yield "", interface
        return

    def pieces() -> list[TriangleMesh]:
        mesh = interface.mesh
        overlays = [
            find_coincident(mesh, frost.mesh, COINCIDENCE_TOLERANCE, facing=False) for frost in own
        ]
        return cut(mesh, overlays)

    key = (*interface.names, interface.outside, *(frost.name for frost in own))
    patches = tuple(frost.mesh for frost in own)
    *rough, rest = shapes.get_or_cut(key, interface.mesh, patches, pieces)
    for frost, mesh in zip(own, rough, strict=True):
        others = [
            s.roughness for s in solids if s.name in interface.names and s.name != frost.solid
        ]
        if len(mesh.faces):
            roughness = max([frost.roughness, *others])
            yield frost.name, replace(interface, mesh=mesh, roughness=roughness)
    if len(rest.faces):
        yield (
            "",
            interface
            if len(rest.faces) == len(interface.mesh.faces)
            else replace(interface, mesh=rest),
        )

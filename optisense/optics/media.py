"""Which optical medium lies on either side of each face of touching, nested solids.

A user brings closed solids (gel, acrylic, a film of air) that touch, nest or overlap; a renderer
needs each boundary once, with the medium before and behind it. The way there:

1. Where solids overlap, the one of higher priority keeps the place and is cut out of the other
   (the priorities of Schmidt and Budge, "Simple nested dielectrics in ray traced images",
   J. Graphics Tools 7, 2002, but resolved in the geometry, and with the larger number winning).
2. Solids are now disjoint: behind a face lies its own medium, before it the solid whose face
   lies against it, or else air. Faces are cut along those contacts.
3. Faces under an opaque sheet go, faces between equal refractive indices go.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np

from optisense.errors import DesignError, MeshError
from optisense.geometry.coincidence import Overlay, boxes_overlap, cut, find_coincident
from optisense.geometry.mesh import TriangleMesh

COINCIDENCE_TOLERANCE = 0.002
"""Faces closer than this (mm) touch; overlaps thinner than this are contacts. A gap that is
meant (a film of air) must be wider."""

CUT_CLEARANCE = 2e-5
"""A solid is cut out with this much room (mm): more than rounding, far less than a contact."""

EQUAL_INDEX = 1e-6
"""Refractive indices that differ by less bend no light."""

AIR = "air"


@dataclass(frozen=True)
class Solid:
    """A closed transparent part.

    Attributes:
        name: the part's name, for messages.
        mesh: closed, mm.
        medium: the name of its optical material.
        ior: its refractive index.
        roughness: of its surface (microfacet alpha), 0 for smooth.
        priority: where solids overlap, the larger number keeps the place.
    """

    name: str
    mesh: TriangleMesh
    medium: str
    ior: float
    roughness: float = 0.0
    priority: int = 0


@dataclass(frozen=True)
class Sheet:
    """An opaque surface (a coating, a mirror, the skin of a blocker), which may lie on solids.

    Attributes:
        name: the part's name.
        mesh: open or closed, mm.
        kind: what it is, for messages.
    """

    name: str
    mesh: TriangleMesh
    kind: str = "coating"


@dataclass(frozen=True)
class Interface:
    """A refracting surface between two media.

    Attributes:
        mesh: open or closed, mm; its normals point from `inside` to `outside`.
        inside, outside: names of the media; "air" where there is no solid.
        ior_inside, ior_outside: their refractive indices.
        roughness: microfacet alpha: the rougher one of the two solids that touch.
        names: the solids that it bounds, the one on its inside first.
    """

    mesh: TriangleMesh
    inside: str
    outside: str
    ior_inside: float
    ior_outside: float
    roughness: float
    names: tuple[str, ...]


def resolve_media(
    solids: Sequence[Solid],
    sheets: Sequence[Sheet] = (),
    tolerance: float = COINCIDENCE_TOLERANCE,
) -> list[Interface]:
    """Find every refracting boundary of a set of solids in air.

    Args:
        solids: closed parts; they may touch with any tessellation, nest and overlap.
        sheets: opaque surfaces; solid faces that lie on one are left out.
        tolerance: mm; faces closer than this touch.

    Returns:
        One interface a pair of touching solids and one for what of each solid meets the air,
        save between equal refractive indices.

    Raises:
        MeshError: a mesh is not closed or cuts through itself.
        DesignError: solids of different index overlap and have the same priority.
    """
    return Media(solids, sheets, tolerance).interfaces


class Media:
    """The resolved boundaries of solids and sheets, which knows whether others give the same.

    Attributes:
        interfaces: as `resolve_media` returns them.
    """

    def __init__(
        self,
        solids: Sequence[Solid],
        sheets: Sequence[Sheet] = (),
        tolerance: float = COINCIDENCE_TOLERANCE,
    ) -> None:
        """Resolve; arguments and errors are those of `resolve_media`."""
        self._solids = list(solids)
        self._tolerance = tolerance
        closed = [replace(s, mesh=s.mesh.validate(s.name, closed=True)) for s in solids]
        self._parted = _disjoint(closed, tolerance)
        self._lying: list[Sheet] = []
        self._loose: list[Sheet] = []
        interfaces = self._resolve(list(sheets))
        self.interfaces = [face for face in interfaces if _refracts(face)]

    def _resolve(self, sheets: list[Sheet]) -> list[Interface]:
        solids, tolerance = self._parted, self._tolerance
        contacts = _contacts(solids, tolerance)
        interfaces = []
        lying = np.zeros(len(sheets), dtype=bool)
        for i, solid in enumerate(solids):
            overlays = [
                find_coincident(solid.mesh, sheet.mesh, tolerance, facing=False) for sheet in sheets
            ]
            lying |= np.array([len(overlay.pairs) > 0 for overlay in overlays], dtype=bool)
            partners = [j for j in range(len(solids)) if (i, j) in contacts]
            overlays += [contacts[i, j] for j in partners]
            pieces = cut(solid.mesh, overlays)[len(sheets) :]
            neighbours = [solids[j] if j > i else None for j in partners]
            for piece, neighbour in zip(pieces[:-1], neighbours, strict=True):
                if neighbour is not None:  # each contact once, from the solid that comes first
                    interfaces.append(_interface(piece, solid, neighbour))
            interfaces.append(_interface(pieces[-1], solid, None))
        self._lying = [sheet for sheet, lies in zip(sheets, lying, strict=True) if lies]
        self._loose = [sheet for sheet, lies in zip(sheets, lying, strict=True) if not lies]
        return interfaces

    def holds_for(self, solids: Sequence[Solid], sheets: Sequence[Sheet]) -> bool:
        """Whether these have the same interfaces, as far as can be told without resolving them.

        So it is with the very same solids, when all sheets that lie on one are the same and
        any others (a mirror in the open, say) touch none.
        """
        if list(solids) != self._solids:
            return False
        others = [sheet for sheet in sheets if sheet not in self._lying]
        if len(others) + len(self._lying) != len(sheets):
            return False
        return not any(
            len(find_coincident(solid.mesh, sheet.mesh, self._tolerance, facing=False).pairs)
            for sheet in others
            if sheet not in self._loose
            for solid in self._parted
        )


def _interface(mesh: TriangleMesh, solid: Solid, neighbour: Solid | None) -> Interface:
    if neighbour is None:
        return Interface(mesh, solid.medium, AIR, solid.ior, 1.0, solid.roughness, (solid.name,))
    return Interface(
        mesh,
        solid.medium,
        neighbour.medium,
        solid.ior,
        neighbour.ior,
        max(solid.roughness, neighbour.roughness),
        (solid.name, neighbour.name),
    )


def _refracts(interface: Interface) -> bool:
    step = abs(interface.ior_inside - interface.ior_outside)
    return len(interface.mesh.faces) > 0 and step > EQUAL_INDEX


def _contacts(solids: list[Solid], tolerance: float) -> dict[tuple[int, int], Overlay]:
    """Faces that lie against each other, both ways round."""
    contacts = {}
    for i, j in combinations(range(len(solids)), 2):
        overlay = find_coincident(solids[i].mesh, solids[j].mesh, tolerance, facing=True)
        if len(overlay.pairs):
            contacts[i, j] = overlay
            contacts[j, i] = overlay.reversed()
    return contacts


def _disjoint(solids: list[Solid], tolerance: float) -> list[Solid]:
    """Cut each solid out of those of lower priority that it overlaps; highest priority first."""
    result = sorted(solids, key=lambda solid: -solid.priority)
    for i, j in combinations(range(len(solids)), 2):
        if not boxes_overlap(result[i].mesh, result[j].mesh, tolerance):
            continue
        # Where faces lie on one another a cut takes ten times as long; a little room parts them.
        smaller = _manifold(_grown(result[j], -CUT_CLEARANCE))
        place = _overlap_place(_manifold(result[i]) ^ smaller, tolerance - CUT_CLEARANCE)
        if place is None:
            continue
        same_index = abs(result[i].ior - result[j].ior) <= EQUAL_INDEX
        if result[i].priority == result[j].priority and not same_index:
            raise DesignError(
                f"parts '{result[i].name}' and '{result[j].name}' overlap and have the same "
                f"priority {result[i].priority}",
                where="near ({:.3f}, {:.3f}, {:.3f}) mm".format(*place),
                hint="move them apart, or give the part that fills the common space the "
                "larger priority",
            )
        larger = _manifold(_grown(result[i], CUT_CLEARANCE))
        result[j] = replace(result[j], mesh=_from_manifold(_manifold(result[j]) - larger))
    return [solid for solid in result if len(solid.mesh.faces)]


def _grown(solid: Solid, room: float) -> Solid:
    """Larger by so many mm all round, so that faces in one plane up to rounding are cut cleanly."""
    mesh = solid.mesh.welded()
    normal = mesh.face_normals
    sums, rights = np.zeros((len(mesh.vertices), 3, 3)), np.zeros((len(mesh.vertices), 3))
    for corner in mesh.faces.T:  # each vertex moves by the same step off all of its faces
        np.add.at(sums, corner, normal[:, :, None] * normal[:, None])
        np.add.at(rights, corner, normal)
    step = np.linalg.solve(sums + 1e-3 * np.eye(3), rights[:, :, None])[:, :, 0]
    step /= np.maximum(1.0, np.linalg.norm(step, axis=1, keepdims=True) / 3.0)
    return replace(solid, mesh=mesh.with_vertices(mesh.vertices + room * step))


def _overlap_place(common: Any, tolerance: float) -> tuple[float, ...] | None:
    """The middle of a common volume, or None when it is nowhere thicker than a contact."""
    for part in common.decompose():
        if 2.0 * part.volume() > tolerance * part.surface_area():
            box = part.bounding_box()
            return tuple(0.5 * (box[k] + box[k + 3]) for k in range(3))
    return None


def _manifold(solid: Solid) -> Any:
    import manifold3d

    welded = solid.mesh.welded()
    mesh = manifold3d.Mesh64(welded.vertices, welded.faces.astype(np.uint64))
    result = manifold3d.Manifold(mesh)
    if result.status() != manifold3d.Error.NoError:
        raise MeshError(
            f"the solid is not a clean volume ({result.status().name}) and overlaps another part",
            where=f"part {solid.name}",
            hint="repair it in your modelling program: no edge with more than two faces",
        )
    return result


def _from_manifold(solid: Any) -> TriangleMesh:
    mesh = solid.to_mesh64()
    return TriangleMesh(np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts))

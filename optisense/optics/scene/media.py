"""The optical media on both sides of each face of touching, nested solids.

A design has closed solids (gel, acrylic, a film of air) that touch, nest or overlap; a renderer
needs each boundary once, with the media in front of and behind it. The boundaries are resolved in
three steps:

1. Where solids overlap, the one of higher priority keeps the place and is cut out of the other
   (the priorities of Schmidt and Budge, "Simple nested dielectrics in ray traced images",
   J. Graphics Tools 7, 2002, but resolved in the geometry, and with the larger number winning).
2. Solids are now disjoint: behind a face lies its own medium, before it the solid whose face
   lies against it, or else air. Faces are cut along those contacts.
3. Faces under an opaque sheet go, faces between equal refractive indices go.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optisense.design.arrangement import COINCIDENCE_TOLERANCE, EQUAL_INDEX
from optisense.errors import DesignError, MeshError
from optisense.geometry.coincidence import Overlay, boxes_overlap, cut, find_coincident
from optisense.geometry.connected import connected_components
from optisense.geometry.mesh import TriangleMesh
from optisense.geometry.mesh_points import Anchors, anchored
from optisense.geometry.shading_normals import is_flat, shaded
from optisense.geometry.solids import as_manifold, cut_out, thick_place
from optisense.optics.scene._solids import AROUND, Interface, Sheet, Solid

CUT_CLEARANCE = 2e-5
"""Clearance (mm) with which a solid is cut out of another: more than the rounding of coordinates in
single precision (some 2e-6 mm at 30 mm), and a hundredth of `COINCIDENCE_TOLERANCE`."""

BENT_TOLERANCE = 0.02
"""Largest distance (mm) by which touching surfaces may separate while they bend. Triangles of two
tessellations of one shape differ by less, and the thinnest film that a design holds is as thick."""

UNMOVED_TOLERANCE = 1e-6
"""Largest displacement (mm) of a vertex that counts as unmoved: rounding of coordinates in single
precision (some 2e-6 mm at 30 mm), which rays do not resolve either."""


class Bending:
    """The positions of interfaces and sheets relative to the solids that they lie on."""

    def __init__(
        self, solids: Sequence[Solid], sheets: Sequence[Sheet], faces: Sequence[Interface]
    ) -> None:
        """Record the positions for resolved media, before any solid bends."""
        self._solids = {solid.name: solid for solid in solids}
        self._sheets = {sheet.name: sheet for sheet in sheets}
        self._faces = list(faces)
        self._found: dict[tuple[int, str], tuple[Anchors, NDArray[np.bool_]]] = {}

    def bent(self, solids: Sequence[Solid], sheets: Sequence[Sheet]) -> list[Interface] | None:
        """Return the interfaces of solids that have bent; see `Media.bend`."""
        new = {solid.name: solid for solid in solids}
        skins = {sheet.name: sheet for sheet in sheets}
        if list(new) != list(self._solids) or skins.keys() != self._sheets.keys():
            return None
        solid_pairs = [(new[name], old) for name, old in self._solids.items()]
        meshes = [(solid.mesh, old.mesh) for solid, old in solid_pairs]
        meshes += [(skins[name].mesh, old.mesh) for name, old in self._sheets.items()]
        alike = all(replace(solid, mesh=old.mesh) == old for solid, old in solid_pairs)
        if not alike or not all(same_faces(one, other) for one, other in meshes):
            return None
        for name, sheet in self._sheets.items():
            for solid in solids:
                anchors, found = self._anchors(sheet.mesh, solid.name)
                off = anchors.on(solid.mesh.vertices) - skins[name].mesh.vertices
                if np.abs(off[found]).max(initial=0.0) > BENT_TOLERANCE:
                    return None
        return self._moved(new)

    def _moved(self, new: dict[str, Solid]) -> list[Interface] | None:
        result = []
        for face in self._faces:
            places = []
            for name in face.names:
                if new[name].mesh is self._solids[name].mesh:
                    places.append(face.mesh.vertices)
                    continue
                anchors, found = self._anchors(face.mesh, name)
                if not found.all():
                    return None
                places.append(anchors.on(new[name].mesh.vertices))
            if np.abs(places[0] - places[-1]).max(initial=0.0) > BENT_TOLERANCE:
                return None
            if np.abs(places[0] - face.mesh.vertices).max(initial=0.0) <= UNMOVED_TOLERANCE:
                result.append(face)  # the same mesh, with its cached properties
            else:
                result.append(replace(face, mesh=face.mesh.deformed(places[0])))
        return result

    def _anchors(self, mesh: TriangleMesh, solid: str) -> tuple[Anchors, NDArray[np.bool_]]:
        key = id(mesh), solid
        if key not in self._found:
            self._found[key] = anchored(
                mesh.vertices, self._solids[solid].mesh, COINCIDENCE_TOLERANCE
            )
        return self._found[key]


class Media:
    """The resolved boundaries of solids and sheets.

    Attributes:
        interfaces: one interface for each pair of touching solids, and one for the part of each
            solid that borders on air; none between equal refractive indices.
        bent: whether the interfaces were moved along with solids that bend; see `bend`.
    """

    def __init__(self, solids: Sequence[Solid], sheets: Sequence[Sheet] = ()) -> None:
        """Find every refracting boundary of a set of solids in air.

        Args:
            solids: closed parts; they may touch with any tessellation, nest and overlap.
            sheets: opaque surfaces; solid faces that lie on one are left out.

        Raises:
            MeshError: a mesh is not closed or cuts through itself.
            DesignError: solids of different index overlap and have the same priority.
        """
        self._solids = list(solids)
        closed = [replace(s, mesh=_whole(s.mesh.validate(s.name, closed=True))) for s in solids]
        self._parted = _disjoint(closed)
        self._lying: list[Sheet] = []
        self._loose: list[Sheet] = []
        self._faces = self._resolve(list(sheets))
        self.interfaces = [face for face in self._faces if _refracts(face)]
        self.bent = False
        self._bending: Bending | None = None

    def _resolve(self, sheets: list[Sheet]) -> list[Interface]:
        solids = self._parted
        contacts = _contacts(solids)
        interfaces = []
        lying = np.zeros(len(sheets), dtype=bool)
        for i, solid in enumerate(solids):
            overlays = [
                find_coincident(solid.mesh, sheet.mesh, COINCIDENCE_TOLERANCE, facing=False)
                for sheet in sheets
            ]
            lying |= np.array([len(overlay.pairs) > 0 for overlay in overlays], dtype=bool)
            partners = [j for j in range(len(solids)) if (i, j) in contacts]
            overlays += [contacts[i, j] for j in partners]
            pieces = cut(solid.mesh, overlays)[len(sheets) :]
            neighbours = [solids[j] if j > i else None for j in partners]
            for piece, neighbour in zip(pieces[:-1], neighbours, strict=True):
                if neighbour is not None:  # each contact once, from its first solid
                    interfaces.append(_interface(piece, solid, neighbour))
            interfaces.append(_interface(pieces[-1], solid, None))
        self._lying = [sheet for sheet, lies in zip(sheets, lying, strict=True) if lies]
        self._loose = [sheet for sheet, lies in zip(sheets, lying, strict=True) if not lies]
        return interfaces

    @property
    def names(self) -> list[str]:
        """The names of the solids, in the order in which they were given."""
        return [solid.name for solid in self._solids]

    @property
    def joined(self) -> list[list[str]]:
        """The names of touching solids of equal media, which light passes between without noticing;
        sorted within each group of solids.
        """
        names = self.names
        pairs = [
            [names.index(name) for name in face.names]
            for face in self._faces
            if len(face.names) == 2 and len(face.mesh.faces) > 0 and not _refracts(face)
        ]
        one, other = np.array(pairs, dtype=np.int64).reshape(-1, 2).T
        groups = connected_components(len(names), one, other)
        members = [np.flatnonzero(groups == group) for group in np.unique(groups[one])]
        return [sorted(names[solid] for solid in each) for each in members]

    def holds_for(self, solids: Sequence[Solid], sheets: Sequence[Sheet]) -> bool:
        """Return whether other solids and sheets certainly have the same interfaces.

        This is the case if the solids are the same objects, the sheets that lie on a solid are the
        same, and any other sheets (such as a mirror in air) touch no solid. It is decided without
        resolving the media.
        """
        if self.bent or list(solids) != self._solids:
            return False
        others = [sheet for sheet in sheets if sheet not in self._lying]
        if len(others) + len(self._lying) != len(sheets):
            return False
        return not any(
            len(find_coincident(solid.mesh, sheet.mesh, COINCIDENCE_TOLERANCE, facing=False).pairs)
            for sheet in others
            if sheet not in self._loose
            for solid in self._parted
        )

    def bend(self, solids: Sequence[Solid], sheets: Sequence[Sheet]) -> Media | None:
        """Return the same boundaries on solids that have bent, each moved along with its faces.

        New contacts or overlaps between solids are not detected. The result is None if anything but
        positions has changed, or if touching surfaces have separated.
        """
        if self._bending is None:
            self._bending = Bending(self._solids, [*self._lying, *self._loose], self._faces)
        faces = self._bending.bent(solids, sheets)
        if faces is None:
            return None
        result = copy(self)
        lying = {sheet.name for sheet in self._lying}
        result._solids = list(solids)
        result._lying = [sheet for sheet in sheets if sheet.name in lying]
        result._loose = [sheet for sheet in sheets if sheet.name not in lying]
        result._faces = faces
        result.interfaces = [face for face in faces if _refracts(face)]
        result.bent = True
        return result


def _whole(mesh: TriangleMesh) -> TriangleMesh:
    """Return a mesh whose vertices are welded if it has no normals and flat facets only: split
    vertices then say nothing about the edges between these.
    """
    welded = mesh.welded()
    is_split = len(welded.vertices) < len(mesh.vertices) and (mesh.rest or mesh).normals is None
    return welded if is_split and is_flat(shaded(mesh)) else mesh


def _interface(mesh: TriangleMesh, solid: Solid, neighbour: Solid | None) -> Interface:
    names: tuple[str, ...] = (solid.name,)
    other, roughness = AROUND, solid.roughness
    if neighbour is not None:
        names, other = (solid.name, neighbour.name), neighbour
        roughness = max(solid.roughness, neighbour.roughness)
    etas = None
    if solid.indices is not None or other.indices is not None:
        red, green, blue = (solid.index(k) / other.index(k) for k in range(3))
        etas = red, green, blue
    return Interface(
        mesh,
        solid.medium,
        other.medium,
        solid.ior,
        other.ior,
        roughness,
        names,
        etas,
        (solid.absorption, other.absorption),
    )


def same_faces(one: TriangleMesh, other: TriangleMesh) -> bool:
    """Return whether meshes have the same triangles, wherever their vertices are."""
    return one is other or (
        len(one.vertices) == len(other.vertices) and np.array_equal(one.faces, other.faces)
    )


def _refracts(interface: Interface) -> bool:
    """Return whether the index or the absorption changes at an interface."""
    step = abs(interface.ior_inside - interface.ior_outside)
    if interface.etas is not None:
        step = max(step, *(abs(eta - 1.0) for eta in interface.etas))
    differs = step > EQUAL_INDEX or interface.absorption[0] != interface.absorption[1]
    return len(interface.mesh.faces) > 0 and differs


def _contacts(solids: list[Solid]) -> dict[tuple[int, int], Overlay]:
    """Return the faces of each solid that lie against another one, for both orders of each pair."""
    contacts = {}
    for i, j in combinations(range(len(solids)), 2):
        overlay = find_coincident(
            solids[i].mesh, solids[j].mesh, COINCIDENCE_TOLERANCE, facing=True
        )
        if len(overlay.pairs):
            contacts[i, j] = overlay
            contacts[j, i] = overlay.reversed()
    return contacts


def _disjoint(solids: list[Solid]) -> list[Solid]:
    """Cut each solid out of those of lower priority that it overlaps; highest priority first."""
    result = sorted(solids, key=lambda solid: -solid.priority)
    for i, j in combinations(range(len(solids)), 2):
        if not boxes_overlap(result[i].mesh, result[j].mesh, COINCIDENCE_TOLERANCE):
            continue
        # A cut along coincident faces takes ten times as long; a small clearance separates them.
        smaller = _manifold(_grown(result[j], -CUT_CLEARANCE))
        place = thick_place(_manifold(result[i]) ^ smaller, COINCIDENCE_TOLERANCE - CUT_CLEARANCE)
        if place is None:
            continue
        same_index = _alike(result[i], result[j])
        if result[i].priority == result[j].priority and not same_index:
            raise DesignError(
                f"parts '{result[i].name}' and '{result[j].name}' overlap and have the same "
                f"priority {result[i].priority}",
                where="near ({:.3f}, {:.3f}, {:.3f}) mm".format(*place),
                hint="move them apart, or give the part that fills the common space the "
                "larger priority",
            )
        larger = _grown(result[i], CUT_CLEARANCE)
        result[j] = replace(result[j], mesh=cut_out(result[j].mesh, larger.mesh))
    return [solid for solid in result if len(solid.mesh.faces)]


def _alike(one: Solid, other: Solid) -> bool:
    """Return whether two media are optically equal."""
    same_index = all(abs(one.index(k) - other.index(k)) <= EQUAL_INDEX for k in range(3))
    return same_index and one.absorption == other.absorption


def _grown(solid: Solid, room: float) -> Solid:
    """Return a solid grown by ``room`` (mm), by which nearly coplanar faces are cut cleanly."""
    mesh = solid.mesh.welded()
    normal = mesh.face_normals
    sums, rights = np.zeros((len(mesh.vertices), 3, 3)), np.zeros((len(mesh.vertices), 3))
    for corner in mesh.faces.T:  # each vertex moves by the same distance off all of its faces
        np.add.at(sums, corner, normal[:, :, None] * normal[:, None])
        np.add.at(rights, corner, normal)
    step = np.linalg.solve(sums + 1e-3 * np.eye(3), rights[:, :, None])[:, :, 0]
    step /= np.maximum(1.0, np.linalg.norm(step, axis=1, keepdims=True) / 3.0)
    return replace(solid, mesh=mesh.with_vertices(mesh.vertices + room * step))


def _manifold(solid: Solid) -> Any:
    import manifold3d

    result = as_manifold(solid.mesh)
    if result.status() != manifold3d.Error.NoError:
        raise MeshError(
            f"the solid is not a clean volume ({result.status().name}) and overlaps another part",
            where=f"part {solid.name}",
            hint="repair it in your modelling program: no edge with more than two faces",
        )
    return result

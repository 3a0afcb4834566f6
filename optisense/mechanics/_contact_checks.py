"""Checks for contacts that are impossible on an elastic skin: overlapping indenters, holes in an
indenter where it touches, and gels that no part of the design holds.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from optisense.array_types import FloatArray
from optisense.design import SensorDesign
from optisense.design.parts import Role
from optisense.errors import ContactError
from optisense.geometry import TriangleMesh
from optisense.geometry.coincidence import boxes_overlap, find_coincident
from optisense.geometry.mesh_points import spread_points
from optisense.geometry.overlaps import find_overlap, touching_vertices
from optisense.geometry.rays import GLUE, exits, ray_hits
from optisense.mechanics._footprint import Footprint

SHALLOWEST = 1e-3
"""Depth (mm) of skin inside both of two indenters above which they count as overlapping: some
facet errors of indenters (4e-4 mm), as smaller depths may be due to them."""

ALONG_AN_EDGE = (0.1, 0.3, 0.5, 0.7, 0.9)
"""Places along the part of an open edge inside the gel, as shares of its length, at which it is
tested for whether it touches the skin: the middles of five equal parts."""


FILM = 2.0 * GLUE
"""Length (mm) of a line between the back of a gel and the part that holds it, up to which it counts
as held: that of the thickest film of glue, if the line is inclined by up to 60 degrees to it."""

BACK_LINES = 30
"""Number of lines from the skin to the back of the gel, to see whether most of it is held; they
take less than 0.1 s."""


def refuse_shared_skin(one: Footprint, other: Footprint) -> None:
    """Raise ContactError if a piece of the undeformed skin lies inside two indenters."""
    x, y = np.meshgrid(one.x, one.y)
    inside = one.overlap > SHALLOWEST
    flat = np.column_stack([x[inside], y[inside], np.zeros(int(inside.sum()))])
    there = other.local(one.origin + flat @ one.axes.T)
    near = np.abs(there[:, 2]) < min(one.thickness, other.thickness)
    if (_overlap_at(other, there[near]) > SHALLOWEST).any():
        raise ContactError(
            "two contacts overlap: their indenters lie inside each other where they touch the skin",
            where="at ({:.2f}, {:.2f}, {:.2f}) and ({:.2f}, {:.2f}, {:.2f}) mm".format(
                *other.origin, *one.origin
            ),
            hint="Move them apart, or join them to one mesh",
        )


def refuse_holes(place: Footprint, indenter: TriangleMesh) -> None:
    """Raise ContactError if an indenter's placed mesh (mm) has an open edge inside the skin."""
    whole = indenter.welded()
    corners = place.local(whole.vertices)[whole.open_edges]
    height = corners[:, :, 2] + SHALLOWEST
    corners, height = corners[height.min(axis=1) < 0.0], height[height.min(axis=1) < 0.0]
    # Of an edge that crosses the skin, the part inside the gel is tested.
    lower, edge = np.argmin(height, axis=1), np.arange(len(corners))
    low, high = height[edge, lower], height[edge, 1 - lower]
    inside = np.divide(-low, high - low, out=np.ones_like(low), where=high > 0.0)
    start = corners[edge, lower]
    way = inside[:, None] * (corners[edge, 1 - lower] - start)
    touching = np.zeros(len(corners), dtype=bool)
    for share in ALONG_AN_EDGE:
        touching |= _overlap_at(place, start + share * way) > SHALLOWEST
    if touching.any():
        raise ContactError(
            f"an indenter has a hole where it touches the skin: {int(touching.sum())} edges there "
            "have one face only",
            where="at ({:.2f}, {:.2f}, {:.2f}) mm".format(*place.origin),
            hint="Close the mesh; it may be open only above the skin",
        )


def _overlap_at(place: Footprint, local: FloatArray) -> FloatArray:
    """Return the greatest overlap (n,), mm, at grid points around points of a contact's frame."""
    column = np.floor((local[:, 0] - place.x[0]) / place.pitch).astype(np.int64)
    row = np.floor((local[:, 1] - place.y[0]) / place.pitch).astype(np.int64)
    rows, columns = place.overlap.shape
    inside = (column >= 0) & (column < columns - 1) & (row >= 0) & (row < rows - 1)
    found = np.full(len(local), -np.inf)
    some = row[inside], column[inside]
    found[inside] = np.max(
        [place.overlap[some[0] + up, some[1] + right] for up in (0, 1) for right in (0, 1)], axis=0
    )
    return found


def is_attached(design: SensorDesign) -> bool:
    """Return whether any part of a design other than the skin touches its gel."""
    gels, others = _gels_and_others(design, design.deformed_meshes())
    return any(_hold_each_other(gel, other) for gel in gels for other in others)


def is_hollow(design: SensorDesign) -> bool:
    """Return whether no rigid part lies at the back of the gel under most of the skin of a design,
    as in a hollow dome that is held at its rim only. Refracting sheets count as rigid, as they may
    be faces of thick windows.
    """
    meshes = design.deformed_meshes()
    gels, others = _gels_and_others(design, meshes)
    skins = [meshes[name] for name in design.parts_of(Role.SENSING_SURFACE)]
    if not gels or not skins:
        return False
    skin = TriangleMesh.joined(skins)
    faces, starts = spread_points(skin, BACK_LINES)
    ways = skin.face_normals[faces]
    nearest = np.full(len(faces), np.inf)
    for other in others:
        hits = ray_hits(other, starts, ways)
        np.minimum.at(nearest, hits.ray, hits.distance)
    free = nearest > exits(gels, starts, ways) + FILM
    return bool(np.count_nonzero(free) > BACK_LINES / 2)


def _gels_and_others(
    design: SensorDesign, meshes: dict[str, TriangleMesh]
) -> tuple[list[TriangleMesh], list[TriangleMesh]]:
    """Return the gels of a design among its meshes, and the parts that may hold them, mm."""
    gels = [meshes[name] for name in design.parts_of(Role.ELASTOMER)]
    others = [
        meshes[name]
        for name, part in design.parts.items()
        if part.role not in (Role.ELASTOMER, Role.SENSING_SURFACE, Role.INDENTER)
    ]
    return gels, others


def refuse_loose_gel(design: SensorDesign) -> None:
    """Raise if a design has a gel that no part holds.

    Raises:
        ContactError: nothing touches the gel but the skin.
    """
    names = design.parts_of(Role.ELASTOMER)
    if names and not is_attached(design):
        raise ContactError(
            f"the gel ('{names[0]}') is attached to nothing: no part touches it but the skin, so "
            "it resists no press",
            where=design.where("parts", names[0]),
            hint=f"Add a support that lies on its far side, to {GLUE:g} mm, or take the conforming "
            "skin (--skin conforming)",
        )


@lru_cache(maxsize=64)
def _hold_each_other(gel: TriangleMesh, other: TriangleMesh) -> bool:
    if not boxes_overlap(gel, other, -GLUE):
        return False
    return (
        len(find_coincident(gel, other, GLUE, facing=False).pairs) > 0
        or len(touching_vertices(gel, other)) > 0
        or len(touching_vertices(other, gel)) > 0
        or find_overlap(gel, other) is not None
    )

"""Moulds in which gels are cast: the gel's negative in two halves, with a sprue and a vent.

The front half shapes the skin and is pulled off along the way that the skin looks; the back half
closes it. They part where the gel is widest, which on most gels is their flat back, so that the
line of the parting is not on the skin.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optisense.design import Role
from optisense.errors import DesignError
from optisense.geometry import TriangleMesh
from optisense.geometry.common_space import as_manifold
from optisense.workshop.shapes import Shape

WALL = 8.0
"""mm of material around the gel: stiff when printed, and room for the pins."""

PIN, PIN_HEIGHT = 3.0, 3.0
"""mm, diameter and height of the pins that hold the halves in place; printers make them round."""

CLEARANCE = 0.15
"""mm between a pin and its hole on each side, which printed parts need to slide."""

SPRUE, FUNNEL, VENT = 4.0, 8.0, 2.0
"""mm, diameters: of the sprue at the gel, of its outer end, and of the vent. Silicone flows through
4 mm by its own weight."""

FROM_EDGE = 0.5
"""mm between sprue or vent and the edge of the gel's back, so that its edge stays whole."""

LEVELS = 64
"""Number of cuts that look for the widest one; between two of them a gel hardly changes."""

AT_THE_BACK = 0.05
"""Share of the gel's height: a widest cut that is no higher than this is taken as its back."""

LEAST_DRAFT = 1.0
"""Degrees: faces that stand steeper along the way of pulling hold on to a rigid mould; moulders of
silicone ask for 1 to 2."""

UNDERCUT = 0.5
"""Degrees by which a face must overhang to count as an undercut; less is rounding of the mesh."""

LEAST_FACING = 0.2
"""The sum of the skin's normals, as a share of its area, below which it looks to all sides and no
direction of pulling is right: a belt."""

SIDES = 48
"""Number of sides of round holes and pins, which are then 0.01 mm off the circle."""

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Mould:
    """The mould of a gel.

    Attributes:
        name: of the gel.
        front: the half that shapes the skin, mm in the frame of the design.
        back: the other half, with sprue and vent.
        pull: (3,) unit vector, the way that the front is pulled off.
        upright: mm^2 of the gel's sides with less draft than `LEAST_DRAFT`.
        undercut: mm^2 that a rigid half can't be pulled off.
    """

    name: str
    front: TriangleMesh
    back: TriangleMesh
    pull: FloatArray
    upright: float
    undercut: float

    def shapes(self) -> list[Shape]:
        """Both halves, to be written as parts are."""
        return [
            Shape(f"{self.name}-mould-{end}", Role.BLOCKER, None, mesh)
            for end, mesh in (("front", self.front), ("back", self.back))
        ]

    def told(self) -> str:
        """The draft in a sentence."""
        if self.undercut > 0.0:
            return (
                f"{self.name}-mould: {self.undercut:.3g} mm^2 of the gel are undercut, and only a "
                "soft mould or a soft gel comes off there"
            )
        if self.upright > 0.0:
            return (
                f"{self.name}-mould: {self.upright:.3g} mm^2 of the gel's sides have a draft of "
                f"less than {LEAST_DRAFT:g} degree: use a release agent"
            )
        return f"{self.name}-mould: all sides have a draft of {LEAST_DRAFT:g} degree or more"


def moulds(made: list[Shape]) -> list[Mould]:
    """The moulds of all gels of a design.

    Args:
        made: the shapes of the design.

    Raises:
        DesignError: a gel is no solid, or the skin looks to all sides; says which.
    """
    pull = _outward([shape.mesh for shape in made if shape.role is Role.SENSING_SURFACE])
    return [mould_of(shape, pull) for shape in made if shape.role is Role.ELASTOMER]


def mould_of(gel: Shape, pull: FloatArray) -> Mould:
    """The mould of a gel.

    Args:
        gel: a solid.
        pull: (3,) unit vector, the way that its front half is pulled off.

    Raises:
        DesignError: the gel is no solid.
    """
    if not gel.is_solid:
        raise DesignError(
            f"'{gel.name}' encloses no volume, so there is no mould of it",
            where=f"parts.{gel.name}",
            hint="Close its mesh, or leave --moulds out",
        )
    axes = _axes(pull, gel.mesh.vertices)
    local = TriangleMesh(gel.mesh.vertices @ axes.T, gel.mesh.faces)
    solid = as_manifold(local)
    if solid.is_empty():
        raise DesignError(
            f"'{gel.name}' is no clean volume ({solid.status().name}), so there is no mould of it",
            where=f"parts.{gel.name}",
            hint="Repair its mesh: no edge with more than two faces, no face through another",
        )
    (left, near, bottom), (right, far, top) = local.bounds.tolist()
    parting = _widest(solid, bottom, top)
    low, high = np.array([left, near]) - WALL, np.array([right, far]) + WALL
    front = _box(low, high, parting, top + WALL) - solid
    back = _box(low, high, bottom - WALL, parting) - solid
    for x, y in ((low[0], low[1]), (high[0], low[1]), (low[0], high[1]), (high[0], high[1])):
        at = np.array([x, y]) + 0.5 * WALL * np.sign([left + right - 2 * x, near + far - 2 * y])
        back += _rod(at, parting - 1.0, parting + PIN_HEIGHT, PIN)
        hole = PIN + 2.0 * CLEARANCE
        front -= _rod(at, parting - 1.0, parting + PIN_HEIGHT + CLEARANCE, hole)
    inside = bottom + 0.02 * (top - bottom)
    sprue, vent = _ends(solid.slice(inside), (SPRUE, VENT))
    back -= _rod(sprue, bottom - WALL - 1.0, inside, FUNNEL, SPRUE)
    back -= _rod(vent, bottom - WALL - 1.0, inside, VENT)
    upright, undercut = _draft(local, parting)
    return Mould(gel.name, _mesh(front, axes), _mesh(back, axes), axes[2], upright, undercut)


def _outward(skins: list[TriangleMesh]) -> FloatArray:
    """(3,) the way that a skin looks, by area: its faces are wound towards the inside."""
    corners = np.concatenate([mesh.triangles for mesh in skins])
    twice = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    total, area = -twice.sum(axis=0), np.linalg.norm(twice, axis=1).sum()
    if np.linalg.norm(total) < LEAST_FACING * area:
        raise DesignError(
            "the skin looks to all sides, so that no half of a mould could be pulled off it",
            hint="Leave --moulds out: a belt or a tube is cast around a core",
        )
    return np.asarray(total / np.linalg.norm(total), dtype=np.float64)


def _axes(pull: FloatArray, vertices: FloatArray) -> FloatArray:
    """(3, 3) rows: along the gel's longest side across the pull, across it, and the pull itself."""
    flat = vertices - np.outer(vertices @ pull, pull)
    flat = flat - flat.mean(axis=0)
    along = np.linalg.svd(flat, full_matrices=False)[2][0]
    along = along - (along @ pull) * pull
    along /= np.linalg.norm(along)
    return np.array([along, np.cross(pull, along), pull])


def _widest(solid: Any, bottom: float, top: float) -> float:
    """The height of the cut with the largest area, or of the back."""
    heights = np.linspace(bottom, top, LEVELS + 2)[1:-1]
    areas = np.array([solid.slice(float(height)).area() for height in heights])
    first = int(np.argmax(areas >= 0.999 * areas.max()))
    height = float(heights[first])
    return bottom if height - bottom <= AT_THE_BACK * (top - bottom) else height


def _box(low: FloatArray, high: FloatArray, bottom: float, top: float) -> Any:
    import manifold3d

    size = float(high[0] - low[0]), float(high[1] - low[1]), top - bottom
    return manifold3d.Manifold.cube(size).translate((float(low[0]), float(low[1]), bottom))


def _rod(
    at: FloatArray, bottom: float, top: float, diameter: float, above: float | None = None
) -> Any:
    import manifold3d

    upper = diameter if above is None else above
    rod = manifold3d.Manifold.cylinder(top - bottom, 0.5 * diameter, 0.5 * upper, SIDES)
    return rod.translate((float(at[0]), float(at[1]), bottom))


def _ends(cut: Any, diameters: tuple[float, float]) -> tuple[FloatArray, FloatArray]:
    """Places for two holes in the back of a gel, at its two ends, clear of what a camera sees."""
    from shapely import Polygon, unary_union

    back = unary_union([Polygon(each) for each in cut.to_polygons() if len(each) > 2])
    found = []
    for diameter, sign in zip(diameters, (-1.0, 1.0), strict=True):
        room = back.buffer(-(0.5 * diameter + FROM_EDGE))
        if room.is_empty:  # too slim for it: in the middle
            found.append(np.array(back.representative_point().coords[0]))
            continue
        parts = getattr(room, "geoms", [room])
        corners = np.concatenate([np.array(part.exterior.coords) for part in parts])
        end = corners[:, 0] * sign
        last = corners[end > end.max() - 1e-6]
        found.append(last.mean(axis=0))
    return found[0], found[1]


def _draft(local: TriangleMesh, parting: float) -> tuple[float, float]:
    """mm^2 of sides with too little draft, and of undercuts, in either half."""
    corners = local.triangles
    twice = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = 0.5 * np.linalg.norm(twice, axis=1)
    up = twice[:, 2] / np.maximum(2.0 * areas, 1e-300)
    in_front = corners[:, :, 2].mean(axis=1) > parting
    opens = np.degrees(np.arcsin(np.clip(np.where(in_front, up, -up), -1.0, 1.0)))
    at_parting = np.ptp(corners[:, :, 2], axis=1) + np.abs(corners[:, 0, 2] - parting) < 1e-6
    undercut = (opens < -UNDERCUT) & ~at_parting
    upright = (opens < LEAST_DRAFT) & ~undercut & ~at_parting
    return float(areas[upright].sum()), float(areas[undercut].sum())


def _mesh(solid: Any, axes: FloatArray) -> TriangleMesh:
    mesh = solid.to_mesh64()
    vertices = np.asarray(mesh.vert_properties, dtype=np.float64)[:, :3] @ axes
    return TriangleMesh(vertices, np.asarray(mesh.tri_verts, dtype=np.int32))

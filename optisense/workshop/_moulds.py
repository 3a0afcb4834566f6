"""Moulds in which gels are cast: the gel's negative in two halves, with a sprue and a vent.

The front half shapes the skin and is pulled off in the direction of the skin's outward normal; the
back half closes it. They part where the gel is widest, which on most gels is their flat back, so
that the parting line is not on the skin.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from optisense.array_types import FloatArray
from optisense.design import Role
from optisense.errors import DesignError
from optisense.geometry import TriangleMesh
from optisense.geometry.common_space import as_manifold, of_manifold
from optisense.geometry.patches import mean_normal
from optisense.workshop.shapes import Shape

WALL = 8.0
"""Thickness of material around the gel, mm: stiff when printed, and room for the pins."""

PIN, PIN_HEIGHT = 3.0, 3.0
"""Diameter and height of the pins that align the halves, mm; printers make them round."""

CLEARANCE = 0.15
"""Clearance between a pin and its hole on each side, mm, which printed parts need to slide."""

SPRUE, FUNNEL, VENT = 4.0, 8.0, 2.0
"""Diameters of the sprue at the gel, of its outer end, and of the vent, mm. Silicone flows through
4 mm by its own weight.
"""

FROM_EDGE = 0.5
"""Distance of sprue or vent from the edge of the gel's back, mm, so that the edge stays whole."""

LEVELS = 64
"""Number of sections in the search for the widest one; between two of them a gel hardly changes."""

AT_THE_BACK = 0.05
"""Height, as a share of the gel's, up to which the widest section is taken to be its back."""

LEAST_DRAFT = 1.0
"""Smallest draft angle, degrees: steeper faces stick to a rigid mould; silicone needs 1 to 2."""

UNDERCUT = 0.5
"""Smallest overhang of a face that counts as an undercut, degrees; less is rounding of the mesh."""

LEAST_FACING = 0.2
"""Smallest length of the sum of the skin's normals, as a share of its area, for a direction of
pulling; below it the skin points in all directions, as that of a belt.
"""

SIDES = 48
"""Number of sides of round holes and pins, which are then 0.01 mm off the circle."""


@dataclass(frozen=True)
class Mould:
    """Mould of a gel.

    Attributes:
        name: name of the gel.
        front: half that shapes the skin, mm, in the frame of the design.
        back: other half, with sprue and vent.
        pull: unit vector (3,) in the direction in which the front is pulled off.
        upright: area of the gel's sides with less draft than `LEAST_DRAFT`, mm^2.
        undercut: area from which a rigid half can't be pulled off, mm^2.
    """

    name: str
    front: TriangleMesh
    back: TriangleMesh
    pull: FloatArray
    upright: float
    undercut: float

    def shapes(self) -> list[Shape]:
        """Return both halves, in the form of parts."""
        return [
            Shape(f"{self.name}-mould-{end}", Role.BLOCKER, None, mesh)
            for end, mesh in (("front", self.front), ("back", self.back))
        ]

    def note(self) -> str:
        """Return a sentence on the draft."""
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
    """Return the moulds of all gels of a design.

    Raises:
        DesignError: a gel is no solid, or the skin points in all directions, as the message says.
    """
    pull = _outward([shape.mesh for shape in made if shape.role is Role.SENSING_SURFACE])
    return [mould_of(shape, pull) for shape in made if shape.role is Role.ELASTOMER]


def mould_of(gel: Shape, pull: FloatArray) -> Mould:
    """Return the mould of a gel.

    Args:
        pull: unit vector (3,) in the direction in which its front half is pulled off.

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
    front, back = (of_manifold(half).transformed(axes.T) for half in (front, back))
    return Mould(gel.name, front, back, axes[2], upright, undercut)


def _outward(skins: list[TriangleMesh]) -> FloatArray:
    """Return the outward direction (3,) of a skin, weighted by area; its normals point inward."""
    outward = -mean_normal(TriangleMesh.joined(skins))
    length = np.linalg.norm(outward)
    if length < LEAST_FACING:
        raise DesignError(
            "the skin faces all sides, so that no half of a mould could be pulled off it",
            hint="Leave --moulds out; cast a belt or a tube around a core instead",
        )
    return np.asarray(outward / length)


def _axes(pull: FloatArray, vertices: FloatArray) -> FloatArray:
    """Return rows (3, 3): along the gel's longest side across the pull, across it, and the pull."""
    flat = vertices - np.outer(vertices @ pull, pull)
    flat = flat - flat.mean(axis=0)
    along = np.linalg.svd(flat, full_matrices=False)[2][0]
    along = along - (along @ pull) * pull
    along /= np.linalg.norm(along)
    return np.array([along, np.cross(pull, along), pull])


def _widest(solid: Any, bottom: float, top: float) -> float:
    """Return the height of the section with the largest area, or of the back."""
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
    """Return the places of two holes at the ends of a gel's back, out of the camera's view."""
    from shapely import Polygon, unary_union

    back = unary_union([Polygon(each) for each in cut.to_polygons() if len(each) > 2])
    found = []
    for diameter, sign in zip(diameters, (-1.0, 1.0), strict=True):
        room = back.buffer(-(0.5 * diameter + FROM_EDGE))
        if room.is_empty:  # it is too slim, so the hole is in the middle
            found.append(np.array(back.representative_point().coords[0]))
            continue
        parts = getattr(room, "geoms", [room])
        corners = np.concatenate([np.array(part.exterior.coords) for part in parts])
        end = corners[:, 0] * sign
        last = corners[end > end.max() - 1e-6]
        found.append(last.mean(axis=0))
    return found[0], found[1]


def _draft(local: TriangleMesh, parting: float) -> tuple[float, float]:
    """Return the areas of sides with too little draft, and of undercuts, in either half, mm^2."""
    corners, areas, up = local.triangles, local.face_areas, local.face_normals[:, 2]
    in_front = corners[:, :, 2].mean(axis=1) > parting
    opens = np.degrees(np.arcsin(np.clip(np.where(in_front, up, -up), -1.0, 1.0)))
    at_parting = np.ptp(corners[:, :, 2], axis=1) + np.abs(corners[:, 0, 2] - parting) < 1e-6
    undercut = (opens < -UNDERCUT) & ~at_parting
    upright = (opens < LEAST_DRAFT) & ~undercut & ~at_parting
    return float(areas[upright].sum()), float(areas[undercut].sum())

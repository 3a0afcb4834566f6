"""Moulds in which gels are cast: the gel's negative in two halves, with a sprue and a vent.

The front half shapes the skin and is pulled off in the direction of the skin's outward normal; the
back half closes it, and fills hollows that are open towards the back. They part in the plane with
the least undercut, and of several where the outline of the gel is largest, which on most gels is
their flat back, so that the parting line is not on the skin.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import FloatArray
from optisense.design import Role
from optisense.errors import DesignError
from optisense.geometry import TriangleMesh
from optisense.geometry.patches import mean_normal, patches
from optisense.geometry.solids import as_manifold, of_manifold
from optisense.workshop._thickened import body_between
from optisense.workshop.shapes import Shape

WALL = 8.0
"""Thickness of material around the gel, mm: stiff when printed, and room for the pins."""

PIN, PIN_HEIGHT = 3.0, 3.0
"""Diameter and height of the pins that align the halves, mm; printers make them round."""

CLEARANCE = 0.15
"""Clearance between a pin and its hole on each side, mm, which printed parts need to slide."""

SPRUE, FUNNEL, VENT = 4.0, 8.0, 2.0
"""Diameters of the sprue at the gel, of its outer end, and of the vent, mm. Silicone flows through
4 mm by its own weight. Where the gel's back is narrower, the holes are smaller."""

NARROWER = 0.9
"""Factor by which a hole and its distance from the edge are reduced until there is room."""

FROM_EDGE = 0.5
"""Distance of sprue or vent from the edge of the gel's back, mm, so that the edge stays whole."""

LEVELS = 64
"""Number of planes in the search for the parting plane, besides both ends of the gel; between two
of them a gel hardly changes."""

DECIMALS = 9
"""Number of decimals of coordinates, mm, in the frame of pulling. A flat back is then exactly
level, and no film of 1e-15 mm remains between it and the parting plane."""

SAME = 1e-3
"""Difference of undercuts, as a share of the gel's surface, and of outlines, as a share of the
largest, that counts as none, so that the rounding of a mesh does not choose the plane."""

UPRIGHT = 1e-6
"""Sine of the slope below which a face is upright and covers nothing: rounding of coordinates."""

LEAST_DRAFT = 1.0
"""Smallest draft angle, degrees: steeper faces stick to a rigid mould; silicone needs 1 to 2."""

UNDERCUT = 0.5
"""Smallest overhang of a face that counts as an undercut, degrees; less is rounding of the mesh."""

LEAST_FACING = 0.2
"""Smallest length of the sum of the skin's normals, as a share of its area, for a direction of
pulling; below it the skin points in all directions, as that of a belt."""

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
        has_vent: whether the back has a vent; a small back has no room for it beside the sprue.
    """

    name: str
    front: TriangleMesh
    back: TriangleMesh
    pull: FloatArray
    upright: float
    undercut: float
    has_vent: bool = True

    def shapes(self) -> list[Shape]:
        """Return both halves, in the form of parts."""
        return [
            Shape(f"{self.name}-mould-{end}", Role.BLOCKER, None, mesh)
            for end, mesh in (("front", self.front), ("back", self.back))
        ]

    def notes(self) -> list[str]:
        """Return a sentence on the draft, and one on the vent if there is none."""
        if self.has_vent:
            return [self._draft()]
        return [
            self._draft(),
            f"{self.name}-mould: the gel's back has no room for a vent beside the sprue: drill one "
            f"of {VENT:g} mm through {self.name}-mould-back, beside the sprue where the gel is "
            "highest while you pour",
        ]

    def _draft(self) -> str:
        if self.undercut > 0.0:
            return (
                f"{self.name}-mould: {_area(self.undercut)} of the gel are undercut, and only a "
                "soft mould or a soft gel comes off there"
            )
        if self.upright > 0.0:
            return (
                f"{self.name}-mould: {_area(self.upright)} of the gel's sides have a draft of "
                f"less than {LEAST_DRAFT:g} degree: use a release agent"
            )
        return f"{self.name}-mould: all sides have a draft of {LEAST_DRAFT:g} degree or more"


def _area(area: float) -> str:
    """Return an area, mm^2, as text without an exponent."""
    return f"{area:,.0f} mm^2" if area >= 100.0 else f"{area:.3g} mm^2"


def moulds(made: list[Shape]) -> list[Mould]:
    """Return the moulds of all gels of a design.

    Raises:
        DesignError: a gel is no solid, or the skin points in all directions, as the message says.
    """
    pull = _outward([shape.mesh for shape in made if shape.role is Role.SENSING_SURFACE])
    return [mould_of(shape, pull) for shape in made if shape.role is Role.ELASTOMER]


def mould_of(gel: Shape, pull: FloatArray) -> Mould:
    """Return the mould of a gel whose front half is pulled off in a direction (3,).

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
    local = TriangleMesh(np.round(gel.mesh.vertices @ axes.T, DECIMALS), gel.mesh.faces)
    solid = as_manifold(local)
    if solid.is_empty():
        raise DesignError(
            f"'{gel.name}' is no clean volume ({solid.status().name}), so there is no mould of it",
            where=f"parts.{gel.name}",
            hint="Repair its mesh: no edge with more than two faces, no face through another",
        )
    (left, near, bottom), (right, far, top) = local.bounds.tolist()
    held = _Held(local)
    parting = _parting(solid, held, bottom, top)
    low, high = np.array([left, near]) - WALL, np.array([right, far]) + WALL
    front = _box(low, high, parting, top + WALL) - solid
    back = _box(low, high, bottom - WALL, parting) - solid
    # One corner has no pin, so that the halves do not fit if one is turned.
    for x, y in ((low[0], low[1]), (high[0], low[1]), (low[0], high[1])):
        at = np.array([x, y]) + 0.5 * WALL * np.sign([left + right - 2 * x, near + far - 2 * y])
        back += _rod(at, parting - 1.0, parting + PIN_HEIGHT, PIN)
        hole = PIN + 2.0 * CLEARANCE
        front -= _rod(at, parting - 1.0, parting + PIN_HEIGHT + CLEARANCE, hole)
    for core in _cores(solid, local, parting):
        back += core
        front -= core + _widened(core)
    inside = bottom + 0.02 * (top - bottom)
    sprue, vent = _holes(solid.slice(inside))
    back -= _rod(sprue.at, bottom - WALL - 1.0, inside, FUNNEL, sprue.diameter)
    if vent is not None:
        back -= _rod(vent.at, bottom - WALL - 1.0, inside, vent.diameter)
    upright, undercut = held.upright(parting), held.undercut(parting)
    front, back = (of_manifold(half).transformed(axes.T) for half in (front, back))
    return Mould(gel.name, front, back, axes[2], upright, undercut, vent is not None)


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


class _Held:
    """The faces of a gel, and which of them hold a half of the mould that parts at some height,
    with z in the direction of pulling.
    """

    def __init__(self, local: TriangleMesh) -> None:
        self._areas = local.face_areas
        self._levels = np.sort(local.triangles[:, :, 2], axis=1)
        self._to_back = _open_below(local, local)
        self._slope = np.degrees(np.arcsin(np.clip(local.face_normals[:, 2], -1.0, 1.0)))

    def undercut(self, parting: float) -> float:
        """Return the area, mm^2, from which a rigid half can't be pulled off."""
        front, back = self._shares(parting)
        return float(front[self._slope < -UNDERCUT].sum() + back[self._slope > UNDERCUT].sum())

    def upright(self, parting: float) -> float:
        """Return the area, mm^2, that is not undercut and has less draft than `LEAST_DRAFT`."""
        front, back = self._shares(parting)
        ahead = (self._slope >= -UNDERCUT) & (self._slope < LEAST_DRAFT)
        behind = (self._slope <= UNDERCUT) & (self._slope > -LEAST_DRAFT)
        return float(front[ahead].sum() + back[behind].sum())

    def _shares(self, parting: float) -> tuple[FloatArray, FloatArray]:
        """Return the area, mm^2, of each face that the front half shapes, and the back half."""
        low, middle, high = self._levels.T
        with np.errstate(divide="ignore", invalid="ignore"):
            under = (parting - low) ** 2 / ((middle - low) * (high - low))
            over = (high - parting) ** 2 / ((high - middle) * (high - low))
        behind = np.where(parting <= middle, under, 1.0 - over)
        behind = np.where(parting <= low, 0.0, np.where(parting >= high, 1.0, behind))
        behind[self._to_back | (high - parting < 1e-6)] = 1.0
        return self._areas * (1.0 - behind), self._areas * behind


def _parting(solid: Any, held: _Held, bottom: float, top: float) -> float:
    """Return the height of the plane with the least undercut, and of those the largest outline.

    The outline is the convex hull of the section. The lowest plane of several is taken.
    """
    heights = np.linspace(bottom, top, LEVELS + 2)
    undercuts = np.array([held.undercut(float(height)) for height in heights])
    best = heights[undercuts <= undercuts.min() + SAME * solid.surface_area()]
    within = 1e-3 * (top - bottom)  # a section in a flat end of the gel itself is empty
    sections = np.clip(best, bottom + within, top - within)
    outlines = np.array([solid.slice(float(height)).hull().area() for height in sections])
    return float(best[np.argmax(outlines >= (1.0 - SAME) * outlines.max())])


def _open_below(faces: TriangleMesh, gel: TriangleMesh) -> NDArray[np.bool_]:
    """Return which faces (n,) look down and have no part of the gel below their middles."""
    import shapely

    down = np.flatnonzero(faces.face_normals[:, 2] < -UPRIGHT)
    middles = faces.triangles[down].mean(axis=1)
    covers = gel.triangles[gel.face_normals[:, 2] > UPRIGHT]
    tree = shapely.STRtree(shapely.polygons(covers[:, :, :2]))
    ray, cover = tree.query(shapely.points(middles[:, :2]), predicate="intersects")
    normal = np.cross(covers[:, 1] - covers[:, 0], covers[:, 2] - covers[:, 0])[cover]
    off = covers[cover, 0] - middles[ray]
    height = np.einsum("ij,ij->i", normal, off) / normal[:, 2]  # of the cover above the middle
    open_below = np.zeros(len(faces.faces), dtype=bool)
    open_below[down] = True
    open_below[down[ray[height < 0.0]]] = False
    return open_below


def _cores(solid: Any, local: TriangleMesh, parting: float) -> list[Any]:
    """Return the bodies that fill the hollows of a gel above the parting plane, open towards it.

    Each reaches 1 mm below the plane, into the back half.
    """
    upper = of_manifold(solid.trim_by_plane((0.0, 0.0, 1.0), parting)).welded()
    above = upper.triangles[:, :, 2].max(axis=1) > parting + 1e-6
    hollow = np.flatnonzero(_open_below(upper, local) & above)
    steep = upper.face_normals[:, 2] < -np.sin(np.radians(UNDERCUT))
    found = []
    for patch in patches(upper, hollow):
        if not steep[patch].any():
            continue
        roof = upper.with_faces(upper.faces[patch, ::-1]).compacted()
        floor = roof.vertices.copy()
        floor[:, 2] = parting - 1.0
        found.append(as_manifold(body_between(roof, floor)))
    return [core for core in found if core.volume() > 0.0]


def _widened(core: Any) -> Any:
    """Return a core with `CLEARANCE` at its ends, where the front slides along it."""
    low, high = np.array(core.bounding_box()).reshape(2, 3)
    factor = 1.0 + 2.0 * CLEARANCE / (high - low)
    middle = 0.5 * (low + high)
    move = np.array([middle[0], middle[1], 0.0])
    scale = (float(factor[0]), float(factor[1]), 1.0)
    return core.translate(tuple(-move)).scale(scale).translate(tuple(move))


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


@dataclass(frozen=True)
class _Hole:
    """Hole through the back: its place (2,) and its diameter, mm."""

    at: FloatArray
    diameter: float


def _holes(cut: Any) -> tuple[_Hole, _Hole | None]:
    """Return the sprue and the vent at the ends of a section of a gel near its back, out of the
    camera's view; None for a vent that would run into the sprue.

    A back of several feet has the vent on the foot that is farthest from the sprue.
    """
    from shapely import Polygon, unary_union

    back = unary_union([Polygon(each) for each in cut.to_polygons() if len(each) > 2])
    feet = list(getattr(back, "geoms", [back]))
    sprue = min((_hole(foot, SPRUE, -1.0) for foot in feet), key=lambda hole: float(hole.at[0]))

    def gap(hole: _Hole) -> float:
        between = float(np.linalg.norm(hole.at - sprue.at))
        return between - 0.5 * (hole.diameter + sprue.diameter)

    vent = max((_hole(foot, VENT, 1.0) for foot in feet), key=gap)
    return sprue, vent if gap(vent) >= FROM_EDGE else None


def _hole(foot: Any, diameter: float, sign: float) -> _Hole:
    """Return a hole at the end of a foot along x (`sign` 1) or against it (-1)."""
    margin = 0.5 * diameter + FROM_EDGE
    share = 1.0
    while (room := foot.buffer(-share * margin)).is_empty:
        share *= NARROWER
    parts = getattr(room, "geoms", [room])
    corners = np.concatenate([np.array(part.exterior.coords) for part in parts])
    end = corners[:, 0] * sign
    at = corners[end > end.max() - 1e-6].mean(axis=0)
    return _Hole(at, share * diameter)

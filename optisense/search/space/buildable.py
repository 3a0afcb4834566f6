"""Constraints that keep designs buildable: parts that rest on one another, lights on their boards,
and solids must stay what they are in the design that the search starts from.
"""

from __future__ import annotations

from collections.abc import Collection
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from optisense.design import Role, SensorDesign
from optisense.design.limits import is_gas
from optisense.geometry import TriangleMesh
from optisense.geometry.coincidence import find_coincident
from optisense.geometry.mesh_points import closest_points
from optisense.geometry.overlaps import CONTACT, near_surface
from optisense.search.space.constraints import same_shape
from optisense.sensors.light_checks import FLUSH, windows_in

LEAST_KEPT_CONTACT = 0.99
"""Share of the contact area of two parts that a trial must keep. The remaining hundredth covers
rounding at curved faces and displacements as small as manufacturing errors.
"""

SEAT_POINTS = 400
"""Number of points on each of two parts that are tested for contact; four are a hundredth."""

LEAST_CONTACT_POINTS = 16
"""Smallest number of touching points that count as a contact area; fewer are an edge or a corner,
on which no part rests.
"""

R2_STEPS = (0.7548776662466927, 0.5698402909980532)
"""The inverse of the plastic number and its square: steps of the R2 sequence, which spreads points
evenly over a square (Roberts, "The unreasonable effectiveness of quasirandom sequences", 2018)."""

SEAT_DISTANCE = 0.1
"""Largest distance of a light from the opaque part that it sits on, mm. Lights of the built-in
sensors are 0.01 mm off their boards.
"""


GROWTH_SHARE = 0.25
"""Share of the sensor's largest side by which a search may enlarge it on each side: the model of a
GelSight Mini, 28 mm long, may grow by 7 mm. A larger sensor needs a larger starting design.
"""


class PartsInContact:
    """Constraint: parts that rest on one another must still do so after a search has moved them.

    A gel that has slipped off its tray, or a coating that has left its gel, can't be built. Parts
    that are moved together keep their contact, and a plate may slide on a larger one.
    """

    def __init__(self, design: SensorDesign, moved: Collection[str]) -> None:
        """Find the contacts of the parts that are shifted or turned, `moved`, in the design that
        the search starts from.
        """
        self._meshes = design.deformed_meshes()
        self._pairs = [
            pair
            for pair in combinations(self._meshes, 2)
            if set(pair) & set(moved)
            and not any(design.parts[name].role is Role.INDENTER for name in pair)
        ]
        self._seats: dict[tuple[str, str], tuple[ContactPoints, ContactPoints]] = {}

    def __call__(self, design: SensorDesign) -> str | None:
        """Return a message with the two parts that have come apart, or None."""
        meshes = design.deformed_meshes()
        for one, other in self._pairs:
            if all(same_shape(meshes[name], self._meshes[name]) for name in (one, other)):
                continue
            first, second = self._seat(one, other)
            if len(first.faces) < LEAST_CONTACT_POINTS and len(second.faces) < LEAST_CONTACT_POINTS:
                continue
            kept = first.kept(meshes[one], meshes[other])
            if kept < LEAST_KEPT_CONTACT:
                kept = max(kept, second.kept(meshes[other], meshes[one]))
            if kept < LEAST_KEPT_CONTACT:
                return (
                    f"parts '{one}' and '{other}' lie on one another in the design that the search "
                    f"starts from, and here over {100 * kept:.0f} % of that area"
                )
        return None

    def _seat(self, one: str, other: str) -> tuple[ContactPoints, ContactPoints]:
        if (one, other) not in self._seats:
            first, second = self._meshes[one], self._meshes[other]
            pairs = find_coincident(first, second, CONTACT, facing=False).pairs
            self._seats[one, other] = (
                ContactPoints.of(first, np.unique(pairs[:, 0]), second),
                ContactPoints.of(second, np.unique(pairs[:, 1]), first),
            )
        return self._seats[one, other]


class ContactPoints(NamedTuple):
    """Points of one part that touch another one: indices (k,) of the faces of the part on which
    they lie, and their barycentric coordinates (k, 3) in these.
    """

    faces: NDArray[np.int64]
    shares: NDArray[np.float64]

    @staticmethod
    def of(mesh: TriangleMesh, faces: NDArray[np.int64], other: TriangleMesh) -> ContactPoints:
        """Return points spread evenly over those faces (k,) of a mesh that touch another mesh."""
        reached = np.cumsum(mesh.face_areas[faces])
        if len(faces) == 0 or reached[-1] <= 0.0:
            return ContactPoints(np.zeros(0, dtype=np.int64), np.zeros((0, 3)))
        number = np.arange(SEAT_POINTS) + 0.5
        chosen = faces[np.searchsorted(reached, reached[-1] * number / SEAT_POINTS)]
        u, v = np.outer(R2_STEPS, number) % 1.0
        u, v = np.where(u + v > 1.0, 1.0 - u, u), np.where(u + v > 1.0, 1.0 - v, v)
        seat = ContactPoints(chosen, np.stack([1.0 - u - v, u, v], axis=1))
        touch = np.isfinite(near_surface(seat.points(mesh), other))
        return ContactPoints(seat.faces[touch], seat.shares[touch])

    def points(self, mesh: TriangleMesh) -> NDArray[np.float64]:
        """Return the positions (k, 3) of the points, mm, on the part in its present shape."""
        found: NDArray[np.float64] = np.einsum(
            "kc,kci->ki", self.shares, mesh.triangles[self.faces]
        )
        return found

    def kept(self, mesh: TriangleMesh, other: TriangleMesh) -> float:
        """Return the share of the points that still touch the other part; 0 for too few."""
        if len(self.faces) < LEAST_CONTACT_POINTS:
            return 0.0
        return float(np.isfinite(near_surface(self.points(mesh), other)).mean())


class LightsOnSupports:
    """Constraint: lights that sit on an opaque part must stay on it after a search has moved the
    part.

    Lights whose board has moved away have nothing that holds them.
    """

    def __init__(self, design: SensorDesign, moved: Collection[str]) -> None:
        """Find the lights on opaque parts that move, in the design that the search starts from."""
        meshes = design.deformed_meshes()
        opaque = (Role.BLOCKER, Role.MIRROR)
        self._carried = {
            part: [
                (group, index)
                for group, lights in design.lights.items()
                for index in range(len(lights.lights))
                if _off(design, group, index, meshes[part]) <= SEAT_DISTANCE
            ]
            for part in sorted(moved)
            if part in meshes and design.parts[part].role in opaque
        }

    def __call__(self, design: SensorDesign) -> str | None:
        """Return a message with the light that has lost its part, or None."""
        meshes = design.deformed_meshes()
        for part, lights in self._carried.items():
            for group, index in lights:
                off = _off(design, group, index, meshes[part])
                if off > 2.0 * SEAT_DISTANCE:
                    return (
                        f"light {index} of group '{group}' sits on part '{part}' in the design "
                        f"that the search starts from, and here it is {off:.2g} mm off"
                    )
        return None


class LightsOutsideParts:
    """Constraint: no light may lie in a part in which it is not at the start: the middle of its
    window is in the part, and a corner is deeper than `FLUSH`. There is no room for an LED in the
    acrylic of a tray; lights that are cast into a part from the beginning, as those of GelSight360,
    are exempt.
    """

    def __init__(self, design: SensorDesign) -> None:
        """Find the lights inside of parts in the design that the search starts from."""
        parts = _solids(design)
        self._always = {
            (each.group, each.number, each.part)
            for each in windows_in(design, parts, set())
            if each.middle
        }

    def __call__(self, design: SensorDesign) -> str | None:
        """Return a message with the light that is inside of a part, or None."""
        parts = _solids(design)
        for each in windows_in(design, parts, self._always):
            if each.middle and (deep := each.depth(parts[each.part])) > FLUSH:
                return (
                    f"the window of light {each.number} of group '{each.group}' reaches "
                    f"{deep:.2g} mm inside part '{each.part}', where no light can be, and is "
                    "outside of it in the design that the search starts from"
                )
        return None


def _solids(design: SensorDesign) -> dict[str, TriangleMesh]:
    """Return the closed meshes, mm, of all parts except indenters, by part."""
    return {
        name: mesh
        for name, mesh in design.deformed_meshes().items()
        if mesh.is_closed and design.parts[name].role is not Role.INDENTER
    }


class SizeLimit:
    """Constraint: parts that a search deforms or moves may not reach far beyond the sensor that it
    starts from.

    A gel that is drawn out to three times its width scores a little better and fits no housing.
    """

    def __init__(self, design: SensorDesign) -> None:
        """Store the bounds of the design that the search starts from."""
        self._names = [
            name for name, part in design.parts.items() if part.role is not Role.INDENTER
        ]
        bounds = self._bounds(design)
        lower = np.min([each[0] for each in bounds.values()], axis=0)
        upper = np.max([each[1] for each in bounds.values()], axis=0)
        self._most = GROWTH_SHARE * float((upper - lower).max())
        self._lower, self._upper = lower - self._most, upper + self._most

    def __call__(self, design: SensorDesign) -> str | None:
        """Return a message with the part that reaches too far, or None."""
        for name, (lower, upper) in self._bounds(design).items():
            if (lower < self._lower).any() or (upper > self._upper).any():
                out = float(np.maximum(self._lower - lower, upper - self._upper).max())
                return (
                    f"part '{name}' reaches {out + self._most:.1f} mm beyond the sensor that the "
                    f"search starts from; {self._most:.1f} mm is the most"
                )
        return None

    def _bounds(self, design: SensorDesign) -> dict[str, NDArray[np.float64]]:
        meshes = design.deformed_meshes()
        return {name: meshes[name].bounds for name in self._names if name in meshes}


class SolidsStaySolid:
    """Constraint: a refractive index may not turn a solid or liquid into a gas, nor an air gap into
    a solid, because air is a plate that has vanished. Materials that the search chooses from are
    exempt.
    """

    def __init__(self, design: SensorDesign) -> None:
        """Find the gases in the design that the search starts from."""
        self._gases = {
            name: is_gas(medium)
            for name, material in design.materials.items()
            if (medium := material.medium()) is not None
        }

    def __call__(self, design: SensorDesign) -> str | None:
        """Return a message with the material that has changed its state, or None."""
        for name, was_gas in self._gases.items():
            material = design.materials.get(name)
            medium = None if material is None else material.medium()
            if medium is not None and is_gas(medium) != was_gas:
                now, before = ("a solid", "air") if was_gas else ("air", "a solid")
                return (
                    f"with a refractive index of {medium.ior:g} material '{name}' is {now}, and "
                    f"in the design that the search starts from it is {before}"
                )
        return None


def _off(design: SensorDesign, group: str, index: int, mesh: TriangleMesh) -> float:
    """Return the distance from a light to a mesh, mm; 0 for a light that does not exist."""
    lights = design.lights[group].lights if group in design.lights else []
    if index >= len(lights):
        return 0.0
    place = np.array(lights[index].position)
    return float(np.linalg.norm(closest_points(mesh, place) - place, axis=1).min())

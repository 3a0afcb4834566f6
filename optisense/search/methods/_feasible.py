"""Nearest feasible point to a wanted one, for gradient methods.

A method that follows a gradient meets constraints again and again: the best shape of a mirror often
touches the housing. A forbidden point has no score, so it tells the method nothing but to turn
back. Here the wanted point is moved instead, so that the method slides along the constraint: if two
parts cut through each other, each corner of a triangle beyond the plane of the other part's
triangle must go back to it. That is a linear inequality if shapes move linearly with the point, as
they do in cages, and the nearest point that meets all of them is the solution of a quadratic
programme. Other constraints have no such form, and parts may meet again elsewhere: then the point
goes back towards a feasible one.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from optisense.array_types import FloatArray
from optisense.design import SensorDesign
from optisense.errors import OptiSenseError
from optisense.geometry.crossings import crossings
from optisense.search.methods._jacobian import Jacobian, jacobian
from optisense.search.space.constraints import Constraint, NoCrossings, why_forbidden
from optisense.search.space.search_space import BoundSpace

ROUNDS = 12
"""Largest number of times that a point is moved out of parts before bisection is used instead. Two
or three are enough where a mirror meets one wall; each intersects the shapes once (about 30 ms).
"""

CORNERS = 30
"""Number of corners of triangles that are moved out at once, those that are deepest inside; the
others follow in the next round.
"""

GAP = 0.01
"""Clearance between corners and the planes that they have crossed, mm: above rounding errors and
below the manufacturing tolerance of any part.
"""

HALVINGS = 8
"""Number of bisections between the wanted point and a feasible one; 8 locate the boundary to 0.4 %
of the distance.
"""

ACTIVE_TOLERANCE = 1e-7
"""Largest distance of a point from a bound or plane that counts as active, in units of the ranges;
it covers the solver's rounding errors.
"""


class FeasiblePoint(NamedTuple):
    """Feasible point for a wanted one, (n,) in units of the ranges, and orthonormal vectors (k, n),
    the normals of the active constraints.
    """

    point: FloatArray
    normals: FloatArray

    @staticmethod
    def unchanged(point: FloatArray) -> FeasiblePoint:
        """Return the result for a wanted point (n,) that is feasible itself."""
        return FeasiblePoint(point, np.zeros((0, len(point))))

    def along(self, slope: FloatArray) -> FloatArray:
        """Return the component of a slope (n,) that the active constraints leave free."""
        free: FloatArray = slope - self.normals.T @ (self.normals @ slope)
        return free


class _Planes(NamedTuple):
    """Linear inequalities ``normals @ point <= limits`` for points in units of the ranges."""

    normals: FloatArray
    limits: FloatArray

    @staticmethod
    def of(several: Sequence[_Planes]) -> _Planes:
        """Return the union of several sets of inequalities."""
        return _Planes(
            np.concatenate([each.normals for each in several]),
            np.concatenate([each.limits for each in several]),
        )


class FeasibleRegion:
    """Set of the points of a space that constraints on shapes allow."""

    def __init__(
        self, space: BoundSpace, constraints: Sequence[Constraint], parts: Sequence[str]
    ) -> None:
        """Store the constraints, and the names of the parts whose shapes points change."""
        self._space = space
        self._constraints = list(constraints)
        self._parts = list(parts)
        self._apart = [each for each in constraints if isinstance(each, NoCrossings)]
        self._moves: Jacobian | None = None

    def allows(self, unit: FloatArray) -> bool:
        """Return whether no constraint forbids a point (n,), in units of the ranges. One at which a
        constraint raises an error is allowed: its evaluator reports the error.
        """
        try:
            return why_forbidden(self._design(unit), self._constraints) is None
        except OptiSenseError:
            return True

    def nearest(self, wanted: FloatArray, allowed: FloatArray) -> FeasiblePoint:
        """Return a feasible point near a wanted one, by bisection towards the feasible point
        `allowed` if nothing else helps; points are (n,), in units of the ranges, 0 to 1.
        """
        if self.allows(wanted):
            return FeasiblePoint.unchanged(wanted)
        planes = _Planes(np.zeros((0, len(wanted))), np.zeros(0))
        point = wanted
        for _ in range(ROUNDS):
            further = self._planes(point, allowed)
            if further is None:
                break
            planes = _Planes.of([planes, further])
            found = _nearest(wanted, planes)
            if found is None:  # planes of the faces beside an edge may exclude each other
                break
            point = found
            if self.allows(point):
                return FeasiblePoint(point, _active_normals(wanted, point, planes))
        return self._bisect(wanted, allowed)

    def _design(self, unit: FloatArray) -> SensorDesign:
        return self._space.apply(self._space.from_unit(unit))

    def _bisect(self, wanted: FloatArray, allowed: FloatArray) -> FeasiblePoint:
        """Return the last feasible point from a feasible one to a wanted one, by bisection."""
        way, low, high = wanted - allowed, 0.0, 1.0
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            if self.allows(allowed + middle * way):
                low = middle
            else:
                high = middle
        length = float(np.linalg.norm(way))
        normals = way[None] / length if length > 0.0 else np.zeros((0, len(way)))
        return FeasiblePoint(allowed + low * way, normals)

    def _planes(self, unit: FloatArray, allowed: FloatArray) -> _Planes | None:
        """Return the inequalities that move parts apart, or None if another constraint fails."""
        design, before = self._design(unit), self._design(allowed)
        for rule in self._apart:
            found = rule.meeting(design)
            if found is not None:
                names = found.one, found.other
                planes = [
                    self._separating_planes(design, before, unit, one, other)
                    for one, other in (names, names[::-1])
                    if one in self._parts
                ]
                return _Planes.of(planes)
        return None

    def _separating_planes(
        self, design: SensorDesign, before: SensorDesign, unit: FloatArray, one: str, other: str
    ) -> _Planes:
        """Return the inequalities for corners of a part that crossed planes of another part."""
        meshes, old = design.deformed_meshes(), before.deformed_meshes()
        mesh, against = meshes[one], meshes[other]
        pairs = crossings(mesh, against).pairs
        normal = against.face_normals[pairs[:, 1]]
        origin = against.triangles[pairs[:, 1], 0]
        heights = np.einsum("kci,ki->kc", mesh.triangles[pairs[:, 0]] - origin[:, None], normal)
        # The side of the plane on which the triangle was at the feasible point.
        earlier = (
            old[one].triangles[pairs[:, 0]].mean(axis=1) - old[other].triangles[pairs[:, 1], 0]
        )
        beside = np.einsum("ki,ki->k", earlier, old[other].face_normals[pairs[:, 1]])
        side = np.where(beside >= 0.0, 1.0, -1.0)
        heights *= side[:, None]
        deepest = heights.argmin(axis=1)
        rows = np.arange(len(pairs))
        depth = -heights[rows, deepest]
        chosen = np.argsort(-depth, kind="stable")[:CORNERS]
        vertex = mesh.faces[pairs[:, 0], deepest][chosen]
        outward = (side[:, None] * normal)[chosen]
        moves = np.einsum("nki,ki->kn", self._slopes(one)[:, vertex], outward)
        if other in self._parts:
            corner = against.faces[pairs[chosen, 1], 0]
            moves -= np.einsum("nki,ki->kn", self._slopes(other)[:, corner], outward)
        moves *= self._space.span
        length = np.linalg.norm(moves, axis=1)
        known = length > 0.0
        normals = -moves[known] / length[known, None]
        return _Planes(normals, normals @ unit - (depth[chosen] + GAP)[known] / length[known])

    def _slopes(self, part: str) -> FloatArray:
        """Return the derivative of a part's vertices by each coordinate, (n, v, 3), mm per unit."""
        if self._moves is None:
            self._moves = jacobian(self._space, self._space.start, self._parts)
        return self._moves.parts[part]


def _nearest(wanted: FloatArray, planes: _Planes) -> FloatArray | None:
    """Return the point within 0 to 1 and below all planes nearest to a point (n,), or None."""
    from scipy.optimize import LinearConstraint, minimize

    found = minimize(
        lambda point: (0.5 * ((point - wanted) ** 2).sum(), point - wanted),
        wanted,
        jac=True,
        method="SLSQP",
        bounds=[(0.0, 1.0)] * len(wanted),
        constraints=[LinearConstraint(planes.normals, -np.inf, planes.limits)],
        options={"ftol": 1e-12},
    )
    return np.clip(found.x, 0.0, 1.0) if found.success else None


def _active_normals(wanted: FloatArray, point: FloatArray, planes: _Planes) -> FloatArray:
    """Return orthonormal directions (k, n) in which active constraints hold a point back."""
    binding = planes.normals[planes.limits - planes.normals @ point < ACTIVE_TOLERANCE]
    at_bound = (point != wanted) & ((point <= 0.0) | (point >= 1.0))
    rows = np.concatenate([binding, np.eye(len(point))[at_bound]])
    if not len(rows):
        return rows
    _, sizes, directions = np.linalg.svd(rows, full_matrices=False)
    return np.asarray(directions[sizes > 1e-9 * sizes[0]])

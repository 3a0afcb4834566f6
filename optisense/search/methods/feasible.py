"""The point nearest to a wanted one at which a design can be built, for methods that climb.

A method that follows a gradient runs into constraints again and again: the best shape of a mirror
often touches the housing. A forbidden point has no score, so that the method learns nothing from
it but that it must turn back. Here the wanted point is moved instead, so that the method slides
along the constraint: where two parts cut through each other, each corner of a triangle that has
gone through the plane of the other part's triangle must go back to it. That is a linear inequality
where shapes move linearly with the point, as they do in cages, and the nearest point that keeps
all of these is the solution of a quadratic programme. Other constraints have no such form, and
parts may meet again elsewhere: then the point goes back towards one that is known to be allowed.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from optisense.design import SensorDesign
from optisense.errors import OptiSenseError
from optisense.geometry.crossings import crossings
from optisense.search.methods.base import FloatArray
from optisense.search.methods.jacobian import Jacobian, jacobian
from optisense.search.space.constraints import Constraint, PartsApart, why_forbidden
from optisense.search.space.search_space import BoundSpace

ROUNDS = 12
"""Times that a point is moved out of parts before it goes back instead. Two or three are enough
where a mirror meets one wall; each looks at the shapes once (about 30 ms)."""

CORNERS = 30
"""Corners of triangles that are moved out at once: those that have gone through the farthest."""

GAP = 0.01
"""mm that corners are kept away from the planes that they have gone through: more than what
rounding changes and less than any part is made to."""

HALVINGS = 8
"""Times that the way back is halved: to 0.4 % of it."""

BINDING = 1e-7
"""Part of the ranges: a bound or a plane that a point keeps by less holds the point back."""


class Placed(NamedTuple):
    """The allowed point for a wanted one, both as parts (n,) of the ranges, and unit vectors
    (k, n), orthogonal to each other, along which it is held back.
    """

    point: FloatArray
    normals: FloatArray

    @staticmethod
    def unchanged(point: FloatArray) -> Placed:
        """A wanted point (n,) that is allowed."""
        return Placed(point, np.zeros((0, len(point))))

    def along(self, slope: FloatArray) -> FloatArray:
        """The part of a slope (n,) that the point can follow."""
        free: FloatArray = slope - self.normals.T @ (self.normals @ slope)
        return free


class _Planes(NamedTuple):
    """Linear inequalities ``normals @ point <= limits`` of points as parts of the ranges."""

    normals: FloatArray
    limits: FloatArray

    @staticmethod
    def of(several: Sequence[_Planes]) -> _Planes:
        """All of several."""
        return _Planes(
            np.concatenate([each.normals for each in several]),
            np.concatenate([each.limits for each in several]),
        )


class FeasibleRegion:
    """The points of a space that constraints on shapes allow."""

    def __init__(
        self, space: BoundSpace, constraints: Sequence[Constraint], parts: Sequence[str]
    ) -> None:
        """Nothing is looked at yet.

        Args:
            space: whose points are asked for.
            constraints: that a design must keep.
            parts: whose shapes points change.
        """
        self._space = space
        self._span = space.upper - space.lower
        self._constraints = list(constraints)
        self._parts = list(parts)
        self._apart = [each for each in constraints if isinstance(each, PartsApart)]
        self._moves: Jacobian | None = None

    def allows(self, unit: FloatArray) -> bool:
        """Whether no constraint forbids a point (n,), as parts of the ranges; errors of constraints
        are left to those who score it.
        """
        try:
            return why_forbidden(self._design(unit), self._constraints) is None
        except OptiSenseError:
            return True

    def nearest(self, wanted: FloatArray, allowed: FloatArray) -> Placed:
        """An allowed point near a wanted one, both as parts (n,) of the ranges.

        Args:
            wanted: within 0 to 1.
            allowed: a point that constraints allow; a way back that always works.
        """
        if self.allows(wanted):
            return Placed.unchanged(wanted)
        planes = _Planes(np.zeros((0, len(wanted))), np.zeros(0))
        point = wanted
        for _ in range(ROUNDS):
            further = self._planes(point, allowed)
            if further is None:
                break
            planes = _Planes.of([planes, further])
            found = _nearest(wanted, planes)
            if found is None:  # beside an edge the planes of its faces may contradict each other
                break
            point = found
            if self.allows(point):
                return Placed(point, _held_back(wanted, point, planes))
        return self._way_back(wanted, allowed)

    def _design(self, unit: FloatArray) -> SensorDesign:
        space = self._space
        point = np.clip(space.lower + unit * self._span, space.lower, space.upper)
        return space.apply(point)

    def _way_back(self, wanted: FloatArray, allowed: FloatArray) -> Placed:
        """The last allowed point on the straight way from an allowed one to a wanted one."""
        way, low, high = wanted - allowed, 0.0, 1.0
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            if self.allows(allowed + middle * way):
                low = middle
            else:
                high = middle
        length = float(np.linalg.norm(way))
        normals = way[None] / length if length > 0.0 else np.zeros((0, len(way)))
        return Placed(allowed + low * way, normals)

    def _planes(self, unit: FloatArray, allowed: FloatArray) -> _Planes | None:
        """What moves parts out of each other, or None if that is not what is forbidden."""
        design, before = self._design(unit), self._design(allowed)
        for rule in self._apart:
            found = rule.meeting(design)
            if found is not None:
                names = found.one, found.other
                planes = [
                    self._out_of(design, before, unit, one, other)
                    for one, other in (names, names[::-1])
                    if one in self._parts
                ]
                return _Planes.of(planes)
        return None

    def _out_of(
        self, design: SensorDesign, before: SensorDesign, unit: FloatArray, one: str, other: str
    ) -> _Planes:
        """The corners of a part that have gone through planes of another part."""
        meshes, old = design.deformed_meshes(), before.deformed_meshes()
        mesh, against = meshes[one], meshes[other]
        pairs = crossings(mesh, against).pairs
        normal = against.face_normals[pairs[:, 1]]
        origin = against.triangles[pairs[:, 1], 0]
        heights = np.einsum("kci,ki->kc", mesh.triangles[pairs[:, 0]] - origin[:, None], normal)
        # The side of the plane on which the triangle was where it was allowed.
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
        moves *= self._span
        length = np.linalg.norm(moves, axis=1)
        known = length > 0.0
        normals = -moves[known] / length[known, None]
        return _Planes(normals, normals @ unit - (depth[chosen] + GAP)[known] / length[known])

    def _slopes(self, part: str) -> FloatArray:
        """(n, v, 3) mm a unit that the vertices of a part move with each coordinate."""
        if self._moves is None:
            self._moves = jacobian(self._space, self._space.start, self._parts)
        return self._moves.parts[part]


def _nearest(wanted: FloatArray, planes: _Planes) -> FloatArray | None:
    """The point within 0 to 1, and below all planes, nearest to one (n,); None if there is none."""
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


def _held_back(wanted: FloatArray, point: FloatArray, planes: _Planes) -> FloatArray:
    """(k, n) orthonormal: the directions in which a point can't follow the wanted one."""
    binding = planes.normals[planes.limits - planes.normals @ point < BINDING]
    bounds = np.eye(len(point))[np.abs(point - wanted) > 0.0]
    bounds = bounds[((point <= 0.0) | (point >= 1.0))[np.abs(point - wanted) > 0.0]]
    rows = np.concatenate([binding, bounds])
    if not len(rows):
        return rows
    _, sizes, directions = np.linalg.svd(rows, full_matrices=False)
    return np.asarray(directions[sizes > 1e-9 * sizes[0]])

"""Constraints on designs: parts that must not cut through one another, or a user's own rule."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from functools import cached_property
from itertools import combinations
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from optisense.design import Role, SensorDesign
from optisense.design.arrangement import may_overlap
from optisense.design.parts import TRANSPARENT_SOLIDS
from optisense.design.problems import Diagnostic
from optisense.errors import OptiSenseError, SearchError
from optisense.geometry import TriangleMesh
from optisense.geometry.crossings import crossings
from optisense.own_code import place_of
from optisense.search.space.pickling import PickledWithoutCaches

Constraint = Callable[[SensorDesign], bool | str | None]
"""Function that forbids designs: it returns False, or a text with the reason, for such a one."""


RULE = "a constraint"
"""First words of the errors of a rule whose function fails or returns no valid answer."""


class CrossingParts(NamedTuple):
    """Two parts that cut through each other, and a point where they do, (3,) mm."""

    one: str
    other: str
    place: NDArray[np.float64]


class NoCrossings:
    """Constraint: no part may cut through another one that it does not cut in the starting design.

    Some solids may overlap (see `may_overlap`), and a sensing surface lies on its gel: such pairs
    are not tested, nor those that do not move.
    """

    def __init__(self, design: SensorDesign) -> None:
        """Store the meshes of the design that the search starts from."""
        self._meshes = design.deformed_meshes()
        self._pairs = [
            (one, other)
            for one, other in combinations(self._meshes, 2)
            if not _lies_on(design, one, other)
        ]
        self._known: dict[tuple[str, str], bool] = {}

    def __call__(self, design: SensorDesign) -> str | None:
        """Return a message with the two parts that cut through each other, or None."""
        found = self.meeting(design)
        if found is None:
            return None
        x, y, z = found.place
        return (
            f"parts '{found.one}' and '{found.other}' cut through each other at "
            f"({x:.2f}, {y:.2f}, {z:.2f}) mm"
        )

    def meeting(self, design: SensorDesign) -> CrossingParts | None:
        """Return the first two parts that cut through each other unlike at the start, or None."""
        meshes = design.deformed_meshes()
        moved = {
            name for name, mesh in meshes.items() if not same_shape(mesh, self._meshes.get(name))
        }
        for one, other in self._pairs:
            if one not in meshes or other not in meshes or not moved & {one, other}:
                continue
            if may_overlap(design, one, other) or self._crossed_before(one, other):
                continue
            place = _crossing(meshes[one], meshes[other])
            if place is not None:
                return CrossingParts(one, other, place)
        return None

    def _crossed_before(self, one: str, other: str) -> bool:
        if (one, other) not in self._known:
            self._known[one, other] = _crossing(self._meshes[one], self._meshes[other]) is not None
        return self._known[one, other]


class NoNewProblems:
    """Constraint: a check of designs may find no problem, such as a fold of a part that cages
    deform, that the starting design does not have.
    """

    def __init__(
        self, design: SensorDesign, problems: Callable[[SensorDesign], Sequence[Diagnostic]]
    ) -> None:
        """Find the problems of the design that the search starts from, which are ignored."""
        self._problems = problems
        self._always = {problem.where for problem in problems(design)}

    def __call__(self, design: SensorDesign) -> str | None:
        """Return the message of the first new problem, or None."""
        for problem in self._problems(design):
            if problem.where not in self._always:
                return problem.message
        return None


class UserRule(PickledWithoutCaches):
    """Function in a user's Python file, loaded when it is first called."""

    def __init__(self, text: str) -> None:
        """Parse FILE.py:FUNCTION. The file, which may come from a stranger, is not run yet."""
        file, colon, self.function = text.rpartition(":")
        if not colon or not file.endswith(".py") or not self.function:
            raise SearchError(f"'{text}' is not a rule", hint="Write FILE.py:FUNCTION")
        self.path = Path(os.path.realpath(file))

    def __call__(self, design: SensorDesign) -> bool | str | None:
        """Return the result of the user's function for a design."""
        return self.loaded(design)

    def __str__(self) -> str:
        return f"{self.path}:{self.function}"

    @cached_property
    def loaded(self) -> Constraint:
        """Function in the file, which is run once; an error if one of them is missing or the file
        fails.
        """
        from optisense.objectives.files import run_file

        content = run_file(self.path)
        found = content.get(self.function)
        if not callable(found):
            raise SearchError(f"the file has no function '{self.function}'", where=str(self.path))
        return found


def why_forbidden(design: SensorDesign, constraints: Sequence[Constraint]) -> str | None:
    """Return the reason why a design is forbidden, or None; SearchError if a rule fails or gives no
    valid answer.
    """
    for rule in constraints:
        try:
            said = rule(design)
        except OptiSenseError:
            raise
        except Exception as error:
            raise SearchError(
                f"{RULE} failed: {type(error).__name__}: {error}", where=place_of(error)
            ) from error
        if isinstance(said, str):
            return said or "a constraint does not hold"
        if said is None or isinstance(said, bool | np.bool_):
            if said is None or said:
                continue
            name = getattr(rule, "__name__", None) or str(rule)
            return f"the constraint {name} does not hold"
        raise SearchError(
            f"{RULE} returned a {type(said).__name__}",
            hint="Return True where a design is fine, else False or a text that says why",
        )
    return None


def _lies_on(design: SensorDesign, one: str, other: str) -> bool:
    """Return whether a part is an indenter, or a sensing surface beside a transparent solid."""
    roles = {design.parts[one].role, design.parts[other].role}
    on_solid = Role.SENSING_SURFACE in roles and bool(roles & TRANSPARENT_SOLIDS)
    return Role.INDENTER in roles or on_solid


def _crossing(one: TriangleMesh, other: TriangleMesh) -> NDArray[np.float64] | None:
    low = np.maximum(one.bounds[0], other.bounds[0])
    high = np.minimum(one.bounds[1], other.bounds[1])
    if (low > high).any():
        return None
    found = crossings(one, other, limit=1)
    return found.places[0] if len(found.places) else None


def same_shape(mesh: TriangleMesh, before: TriangleMesh | None) -> bool:
    """Return whether a mesh exists before and has the same vertices."""
    if before is None or mesh.vertices.shape != before.vertices.shape:
        return False
    return mesh is before or bool(np.array_equal(mesh.vertices, before.vertices))

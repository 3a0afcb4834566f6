"""Search spaces: the parameters of a design that may change, and their bounds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from optisense.array_types import FloatArray
from optisense.design import SensorDesign, get_value, set_values
from optisense.errors import OptiSenseError, SearchError
from optisense.search.space._edit import Edit
from optisense.search.space._expansion import expand
from optisense.search.space.constraints import Constraint
from optisense.search.space.design_variables import LightType, with_light_types
from optisense.search.space.parameters import (
    Choice,
    Integer,
    Parameter,
    Specification,
    as_specification,
    from_plain,
    to_plain,
)

SURE_SECTIONS = ("coating", "cages", "materials")
"""Sections of a design whose numbers are limited by bounds only, so that every value between two
valid ones is valid and need not be checked.
"""


class SearchSpace:
    """Parameters of a search by dotted path, not bound to a design yet.

    A value is (low, high), (low, high, steps), `Integer`, `Choice` or a list of options, `Around`
    (a distance from the present value), or `CagePoints`. A path to a vector or to a cage's points
    stands for all their numbers. docs/search.md lists the paths that move whole groups and parts.
    """

    def __init__(
        self, parameters: Mapping[str, object], constraints: Sequence[Constraint] = ()
    ) -> None:
        """Parse the specifications.

        Args:
            parameters: specification by dotted path.
            constraints: functions of a design; designs for which one returns False, or a reason,
                are not scored.

        Raises:
            SearchError: there is no parameter, or bounds are empty, reversed or not finite.
        """
        self.parameters: dict[str, Specification] = {}
        for path, value in parameters.items():
            try:
                self.parameters[path] = as_specification(value)
            except SearchError as error:
                raise SearchError(error.message, where=path, hint=error.hint) from None
        if not self.parameters:
            raise SearchError("the space has no parameter", hint="Name a path and its bounds")
        self.constraints = tuple(constraints)

    def bind(self, design: SensorDesign, *, tried: bool = True) -> BoundSpace:
        """Return the space for one design: every path is looked up and, if `tried`, every bound is
        tried.

        Raises:
            DesignError: a path names nothing in the design, or a bound does not fit.
            SearchError: a path can't be varied like this.
        """
        return BoundSpace(self, design, tried=tried)

    def to_plain(self) -> dict[str, Any]:
        """Return the parameters ready for JSON, without constraints, which are functions."""
        return {path: to_plain(spec) for path, spec in self.parameters.items()}

    @staticmethod
    def from_plain(data: Mapping[str, Any], constraints: Sequence[Constraint] = ()) -> SearchSpace:
        """Return the space for values of `to_plain`.

        Raises:
            SearchError: the values can't be read.
        """
        return SearchSpace({path: from_plain(value) for path, value in data.items()}, constraints)

    def __repr__(self) -> str:
        return f"SearchSpace({self.parameters!r})"


class BoundSpace:
    """Search space for one design.

    A point in it is a vector (n,) of coordinates: a number as it is, a choice as the index of its
    option. Methods that need a scale work in the unit cube (see `to_unit`).

    Attributes:
        space: the unbound space.
        design: design that it was bound to.
        prepared: the same design in the form to set parameters in (a cage with a blend, say).
        parameters: parameter of each coordinate.
        lower, upper, span: bounds (n,), included, and the ranges between them.
        start: the design as a point (n,), or the point nearest to it.
        discrete: coordinates (n,) that are integers (integers and choices), bool.
        reshapes: whether a parameter moves surfaces.
    """

    def __init__(self, space: SearchSpace, design: SensorDesign, *, tried: bool = True) -> None:
        """See `SearchSpace.bind`."""
        self.space = space
        self.design = design
        found: list[Parameter] = []
        prepared = design
        for path, spec in space.parameters.items():
            prepared, added = expand(prepared, path, spec)
            found += added
        self.prepared = prepared
        self.parameters = tuple(found)
        self._check_apart()
        kinds = [parameter.kind for parameter in found]
        self.lower = np.array([float(kind.low) for kind in kinds])
        self.upper = np.array([float(kind.high) for kind in kinds])
        self.span = self.upper - self.lower
        self.start = np.array([parameter.start for parameter in found])
        self.discrete = np.array([isinstance(kind, Integer | Choice) for kind in kinds])
        sections = {parameter.name.split(".")[0] for parameter in found}
        self.reshapes = "cages" in sections or any(p.variable and p.variable.shapes for p in found)
        self._sure = sections <= set(SURE_SECTIONS) and not any(p.variable for p in found)
        self._plan()
        if tried:
            self._try_bounds()

    @property
    def size(self) -> int:
        """Number of parameters, n."""
        return len(self.parameters)

    @property
    def names(self) -> list[str]:
        """Paths of the parameters."""
        return [parameter.name for parameter in self.parameters]

    def values(self, vector: ArrayLike) -> dict[str, float | int | str]:
        """Return the values of a point (n,) by parameters: numbers, and labels of options."""
        point = np.asarray(vector, dtype=float)
        found: dict[str, float | int | str] = {}
        for parameter, coordinate in zip(self.parameters, point.tolist(), strict=True):
            kind = parameter.kind
            if isinstance(kind, Choice):
                found[parameter.name] = kind.labels[round(coordinate)]
            else:
                whole = isinstance(kind, Integer)
                found[parameter.name] = round(coordinate) if whole else coordinate
        return found

    def check(self, vector: ArrayLike) -> None:
        """Check that a vector (n,) is a point of the space; the SearchError names the first
        coordinate outside its bounds.
        """
        point = np.asarray(vector, dtype=float)
        if point.shape != (self.size,):
            raise SearchError(f"a point of this space has {self.size} numbers, not {point.shape}")
        wrong = ~((point >= self.lower) & (point <= self.upper))
        wrong |= self.discrete & (point != np.round(point))
        if wrong.any():
            first = int(np.flatnonzero(wrong)[0])
            low, high = self.lower[first], self.upper[first]
            raise SearchError(
                f"{point[first]:g} is not between {low:g} and {high:g}, or not a whole number",
                where=self.parameters[first].name,
            )

    def to_unit(self, vector: ArrayLike) -> FloatArray:
        """Return coordinates (..., n) from 0 at the lower to 1 at the upper bounds."""
        return np.asarray((np.asarray(vector) - self.lower) / self.span)

    def from_unit(self, unit: ArrayLike) -> FloatArray:
        """Return the point (..., n) for coordinates 0 to 1, clipped, and rounded where `discrete`.

        Integers share the unit interval evenly: four options get a quarter each.
        """
        share = np.clip(np.asarray(unit, dtype=np.float64), 0.0, 1.0)
        counted = self.lower + np.minimum(np.floor(share * (self.span + 1.0)), self.span)
        smooth = np.clip(self.lower + share * self.span, self.lower, self.upper)
        return np.where(self.discrete, counted, smooth)

    def unit_of(self, vector: ArrayLike) -> FloatArray:
        """Return the coordinates (..., n), 0 to 1, that `from_unit` maps to the points (..., n).

        An integer gets the middle of its interval.
        """
        point = np.asarray(vector, dtype=np.float64)
        middle = (point - self.lower + 0.5) / (self.span + 1.0)
        return np.where(self.discrete, middle, self.to_unit(point))

    def apply(self, vector: ArrayLike) -> SensorDesign:
        """Return the design at a point (n,); OptiSenseError if the values do not fit together."""
        point = np.asarray(vector, dtype=np.float64)
        design = self.prepared
        for number, variable in self._first:
            design = variable.apply(design, self._option(number, point))
        design = self._edit.apply(design, self._targets(point))
        if self._chosen:
            options = {path: self._option(number, point) for path, number in self._chosen}
            design = set_values(design, options)
        for number, variable in self._moves:
            design = variable.apply(design, float(point[number]))
        if self._types:
            chosen = {
                (variable.group, variable.index): str(self._option(number, point))
                for number, variable in self._types
            }
            design = with_light_types(design, chosen)
        return design if self._sure else checked(design)

    def _targets(self, point: FloatArray) -> list[Any]:
        """Return the numbers of all direct targets, in the order of the edit's paths."""
        numbers: list[Any] = (point[self._source] * self._scale + self._offset).tolist()
        for position, number in self._integers:
            numbers[position] = self._option(number, point)
        return numbers

    def _option(self, number: int, point: FloatArray) -> Any:
        """Return the value of an integer parameter at a point: the option, or an int."""
        kind, place = self.parameters[number].kind, round(float(point[number]))
        return kind.options[place] if isinstance(kind, Choice) else place

    def _plan(self) -> None:
        """Look up all paths once, so that applying a point is fast. Options, which users wrote, are
        set with a check that converts them to the type of their field.
        """
        targets = [(n, each) for n, p in enumerate(self.parameters) for each in p.targets]
        kinds = [parameter.kind for parameter in self.parameters]
        self._chosen = [(each.path, n) for n, each in targets if isinstance(kinds[n], Choice)]
        for path, _ in self._chosen:
            get_value(self.prepared, path)
        direct = [(n, each) for n, each in targets if not isinstance(kinds[n], Choice)]
        self._integers = [(k, n) for k, (n, _) in enumerate(direct) if self.discrete[n]]
        self._edit = Edit(self.prepared, [each.path for _, each in direct])
        self._source = np.array([n for n, _ in direct], dtype=np.int64)
        self._scale = np.array([each.scale for _, each in direct])
        self._offset = np.array([each.offset for _, each in direct])
        changed = [(n, p.variable) for n, p in enumerate(self.parameters) if p.variable is not None]
        self._first = [(n, each) for n, each in changed if each.stage == 0]
        self._moves = [(n, each) for n, each in changed if each.stage == 2]
        self._types = [(n, each) for n, each in changed if isinstance(each, LightType)]

    def _check_apart(self) -> None:
        """Refuse two parameters that set the same value."""
        seen: dict[str, str] = {}
        for parameter in self.parameters:
            for path in parameter.paths:
                if path in seen:
                    raise SearchError(f"'{path}' is varied twice", where=parameter.asked)
                seen[path] = parameter.name
        for path in seen:
            for other in seen:
                if other.startswith((f"{path}.", f"{path}[")) and not _may_nest(path):
                    raise SearchError(
                        f"'{path}' and '{other}', which is inside it, are both varied"
                    )

    def _try_bounds(self) -> None:
        """Set each bound and option once, so that an invalid one is reported before the search."""
        for number, parameter in enumerate(self.parameters):
            if parameter.targets and parameter.name.startswith("cages."):
                continue
            kind = parameter.kind
            for coordinate in kind.levels if isinstance(kind, Choice) else (kind.low, kind.high):
                point = self.start.copy()
                point[number] = coordinate
                self._try(point, parameter.name)
        if any(parameter.name.startswith("cages.") for parameter in self.parameters):
            in_cages = np.array([name.startswith("cages.") for name in self.names])
            for bound in (self.lower, self.upper):
                self._try(np.where(in_cages, bound, self.start), "cages")

    def _try(self, point: FloatArray, where: str) -> None:
        try:
            checked(self.apply(point))
        except OptiSenseError as error:
            raise type(error)(error.message, where=where, hint=error.hint) from None


def checked(design: SensorDesign) -> SensorDesign:
    """Return a design after all checks of its fields; DesignError if a value does not fit."""
    return design._replaced(design._data(), where="the varied design")


def _may_nest(path: str) -> bool:
    """Return whether numbers may vary within the object at a path: a whole coating or camera."""
    return path.endswith((".library", ".model", ".material"))

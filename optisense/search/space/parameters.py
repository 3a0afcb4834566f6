"""Kinds of single parameters: a number between bounds, an integer, or one of several options."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from typing import Any

from optisense.errors import SearchError
from optisense.keyword_types import is_real, plain_numbers, set_plain_numbers
from optisense.search.space.design_variables import DesignVariable

MOST_STEPS = 1_000_000
"""Largest number of steps of one parameter in a grid; a larger number is a typing error."""


@dataclass(frozen=True)
class Continuous:
    """Number between two bounds.

    Attributes:
        low, high: bounds, both included, in the unit of the value.
        steps: number of values from `low` to `high` in a grid; None if no grid is meant.
    """

    low: float
    high: float
    steps: int | None = None

    def __post_init__(self) -> None:
        set_plain_numbers(self)
        check_bounds(self.low, self.high)
        if self.steps is not None:
            if isinstance(self.steps, bool) or not isinstance(self.steps, int) or self.steps < 2:
                raise SearchError(
                    f"the number of steps from {self.low:g} to {self.high:g} is {self.steps}",
                    hint="Give 2 or more; a value that does not change needs no parameter",
                )
            if self.steps > MOST_STEPS:
                raise SearchError(
                    f"the number of steps is {self.steps:,}; at most {MOST_STEPS:,} are allowed"
                )

    @property
    def levels(self) -> tuple[float, ...] | None:
        """Values of a grid, or None."""
        if self.steps is None:
            return None
        span = self.high - self.low
        last = self.steps - 1
        inner = [self.low + span * k / last for k in range(last)]
        return (*inner, self.high)


@dataclass(frozen=True)
class Integer:
    """Integer between two bounds, both included."""

    low: int
    high: int

    def __post_init__(self) -> None:
        set_plain_numbers(self)
        for bound in (self.low, self.high):
            if isinstance(bound, bool) or not isinstance(bound, int):
                raise SearchError(f"the bound {bound!r} of an integer is not a whole number")
        check_bounds(self.low, self.high)

    @property
    def levels(self) -> tuple[float, ...]:
        """All values."""
        return tuple(float(value) for value in range(self.low, self.high + 1))


@dataclass(frozen=True)
class Choice:
    """One of several options: names of materials or lights, colours, or any other values of the
    path.

    Attributes:
        options: values, all different.
        labels: name of each option; made from the values if omitted.
    """

    options: tuple[Any, ...]
    labels: tuple[str, ...] = ()

    def __init__(self, options: Iterable[Any], labels: Iterable[str] = ()) -> None:
        frozen = tuple(tuple(o) if isinstance(o, list) else o for o in map(plain_numbers, options))
        names = tuple(labels) or tuple(_label(option) for option in frozen)
        object.__setattr__(self, "options", frozen)
        object.__setattr__(self, "labels", names)
        if len(frozen) < 2:
            raise SearchError(
                "a choice needs two options or more",
                hint="A value that does not change needs no parameter",
            )
        if len(names) != len(frozen):
            raise SearchError(f"{len(frozen)} options have {len(names)} labels")
        for number, name in enumerate(names):
            if name in names[:number]:
                raise SearchError(f"the option '{name}' is given twice")

    @property
    def levels(self) -> tuple[float, ...]:
        """Indices of the options."""
        return tuple(float(number) for number in range(len(self.options)))

    @property
    def low(self) -> int:
        """Index of the first option."""
        return 0

    @property
    def high(self) -> int:
        """Index of the last option."""
        return len(self.options) - 1


@dataclass(frozen=True)
class Around:
    """Number that may move from its value in the design by a distance to either side.

    Attributes:
        reach: distance in the unit of the value; above 0.
        steps: see `Continuous`.
    """

    reach: float
    steps: int | None = None

    def __post_init__(self) -> None:
        set_plain_numbers(self)
        if not (math.isfinite(self.reach) and self.reach > 0.0):
            raise SearchError(f"the reach is {self.reach}, which is not a number above 0")

    def about(self, value: float) -> Continuous:
        """Return the bounds around a value."""
        return Continuous(value - self.reach, value + self.reach, self.steps)


@dataclass(frozen=True)
class CagePoints:
    """Control points of a cage: all of them, or some, or only some of their coordinates.

    It applies to the paths `cages.NAME.points` (mm) and `cages.NAME.blend` (the matrix A of the
    OptiSense paper, 0 to 1).

    Attributes:
        range: bounds of each coordinate, or distance by which it may move; (low, high) and (low,
            high, steps) are accepted too.
        points: indices of control points; None takes all.
        axes: letters of the coordinates that move.
        symmetry: "x", "y" or "z": mirror images across the middle of the cage's box along this axis
            move together, which halves the number of parameters. None leaves every point free.
    """

    range: Continuous | Around
    points: tuple[int, ...] | None = None
    axes: str = "xyz"
    symmetry: str | None = None

    def __init__(
        self,
        range: Continuous | Around | tuple[float, ...],
        points: Iterable[int] | None = None,
        axes: str = "xyz",
        symmetry: str | None = None,
    ) -> None:
        spec = as_specification(range)
        if not isinstance(spec, Continuous | Around):
            raise SearchError("cage points need bounds or a reach")
        if not axes or any(axis not in "xyz" for axis in axes):
            raise SearchError(f"'{axes}' are not axes", hint="Give some of x, y, z: 'xz'")
        if symmetry is not None and symmetry not in ("x", "y", "z"):
            raise SearchError(f"there is no symmetry '{symmetry}'", hint="Give x, y or z")
        object.__setattr__(self, "range", spec)
        object.__setattr__(self, "points", None if points is None else plain_numbers(tuple(points)))
        object.__setattr__(self, "axes", axes)
        object.__setattr__(self, "symmetry", symmetry)


Single = Continuous | Integer | Choice
"""Specification of one parameter of a bound space."""


@dataclass(frozen=True)
class Together:
    """One parameter for all values that a path with a star stands for, as on a symmetric sensor.

    Attributes:
        range: bounds or options that the values share, or the distance by which lights may move;
            the short forms of `as_specification` are accepted too.
    """

    range: Single | Around

    def __init__(self, range: Single | Around | tuple[float, ...] | list[Any]) -> None:
        spec = as_specification(range)
        if isinstance(spec, CagePoints | Together):
            raise SearchError("what varies together needs bounds, options or a reach")
        object.__setattr__(self, "range", spec)


Specification = Single | Around | CagePoints | Together
"""Specification that a user gives for one path; some stand for many parameters."""


def as_specification(value: object) -> Specification:
    """Parse the short forms: (low, high), (low, high, steps), also as an array, or a list of
    options.

    Raises:
        SearchError: the value has another form, or its bounds are empty, reversed or not finite.
    """
    if isinstance(value, Continuous | Integer | Choice | Around | CagePoints | Together):
        return value
    plain = plain_numbers(value)
    if isinstance(plain, tuple) and len(plain) in (2, 3) and all(map(is_real, plain)):
        return Continuous(float(plain[0]), float(plain[1]), *plain[2:])
    if isinstance(plain, list):
        return Choice(plain)
    raise SearchError(
        f"{value!r} is not a specification of a parameter",
        hint="Give (low, high), Integer(low, high), Choice([...]), Around(reach), CagePoints or "
        "Together",
    )


def check_bounds(low: float, high: float) -> None:
    """Raise SearchError if bounds are not finite, empty or reversed; the message says which."""
    if not (math.isfinite(low) and math.isfinite(high)):
        raise SearchError(f"the bounds {low:g} to {high:g} are not finite")
    if low > high:
        raise SearchError(
            f"the bounds are reversed: {low:g} is above {high:g}",
            hint=f"Give {high:g} first and {low:g} second",
        )
    if low == high:
        raise SearchError(
            f"the bounds {low:g} to {high:g} are empty",
            hint="Widen them; a value that does not change needs no parameter",
        )


_KINDS = {
    "choice": Choice,
    "integer": Integer,
    "around": Around,
    "continuous": Continuous,
    "together": Together,
    "cage-points": CagePoints,
}
"""Specifications by their names in files."""


def to_plain(spec: Specification) -> dict[str, Any]:
    """Return a specification as values ready for JSON."""
    name = next(name for name, kind in _KINDS.items() if type(spec) is kind)
    return {"kind": name, **{each.name: _plain(getattr(spec, each.name)) for each in fields(spec)}}


def _plain(value: Any) -> Any:
    if isinstance(value, tuple):
        return [_plain(each) for each in value]
    return to_plain(value) if isinstance(value, Continuous | Integer | Choice | Around) else value


def from_plain(data: Mapping[str, Any]) -> Specification:
    """Return the specification for values of `to_plain`; SearchError for other values."""
    try:
        given = dict(data)
        kind = _KINDS[given.pop("kind")]
        if kind in (Together, CagePoints):
            given["range"] = from_plain(given["range"])
        return kind(**given)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise SearchError(f"a parameter can't be read: {error}", where=str(data)[:80]) from None


def _label(option: object) -> str:
    if isinstance(option, tuple):
        return ",".join(_label(item) for item in option)
    return f"{option:g}" if isinstance(option, float) else str(option)


@dataclass(frozen=True)
class Target:
    """Value that follows a parameter: `scale` times it plus `offset` (choices: as they are)."""

    path: str
    scale: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True)
class Parameter:
    """Single number or name that a search may change.

    Attributes:
        name: dotted path of the parameter; unique in a space.
        kind: bounds or options.
        start: value in the design, as a coordinate (see `BoundSpace`), within the bounds.
        targets: values of the design that follow the parameter; empty if it has a variable.
        variable: design variable that it changes, if it changes more than values.
        asked: path as the user gave it.
    """

    name: str
    kind: Single
    start: float
    targets: tuple[Target, ...] = ()
    variable: DesignVariable | None = None
    asked: str = ""

    @property
    def paths(self) -> list[str]:
        """Paths of all that the parameter sets."""
        if self.variable is not None:
            return self.variable.paths
        return [target.path for target in self.targets]


def within(value: float, kind: Single) -> float:
    """Return the number nearest to a value within the bounds of a kind."""
    return min(max(value, float(kind.low)), float(kind.high))

"""Manufacturing errors: differences between a manufactured sensor and its design."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from optisense.array_types import FloatArray
from optisense.design import SensorDesign, set_value
from optisense.errors import DesignError, SearchError
from optisense.keyword_types import set_plain_numbers
from optisense.near import suggestion
from optisense.search.space._expansion import expand
from optisense.search.space.parameters import Around, CagePoints, Continuous, Parameter
from optisense.search.space.search_space import BoundSpace, SearchSpace

TRUNCATION = 3.0
"""Truncation of the normal distribution of errors, in standard deviations. Parts with larger
errors, 0.3 % of all, are assumed to fail the manufacturer's inspection.
"""

SAMPLES = 8
"""Default number of sensors with random manufacturing errors per trial: few enough for a search,
and enough for the tenth percentile, which lies between the two worst of eight.
"""

ALL_LIGHTS = {"position": "shift", "angle": "turn"}
"""Fields of each light that `lights.position` and `lights.angle`, also of a group, stand for."""


@dataclass(frozen=True)
class ToleranceDistribution:
    """Distribution of the error of one value.

    Attributes:
        size: standard deviation of a normal distribution, or limit of a uniform one, in the value's
            unit (mm, degrees).
        kind: "normal" (truncated at three standard deviations) or "uniform" (all errors up to the
            limit are equally likely).
    """

    size: float
    kind: Literal["normal", "uniform"] = "normal"

    def __post_init__(self) -> None:
        set_plain_numbers(self)
        if not (np.isfinite(self.size) and self.size > 0.0):
            raise SearchError(f"an error of {self.size} is not a number above 0")
        if self.kind not in ("normal", "uniform"):
            raise SearchError(
                f"there is no distribution '{self.kind}'", hint="Known: normal, uniform"
            )

    @property
    def reach(self) -> float:
        """Largest error, in the value's unit."""
        return self.size * (TRUNCATION if self.kind == "normal" else 1.0)

    def errors(self, share: FloatArray) -> FloatArray:
        """Return errors (...), in the value's unit: the quantile function of the distribution.

        Args:
            share: values (...) of the distribution function, 0 to 1.
        """
        if self.kind == "uniform":
            return np.asarray((2.0 * share - 1.0) * self.size)
        from scipy.stats import truncnorm  # takes a second to load

        return np.asarray(truncnorm.ppf(share, -TRUNCATION, TRUNCATION) * self.size)


UNITS = {
    "position": "mm",
    "shift": "mm",
    "points": "mm",
    "size": "mm",
    "angle": "°",
    "turn": "°",
    "fov": "°",
    "cutoff": "°",
    "beam": "°",
    "flux": "mW",
}
"""Unit by the last step of a path; all other quantities are plain numbers."""


def unit_of(path: str) -> str:
    """Return the unit of the value at a path, such as ``mm``; empty for a plain number."""
    names = [re.sub(r"\[\d+\]$", "", step) for step in path.split(".")]
    while len(names) > 1 and names[-1] in ("x", "y", "z", "r", "g", "b"):
        names.pop()
    return UNITS.get(names[-1], "")


class ManufacturingErrors:
    """Distributions of the errors of values, by path.

    A path is one that may be varied (a number, a vector, the points of a cage, the shift or turn of
    a group, a part or the camera), or `lights.position` and `lights.angle` for each light by
    itself, of all groups or as `lights.GROUP.position` of one.
    """

    def __init__(self, distributions: Mapping[str, ToleranceDistribution | float]) -> None:
        """Store the distributions; a plain number is a standard deviation.

        Raises:
            SearchError: there is none, or a size is not above 0.
        """
        self.distributions: dict[str, ToleranceDistribution] = {}
        for path, given in distributions.items():
            try:
                self.distributions[path] = (
                    given
                    if isinstance(given, ToleranceDistribution)
                    else ToleranceDistribution(float(given))
                )
            except SearchError as error:
                raise SearchError(error.message, where=path, hint=error.hint) from None
        if not self.distributions:
            raise SearchError(
                "there are no manufacturing errors",
                hint="Name the path of a value and the size of its error",
            )

    @property
    def sources(self) -> list[str]:
        """Paths, as given."""
        return list(self.distributions)

    def bind(self, design: SensorDesign) -> BoundManufacturingErrors:
        """Return the errors for one design.

        Raises:
            DesignError: a path names nothing in the design; the message suggests a similar name.
            SearchError: the value at a path takes no error, or has two.
        """
        return BoundManufacturingErrors(self, design)

    def to_plain(self) -> dict[str, Any]:
        """Return the distributions as values ready for JSON."""
        return {path: [each.kind, each.size] for path, each in self.distributions.items()}

    @staticmethod
    def from_plain(data: Mapping[str, Any]) -> ManufacturingErrors:
        """Return the errors for values of `to_plain`; release 0.1 wrote "even" for "uniform"."""
        return ManufacturingErrors(
            {
                path: ToleranceDistribution(size, "uniform" if kind == "even" else kind)
                for path, (kind, size) in data.items()
            }
        )


class BoundManufacturingErrors:
    """Manufacturing errors for one design.

    Attributes:
        sources: paths as given.
        owner: index (d,) of the source of each erroneous number.
        space: space of these numbers, within the limits of the design.
    """

    def __init__(self, errors: ManufacturingErrors, design: SensorDesign) -> None:
        """See `ManufacturingErrors.bind`."""
        self.sources = errors.sources
        self._distributions = [errors.distributions[source] for source in self.sources]
        ranges: dict[str, Any] = {}
        owner: list[int] = []
        prepared = design
        for number, (source, spread) in enumerate(errors.distributions.items()):
            for path in _paths(design, source):
                around = Around(spread.reach)
                whole = re.fullmatch(r"cages\.[^.]+\.points", path)
                prepared, found = expand(prepared, path, CagePoints(around) if whole else around)
                for each in found:
                    if each.name in ranges:
                        raise SearchError(
                            f"'{each.name}' has two manufacturing errors", where=source
                        )
                    ranges[each.name] = _limits(prepared, each, source)
                owner += [number] * len(found)
        self.owner = np.array(owner)
        self.space = BoundSpace(SearchSpace(ranges), prepared, tried=False)

    @property
    def size(self) -> int:
        """Number of values with errors, d."""
        return len(self.owner)

    def errors(self, shares: FloatArray) -> FloatArray:
        """Return errors (k, d), in the unit of each value, for shares (k, d) from 0 to 1."""
        columns = [
            self._distributions[owner].errors(shares[:, k])
            for k, owner in enumerate(self.owner.tolist())
        ]
        return np.stack(columns, axis=1)

    def apply(self, errors: FloatArray) -> SensorDesign:
        """Return the design with these errors (d,); values beyond a limit of the design are clipped
        to it.
        """
        return self.space.apply(self.points(errors))

    def points(self, errors: FloatArray) -> FloatArray:
        """Return points (..., d) of the space for errors (..., d), clipped to the limits."""
        return np.clip(self.space.start + errors, self.space.lower, self.space.upper)


def latin_hypercube(count: int, size: int, seed: int) -> FloatArray:
    """Return shares (count, size) from 0 to 1, each column spread evenly over its range (Latin
    hypercube: McKay, Beckman and Conover, "A comparison of three methods for selecting values of
    input variables", 1979).
    """
    from scipy.stats import qmc

    shares = qmc.LatinHypercube(size, seed=np.random.default_rng([seed, size])).random(count)
    return np.clip(shares, 1e-9, 1.0 - 1e-9)


def _paths(design: SensorDesign, source: str) -> list[str]:
    """Return the paths that a source names: itself, or one path per light."""
    match = re.fullmatch(r"lights(?:\.([^.\[\]]+))?\.(position|angle)", source)
    if match is None:
        section, _, name = source.partition(".")
        if section == "lights" and "." not in name and name not in design.lights:
            raise DesignError(
                f"the path '{source}' does not exist",
                hint=suggestion(name, [*ALL_LIGHTS, *design.lights]),
            )
        return [source]
    group, what = match.groups()
    if group is not None and group not in design.lights:
        raise DesignError(
            f"the path '{source}' does not exist: there is no light group '{group}'",
            hint="Known: " + ", ".join(design.lights),
        )
    return [
        f"lights.{name}.lights[{index}].{ALL_LIGHTS[what]}"
        for name in (design.lights if group is None else [group])
        for index in range(len(design.lights[name].lights))
    ]


def _limits(design: SensorDesign, parameter: Parameter, source: str) -> Continuous | Around:
    """Return the range of a value with errors, clipped where the design refuses it."""
    kind = parameter.kind
    if not isinstance(kind, Continuous):
        raise SearchError("a whole number or a name has no manufacturing error", where=source)
    if parameter.variable is not None or parameter.name.startswith("cages."):
        return kind
    name, now = parameter.name, parameter.start
    low = _farthest(design, name, now, kind.low)
    high = _farthest(design, name, now, kind.high)
    if low >= high:
        raise SearchError(
            "the design allows only one value here, so it can't have an error", where=source
        )
    return Continuous(low, high)


def _farthest(design: SensorDesign, path: str, now: float, wanted: float) -> float:
    """Return the value nearest to `wanted` that the design accepts, by bisection."""
    if _fits(design, path, wanted):
        return wanted
    good, bad = now, wanted
    for _ in range(50):
        middle = 0.5 * (good + bad)
        if _fits(design, path, middle):
            good = middle
        else:
            bad = middle
    return good


def _fits(design: SensorDesign, path: str, value: float) -> bool:
    try:
        set_value(design, path, value)
    except DesignError:
        return False
    return True

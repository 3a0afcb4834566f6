"""Conditions that a good design must meet, such as ``coverage >= 0.55``.

Designs that break a condition are scored all the same, because a search learns from them in which
direction the feasible designs are. They are compared by the rules of Deb, "An efficient constraint
handling method for genetic algorithms", 2000: a design that meets all conditions is better than one
that does not; of two feasible designs the one with the higher score is better; of two infeasible
designs the one with the smaller violation is better.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache

from optisense.errors import ObjectiveError, SearchError
from optisense.near import suggestion
from optisense.objectives.combined import objective_of
from optisense.objectives.expressions import Expression, marked
from optisense.objectives.named import named_in
from optisense.objectives.registry import OBJECTIVES, Objective

ROUNDING = 1e-9
"""Relative tolerance for limits: a value that misses its limit by less than this share of the limit
meets it. It covers rounding errors of float64 sums.
"""

HINT = "Write it as in 'coverage>=0.55' or 'distortion<=1.5'"


@dataclass(frozen=True)
class Requirement:
    """Condition on a quantity that can be measured for every design.

    Attributes:
        quantity: the objective or expression that is limited.
        at_least: True if the limit is the lowest allowed value, False if it is the highest.
        limit: limit, in the unit of the quantity.
    """

    quantity: str
    at_least: bool
    limit: float

    def __str__(self) -> str:
        return f"{self.quantity} {'>=' if self.at_least else '<='} {self.limit:.10g}"

    @staticmethod
    @lru_cache(maxsize=256)  # all trials of a study have the same few
    def parse(text: str) -> Requirement:
        """Parse a condition. The SearchError about a text that is no condition marks the place in
        it that is wrong.
        """
        found = re.fullmatch(r"(?P<what>[^<>=]*)(?P<sign>>=|<=)(?P<limit>[^<>=]*)", text)
        if found is None:
            raise _without_comparison(text)
        try:
            limit = float(found["limit"])
        except ValueError:
            limit = math.nan
        if not math.isfinite(limit):
            raise _without_limit(text, found)
        if not found["what"].strip():
            raise _error_at(text, 0, f"nothing is named before '{found['sign']}'")
        try:
            quantity = Expression.parse(found["what"]).text
        except ObjectiveError as error:
            raise SearchError(error.message, hint=error.hint) from None
        return Requirement(quantity, found["sign"] == ">=", limit)

    def violation(self, value: float) -> float:
        """Return the violation of the limit by a value, as a share of the limit; 0 if it meets it.

        A limit of 0 counts as 1. NaN gives infinity.
        """
        if math.isnan(value):
            return math.inf
        short = self.limit - value if self.at_least else value - self.limit
        missed = short / (abs(self.limit) or 1.0)
        return missed if missed > ROUNDING else 0.0

    def margin(self, value: float) -> float:
        """Return the distance of a value from the limit, in its unit, positive if it is allowed."""
        return value - self.limit if self.at_least else self.limit - value

    def objective(self) -> Objective:
        """Return the objective that measures the quantity; SearchError if there is none."""
        try:
            for name in named_in([self.quantity]):
                if name not in OBJECTIVES:
                    problem = f"there is no objective '{name}', which the condition '{self}' names"
                    raise SearchError(problem, hint=suggestion(name, OBJECTIVES.names()))
            return objective_of(self.quantity)
        except ObjectiveError as error:
            raise SearchError(error.message, where=str(self), hint=error.hint) from None


def _error_at(text: str, place: int, problem: str, hint: str = HINT) -> SearchError:
    """Return the error of a condition, which marks a place in its text."""
    return SearchError(marked(text, place, problem).message, hint=hint)


def _without_comparison(text: str) -> SearchError:
    """Return the error of a condition that does not compare a quantity with a number."""
    signs = list(re.finditer(r"[<>=]+", text))
    if not signs:
        problem = "a condition needs '>=' or '<=' and a number"
        hint = f"{HINT}, with the quotes: without them the shell takes what follows '>' or '<'"
        return _error_at(text, len(text.rstrip()), problem, hint)
    wrong = signs[1] if len(signs) > 1 and signs[0][0] in (">=", "<=") else signs[0]
    return _error_at(text, wrong.start(), "a condition has one '>=' or '<='")


def _without_limit(text: str, found: re.Match[str]) -> SearchError:
    """Return the error of a condition whose right side is not a finite number."""
    place = found.start("limit")
    number = re.match(r"\s*[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?\s*", found["limit"])
    if number is not None:
        hint = "Give the number alone"
        unit = _unit_of(found["what"])
        if found["limit"][number.end() :].strip() == "%":
            hint += f", which is {float(number[0]) / 100:g} for {number[0].strip()} %"
        elif unit:
            hint += f", in {unit}"
        problem = "the limit of a condition is a number without a unit"
        return _error_at(text, place + number.end(), problem, hint)
    problem, hint = "the limit of a condition is a number", HINT
    try:
        limit = float(found["what"])
    except ValueError:
        place += len(found["limit"]) - len(found["limit"].lstrip())
    else:
        other = "<=" if found["sign"] == ">=" else ">="
        problem = "the limit of a condition stands on its right side"
        hint = f"Write it as '{found['limit'].strip()}{other}{limit:g}'"
    return _error_at(text, place, problem, hint)


def _unit_of(quantity: str) -> str:
    """Return the unit of an objective, or an empty text if nothing is known about it."""
    try:
        return objective_of(quantity.strip()).unit
    except ObjectiveError:
        return ""


def requirements_of(texts: Iterable[str]) -> list[Requirement]:
    """Parse several conditions, and drop duplicates.

    Raises:
        SearchError: a text is no condition, names no objective, contradicts another, or can't be
            met by any design.
    """
    found = list(dict.fromkeys(Requirement.parse(text) for text in texts))
    for each in found:
        _refuse_impossible(each)
    for low in (each for each in found if each.at_least):
        for high in (each for each in found if not each.at_least):
            if low.quantity == high.quantity and low.limit > high.limit:
                raise SearchError(f"no design can meet both '{low}' and '{high}'")
    return found


def _refuse_impossible(wanted: Requirement) -> None:
    """Raise SearchError if a quantity is unknown, or if its range excludes the limit
    whatever the settings are.
    """
    measured = wanted.objective()
    if callable(measured.range):
        return
    low, high = measured.bounds()
    if (wanted.limit > high) if wanted.at_least else (wanted.limit < low):
        raise SearchError(
            f"no design can meet '{wanted}': {wanted.quantity} is from {low:g} to {high:g}",
            hint="Give a limit within this range",
        )


def total_violation(conditions: Mapping[str, float | None]) -> float:
    """Return the sum of the violations of all conditions of a design, for the value of the limited
    quantity by the text of each condition; None where it could not be measured.
    """
    return sum(
        Requirement.parse(text).violation(math.nan if value is None else value)
        for text, value in conditions.items()
    )

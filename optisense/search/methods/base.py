"""The base class of search methods, which propose points and receive their scores, by generation.

A method must be a function of its problem, its options and what it was told, and of nothing else:
a study that was killed is resumed by telling a new instance again what the old one knew. So no
state has to be saved (and none from a stranger has to be unpickled), and a resumed study goes on
with exactly the generation that the other would have had.
"""

from __future__ import annotations

import zlib
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from optisense.errors import SearchError
from optisense.search.evaluation.evaluator import DesignEvaluator, Evaluator
from optisense.search.evaluation.outcome import Outcome
from optisense.search.space.search_space import BoundSpace

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


@dataclass(frozen=True)
class Problem:
    """The problem that a method solves.

    Attributes:
        space: the points it may propose.
        objectives: names of the goals; methods for one goal maximise the first.
        requirements: conditions that the best design must meet, as texts.
        budget: how many trials there may be; a method need not use them all.
        seed: of its random numbers.
    """

    space: BoundSpace
    objectives: tuple[str, ...]
    budget: int
    seed: int = 0
    requirements: tuple[str, ...] = ()

    def random(self, name: str) -> np.random.Generator:
        """Random numbers of a method's own."""
        return np.random.default_rng([self.seed, zlib.crc32(name.encode())])


class Method(ABC):
    """A way to search. Options are keyword arguments of the constructor.

    Class attributes:
        name: on the command line.
        summary: what it does, in one line.
        several: whether it looks for the best trade-offs between several goals.
        renders_once: whether all trials of a seed share their images.
    """

    name: ClassVar[str]
    summary: ClassVar[str]
    several: ClassVar[bool] = False
    renders_once: ClassVar[bool] = False

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.space = problem.space
        if self.several and len(problem.objectives) < 2:
            raise SearchError(
                f"{self.name} weighs several objectives against each other",
                hint="Name two or more, or use a method for one",
            )

    @classmethod
    def usual_budget(cls, space: BoundSpace) -> int:
        """How many trials there are when the user names no number.

        Raises:
            SearchError: the space does not fit the method.
        """
        return max(100, 20 * space.size)

    @abstractmethod
    def ask(self) -> FloatArray:
        """The next generation: (k, n) points of the space. None at all ends the search."""

    @abstractmethod
    def tell(self, vectors: FloatArray, outcomes: Sequence[Outcome]) -> None:
        """Receive the outcomes of the whole generation (k, n), in the order of its points."""

    def evaluator(self, usual: DesignEvaluator) -> Evaluator:
        """The evaluator of the points; a method with a faster or richer one returns its own."""
        return usual

    def describe(self) -> dict[str, Any]:
        """Facts about the state for progress and reports, ready for JSON."""
        return {}

    def notes(self) -> list[str]:
        """Notes for the user at the end of the search."""
        return []


def values_to_maximise(outcomes: Sequence[Outcome], objective: str) -> FloatArray:
    """(k,) values of a generation in the order of `rank_of`.

    Trials that meet all conditions have their scores. Those that break one follow below the worst
    of these, the farther the more they break it, and failed ones are the last. NaN for all if all
    failed.
    """
    values = np.array([outcome.scores.get(objective, np.nan) for outcome in outcomes])
    failed = ~np.isfinite(values)
    broken = np.array([outcome.breach for outcome in outcomes])
    _put_below(values, ~failed & (broken > 0.0), ~failed & (broken == 0.0), broken)
    _put_below(values, failed, ~failed, np.zeros(len(values)))
    return values


def _put_below(values: FloatArray, lower: BoolArray, upper: BoolArray, amounts: FloatArray) -> None:
    """Give some values (k,) new ones below some others, which are kept, by falling amounts (k,)."""
    if not lower.any():
        return
    if not upper.any():
        if amounts[lower].any():
            values[lower] = -amounts[lower]
        return
    worst, best = values[upper].min(), values[upper].max()
    step = max(best - worst, 1e-3 * abs(worst), 1e-9)
    most = amounts[lower].max()
    values[lower] = worst - step * (1.0 + (amounts[lower] / most if most > 0.0 else 0.0))

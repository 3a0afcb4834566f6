"""The base class of search methods, which propose points and receive their scores, by generation.

The proposals of a method depend on its problem, its options and the outcomes that it was told, and
on nothing else: a killed study is resumed by telling a new instance the outcomes of the old one. So
no state has to be saved (and none from a stranger has to be unpickled), and a resumed study
continues with exactly the generation that the interrupted one would have had.
"""

from __future__ import annotations

import zlib
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from optisense.array_types import BoolArray, FloatArray
from optisense.errors import SearchError
from optisense.search.evaluation.evaluator import DesignEvaluator, Evaluator
from optisense.search.evaluation.outcome import Outcome
from optisense.search.space.search_space import BoundSpace


@dataclass(frozen=True)
class Problem:
    """Problem that a method solves.

    Attributes:
        space: space of the points that the method may propose.
        objectives: names of the goals; methods for one goal maximise the first.
        requirements: conditions that the best design must meet, as texts.
        budget: number of trials to plan for. A method need not use them all; the study ends at its
            budget, and a resumed study may have a larger one than this.
        seed: seed of the method's random numbers.
    """

    space: BoundSpace
    objectives: tuple[str, ...]
    budget: int
    seed: int = 0
    requirements: tuple[str, ...] = ()

    def random(self, name: str) -> np.random.Generator:
        """Return a random generator that belongs to the method of this name."""
        return np.random.default_rng([self.seed, zlib.crc32(name.encode())])


class Method(ABC):
    """Base class of search methods. Options are keyword arguments of the constructor.

    Class attributes:
        name: name of the method on the command line.
        summary: description in one line.
        multi_objective: whether the method looks for the best trade-offs between several goals.
        renders_once: whether all trials of a seed share their images.
        accepts_coarse_scores: whether it only compares the scores of trials, so that coarse scores
            can guide it.
    """

    name: ClassVar[str]
    summary: ClassVar[str]
    multi_objective: ClassVar[bool] = False
    renders_once: ClassVar[bool] = False
    accepts_coarse_scores: ClassVar[bool] = False

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.space = problem.space
        if self.multi_objective and len(problem.objectives) < 2:
            raise SearchError(
                f"the method {self.name} needs two or more objectives",
                hint="Name more objectives, or use another method",
            )

    @classmethod
    def default_budget(cls, space: BoundSpace) -> int:
        """Return the number of trials for a search without a given budget.

        Raises:
            SearchError: the space does not fit the method.
        """
        return max(100, 20 * space.size)

    @abstractmethod
    def ask(self) -> FloatArray:
        """Return the next generation, (k, n) points of the space; zero points end the search."""

    @abstractmethod
    def tell(self, vectors: FloatArray, outcomes: Sequence[Outcome]) -> None:
        """Receive the outcomes of the whole generation (k, n), in the order of its points."""

    def evaluator(self, usual: DesignEvaluator) -> Evaluator:
        """Return the evaluator of the points; a method with a faster or richer one overrides it."""
        return usual

    def notes(self) -> list[str]:
        """Return notes for the user at the end of the search."""
        return []


def values_to_maximise(outcomes: Sequence[Outcome], objective: str) -> FloatArray:
    """Return the values (k,) of a generation, ordered as by `rank_of`.

    Trials that meet all conditions have their scores as values. Those that break one get values
    below the worst of these, the lower the larger the violation, and failed ones get the lowest.
    All values are NaN if all trials failed.
    """
    values = np.array([outcome.scores.get(objective, np.nan) for outcome in outcomes])
    failed = ~np.isfinite(values)
    broken = np.array([outcome.violation for outcome in outcomes])
    _put_below(values, ~failed & (broken > 0.0), ~failed & (broken == 0.0), broken)
    _put_below(values, failed, ~failed, np.zeros(len(values)))
    return values


def _put_below(values: FloatArray, lower: BoolArray, upper: BoolArray, amounts: FloatArray) -> None:
    """Set values of some trials (k,) below those of some others, in the order of falling amounts
    (k,).
    """
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

"""CMA-ES: evolution with a normal distribution that learns the shape of the problem.

Hansen and Ostermeier, "Completely derandomized self-adaptation in evolution strategies", 2001;
the method of the OptiSense paper's shape search. The work is done by pycma.
"""

from __future__ import annotations

import math
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from importlib import import_module
from typing import Any

import numpy as np
from threadpoolctl import ThreadpoolController

from optisense.array_types import FloatArray
from optisense.errors import SearchError
from optisense.search.evaluation.outcome import Outcome
from optisense.search.methods.base import Method, Problem, values_to_maximise

MOST_POPULATION = 100_000
"""Largest population; a generation of so many trials takes days, so more is a typing error."""

LEAST_DIMENSIONS = 2
"""Smallest number of dimensions that pycma supports; smaller searches add idle ones."""


class CmaEs(Method):
    """CMA-ES from the design as it is, with restarts from random points after convergence.

    Numbers are searched in the unit cube of their bounds. Integers keep their own steps; pycma
    holds their spread wide enough to reach the next one. A choice is treated as the integer of its
    option, in the given order: for more than two options without a natural order, a grid over the
    choices is the better search.

    pycma does not support one dimension: it takes a scaling of one number for one that is not
    initialized yet, and fails where a bound is met. A search over one parameter therefore runs in
    two dimensions, the second of which has no effect.
    """

    name = "cma-es"
    summary = "evolution that learns the shape of the problem; for numbers, up to hundreds"
    accepts_coarse_scores = True

    def __init__(
        self,
        problem: Problem,
        *,
        population: int | None = None,
        sigma: float = 0.2,
        restarts: int | None = None,
    ) -> None:
        """Set up pycma's strategy.

        Args:
            population: points per generation; 4 + 3 ln n if None (Hansen's default), made even, so
                that two workers finish together.
            sigma: standard deviation of the first generation, as a share of each parameter's range.
            restarts: number of restarts from random points, each with twice the population (Auger
                and Hansen, "A restart CMA evolution strategy with increasing population size",
                2005); None restarts until the budget is spent.

        Raises:
            SearchError: an option is out of its range.
        """
        super().__init__(problem)
        if not 0.0 < sigma <= 1.0:
            raise SearchError(f"sigma is {sigma}", hint="Give a share of the range: 0 < sigma <= 1")
        if population is not None and not 2 <= population <= MOST_POPULATION:
            raise SearchError(
                f"the population is {population}", hint=f"Give 2 to {MOST_POPULATION:,}"
            )
        if restarts is not None and restarts < 0:
            raise SearchError(f"the number of restarts is {restarts}", hint="Give 0 or more")
        self.sigma = float(sigma)
        size = problem.space.size
        natural = 4 + math.floor(3 * math.log(size))
        self.population = population or natural + natural % 2
        self.restarts = restarts
        self.restarted = 0
        self._random = problem.random(self.name)
        # pycma draws from NumPy's global generator, which gets a state of its own while pycma runs.
        self._state = np.random.RandomState(int(self._random.integers(2**32))).get_state()
        whole = problem.space.discrete
        self._unit = np.where(whole, 1.0, problem.space.span)
        self._origin = np.where(whole, 0.0, problem.space.lower)
        self._idle = max(0, LEAST_DIMENSIONS - size)
        self._asked: list[FloatArray] = []
        self._begin(problem.space.start)

    def ask(self) -> FloatArray:
        """Return the next generation, (population, n)."""
        with self._own_randomness():
            if self._strategy.stop(ignore_list=("maxiter", "maxfevals", "timeout")):
                if self.restarts is not None and self.restarted >= self.restarts:
                    return np.empty((0, self.space.size))
                self.restarted += 1
                # A generation beyond the budget would never be finished, and teach pycma nothing.
                most = min(MOST_POPULATION, self.problem.budget + self.problem.budget % 2)
                self.population = max(self.population, min(2 * self.population, most))
                self._begin(self.space.from_unit(self._random.random(self.space.size)))
            self._asked = self._strategy.ask()
        return self._point(np.array(self._asked))

    def tell(self, vectors: FloatArray, outcomes: Sequence[Outcome]) -> None:
        """Update the distribution with a generation (k, n), unless all of its trials failed."""
        values = values_to_maximise(outcomes, self.problem.objectives[0])
        if np.isnan(values).any() or len(values) < len(self._asked):
            return
        solutions: Sequence[FloatArray] = self._asked
        if not np.array_equal(self._point(np.array(self._asked)), vectors):
            solutions = list(self._inner(vectors))  # a study begun by another version
        with self._own_randomness():
            self._strategy.tell(solutions, (-values).tolist())

    def _begin(self, start: FloatArray) -> None:
        cma = _pycma()
        lower, upper = self._inner(self.space.lower), self._inner(self.space.upper)
        lower[self.space.size :], upper[self.space.size :] = 0.0, 1.0
        whole = np.flatnonzero(self.space.discrete)
        # Bounds are half a step beyond the first and last integer, so that each has an equal share.
        lower[whole], upper[whole] = lower[whole] - 0.499, upper[whole] + 0.499
        spread = np.ones(self.space.size + self._idle)
        spread[whole] = self.space.span[whole]
        inner = self._inner(start)
        options: dict[str, Any] = {
            "bounds": [lower.tolist(), upper.tolist()],
            "CMA_stds": spread.tolist(),
            "popsize": self.population,
            "integer_variables": whole.tolist(),
            "seed": 1 + self.restarted,
            "verbose": -9,
            "verb_log": 0,
            "verb_disp": 0,
            "maxiter": math.inf,
        }
        if self.space.size == 1:
            # pycma 4.5 fails if it limits the only standard deviation; the bounds limit it already.
            options["maxstd"] = math.inf
        with self._own_randomness(), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            before = np.random.get_state()
            self._strategy = cma.CMAEvolutionStrategy(inner.tolist(), self.sigma, options)
            np.random.set_state(before)

    def _inner(self, vectors: FloatArray) -> FloatArray:
        """Return points (..., n) in pycma's coordinates: numbers 0 to 1, integers as they are, and
        0.5 for each idle dimension.
        """
        points = (np.asarray(vectors) - self._origin) / self._unit
        idle = np.full((*points.shape[:-1], self._idle), 0.5)
        return np.concatenate([points, idle], axis=-1)

    def _point(self, inner: FloatArray) -> FloatArray:
        """Return points (k, n) of the space for pycma's, which lack idle dimensions."""
        point = self._origin + inner[:, : self.space.size] * self._unit
        point = np.where(self.space.discrete, np.round(point), point)
        return np.clip(point, self.space.lower, self.space.upper)

    @contextmanager
    def _own_randomness(self) -> Iterator[None]:
        """Set NumPy's global generator to this method's state and limit linear algebra to one
        thread until the end of the block.
        """
        theirs = np.random.get_state()
        np.random.set_state(self._state)
        try:
            with _linear_algebra().limit(limits=1):
                yield
        finally:
            self._state = np.random.get_state()
            np.random.set_state(theirs)


@cache
def _linear_algebra() -> Any:
    """Return the limit on the threads of linear algebra, which takes milliseconds to look up. The
    matrices of pycma are small: threads only wait for each other, and round differently.
    """
    return ThreadpoolController().select(user_api="blas")


def _pycma() -> Any:
    """Import pycma without what it imports for plots and surrogate models, which are not used and
    would take three quarters of a second. It does without both where they are not installed.
    """
    unused = [name for name in ("matplotlib", "scipy.stats") if name not in sys.modules]
    for name in unused:
        sys.modules[name] = None  # type: ignore[assignment]  # an import then raises ImportError
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # that it can't plot
            return import_module("cma")
    finally:
        for name in unused:
            del sys.modules[name]

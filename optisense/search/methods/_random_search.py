"""Search by points spread evenly: a baseline that shows how a score depends on all parameters."""

from __future__ import annotations

from collections.abc import Sequence

from optisense.array_types import FloatArray
from optisense.search.evaluation.outcome import Outcome
from optisense.search.methods.base import Method, Problem

GENERATION = 64
"""Number of points that are drawn together, which keeps all workers busy; a power of two, as
Sobol's sequence is balanced after those."""


class Random(Method):
    """Scrambled Sobol points: random, and more evenly spread than independent draws
    (Owen, "Scrambled net variance for integrals of smooth functions", 1997).
    """

    name = "random"
    summary = "points spread evenly over the space"
    accepts_coarse_scores = True

    def __init__(self, problem: Problem) -> None:
        from scipy.stats import qmc  # takes half a second to load

        super().__init__(problem)
        self._points = qmc.Sobol(problem.space.size, seed=problem.random(self.name))

    def ask(self) -> FloatArray:
        """Return the next points, (k, n)."""
        return self.space.from_unit(self._points.random(GENERATION))

    def tell(self, vectors: FloatArray, outcomes: Sequence[Outcome]) -> None:
        """Ignore the outcomes of a generation (k, n): random search does not learn."""

"""Search for the best trade-offs between several goals: NSGA-II.

Deb, Pratap, Agarwal and Meyarivan, "A fast and elitist multiobjective genetic algorithm: NSGA-II",
2002; simulated binary crossover and polynomial mutation as there (and Deb and Agrawal, "Simulated
binary crossover for continuous search space", 1995). Whole numbers are inherited from either
parent and mutate to any other value.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import FloatArray
from optisense.errors import SearchError
from optisense.search.evaluation.outcome import Outcome
from optisense.search.methods.base import Method, Problem
from optisense.search.methods.dominance import crowding, ranks

CROSSOVER_SPREAD = 15.0
"""Distribution index of the crossover; larger values keep children nearer to their parents. 15 and
20 are the usual values for NSGA-II, such as the defaults of pymoo.
"""

MUTATION_SPREAD = 20.0
"""Distribution index of the mutation; 20 is that of Deb et al. (2002), and pymoo's default."""

CROSSOVER_CHANCE = 0.9
"""Probability that two parents are crossed, as Deb et al. (2002) use it for NSGA-II."""


class Pareto(Method):
    """NSGA-II over all objectives; failed trials lose against all others."""

    name = "pareto"
    summary = "the best trade-offs between two or more objectives"
    multi_objective = True

    def __init__(self, problem: Problem, *, population: int | None = None) -> None:
        """Set up the population and its size.

        Args:
            population: points per generation, even; 20 to 100 depending on the budget if None.

        Raises:
            SearchError: there is only one objective, or an option is out of its range.
        """
        super().__init__(problem)
        usual = int(np.clip(problem.budget // 10, 20, 100))
        self.population = usual + usual % 2 if population is None else population
        if self.population < 4 or self.population % 2:
            raise SearchError(
                f"the population is {population}", hint="Give an even number, 4 or more"
            )
        self._random = problem.random(self.name)
        self._genes = np.empty((0, self.space.size))
        self._values = np.empty((0, len(problem.objectives)))
        self._broken = np.empty(0)
        self._children = np.empty((0, self.space.size))

    def ask(self) -> FloatArray:
        """Return the next generation, (population, n)."""
        if not len(self._genes):
            from scipy.stats import qmc  # takes half a second to load

            cube = qmc.LatinHypercube(self.space.size, seed=self._random)
            self._children = cube.random(self.population)
            self._children[0] = self.space.unit_of(self.space.start)
        else:
            rank = ranks(self._values, self._broken)
            room = crowding(self._values, rank)
            mothers, fathers = self._winners(rank, room), self._winners(rank, room)
            children = self._crossed(self._genes[mothers], self._genes[fathers])
            self._children = self._mutated(children)
        return self.space.from_unit(self._children)

    def tell(self, vectors: FloatArray, outcomes: Sequence[Outcome]) -> None:
        """Keep the best of the parents and of the children (population, n)."""
        values = np.array(
            [
                [outcome.scores.get(name, np.nan) for name in self.problem.objectives]
                for outcome in outcomes
            ]
        )
        same = np.array_equal(self.space.from_unit(self._children), vectors)
        genes = self._children if same else self.space.unit_of(vectors)
        everyone = np.concatenate([self._genes, genes])
        scores = np.concatenate([self._values, values])
        broken = np.concatenate([self._broken, [outcome.violation for outcome in outcomes]])
        rank = ranks(scores, broken)
        best = np.lexsort((-crowding(scores, rank), rank))[: self.population]
        self._genes, self._values, self._broken = everyone[best], scores[best], broken[best]

    def _winners(self, rank: NDArray[np.int64], room: FloatArray) -> NDArray[np.int64]:
        """Return the winners of binary tournaments, (population / 2,): the better of two drawn."""
        pairs = self._random.integers(len(rank), size=(self.population // 2, 2))
        one, other = pairs.T
        first = (rank[one] < rank[other]) | (
            (rank[one] == rank[other]) & (room[one] >= room[other])
        )
        return np.where(first, one, other)

    def _crossed(self, mothers: FloatArray, fathers: FloatArray) -> FloatArray:
        """Return two children of each couple, (population, n)."""
        shape = mothers.shape
        draw = self._random.random(shape)
        power = 1.0 / (CROSSOVER_SPREAD + 1.0)
        spread = np.where(draw < 0.5, 2.0 * draw, 1.0 / (2.0 * (1.0 - draw))) ** power
        middle, half = (mothers + fathers) / 2.0, (fathers - mothers) / 2.0
        crossed = (self._random.random(shape) < 0.5) & (
            self._random.random((shape[0], 1)) < CROSSOVER_CHANCE
        )
        smooth = crossed & ~self.space.discrete
        swapped = crossed & self.space.discrete
        daughters = np.where(smooth, middle - spread * half, np.where(swapped, fathers, mothers))
        sons = np.where(smooth, middle + spread * half, np.where(swapped, mothers, fathers))
        return np.clip(np.concatenate([daughters, sons]), 0.0, 1.0)

    def _mutated(self, genes: FloatArray) -> FloatArray:
        chosen = self._random.random(genes.shape) < 1.0 / genes.shape[1]
        draw = self._random.random(genes.shape)
        exponent = MUTATION_SPREAD + 1.0
        power = 1.0 / exponent
        below = (2.0 * draw + (1.0 - 2.0 * draw) * (1.0 - genes) ** exponent) ** power - 1.0
        above = 1.0 - (2.0 * (1.0 - draw) + 2.0 * (draw - 0.5) * genes**exponent) ** power
        moved = np.clip(genes + np.where(draw < 0.5, below, above), 0.0, 1.0)
        anywhere = self._random.random(genes.shape)
        return np.where(chosen, np.where(self.space.discrete, anywhere, moved), genes)

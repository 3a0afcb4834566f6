"""Which trial is the best, and that ties are named as ties."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest

from optisense.cli.search_result import headline
from optisense.design import SensorDesign
from optisense.search.evaluation.outcome import Outcome
from optisense.search.space.search_space import BoundSpace, SearchSpace
from optisense.search.study.best import best_of, distance, front_among, tie_note, tied
from optisense.search.study.trial import Trial


@pytest.fixture(scope="module")
def space(mini: SensorDesign) -> BoundSpace:
    """The start is (0, 0, red): specularity, place, colour."""
    return SearchSpace(
        {
            "coating.specularity": (0.0, 1.0),
            "camera.position.x": (-2.0, 2.0),
            "lights.red.colour": ["red", "green", "blue"],
        }
    ).bind(mini)


def trial(space: BoundSpace, number: int, point: list[float], score: float) -> Trial:
    outcome = Outcome({"s": score}) if math.isfinite(score) else Outcome.of_failure(["s"], "no")
    generation = -1 if number == 0 else 0
    return Trial(number, generation, np.array(point), outcome, space, "s")


def test_the_distance_adds_up_shares_of_ranges(space: BoundSpace) -> None:
    assert distance(trial(space, 1, [0.3, 1.6, 0], 1.0)) == pytest.approx(0.5)
    assert distance(trial(space, 1, [0.0, 0.0, 2], 1.0)) == 1.0  # options are in no order


def test_of_equal_trials_the_nearest_to_the_start_is_the_best(space: BoundSpace) -> None:
    trials = [
        trial(space, 0, [0.0, 0.0, 0], 1.0),
        trial(space, 1, [0.9, 0.0, 0], 2.0),
        trial(space, 2, [0.1, 0.0, 0], 2.0),
        trial(space, 3, [0.1, 0.0, 0], 2.0),  # the same point again
        trial(space, 4, [0.0, 0.4, 0], 2.0),  # as near as trial 2, and proposed later
        trial(space, 5, [0.2, 0.0, 0], math.nan),
    ]
    for order in permutations(trials):
        best = best_of(order)
        assert best is not None and best.number == 2
        assert {each.number for each in tied(order)} == {1, 2, 4}
    note = tie_note(trials)
    assert note is not None
    assert note.startswith("3 trials share the best score; trial 2 is named the best")


def test_the_start_wins_ties(space: BoundSpace) -> None:
    trials = [trial(space, k, [0.1 * k, 0.0, 0], 1.0) for k in range(4)]
    trials.append(trial(space, 4, [0.9, 0.0, 0], 0.5))
    best = best_of(trials[::-1])
    assert best is not None and best.is_start
    assert "4 trials share the best score; the start" in str(tie_note(trials))
    assert "does not depend on the parameters" in str(tie_note(trials[:4]))


def test_scores_that_differ_by_rounding_are_equal(space: BoundSpace) -> None:
    """Dimming all lights alike changes a score of 0.97 by some 1e-9."""
    trials = [trial(space, 0, [0.0, 0.0, 0], 0.97333448846)]
    trials += [trial(space, k, [0.1 * k, 0.0, 0], 0.97333448846 + 3e-8 * k) for k in range(1, 4)]
    best = best_of(trials)
    assert best is not None and best.is_start
    assert len(tied(trials)) == 4
    trials.append(trial(space, 4, [0.9, 0.0, 0], 0.97334))
    best = best_of(trials)
    assert best is not None and best.number == 4
    assert tie_note(trials) is None


def test_rounding_puts_no_trial_on_the_front(space: BoundSpace) -> None:
    scores = [(1.0, 0.2785), (0.9, 0.27850001), (0.8, 0.3)]
    trials = [
        Trial(k, 0, np.array([0.1 * k, 0.0, 0]), Outcome({"s": a, "t": b}), space, "s")
        for k, (a, b) in enumerate(scores, 1)
    ]
    assert [each.number for each in front_among(trials, ["s", "t"])] == [1, 3]


def test_one_best_trial_is_no_tie(space: BoundSpace) -> None:
    trials = [trial(space, k, [0.1 * k, 0.0, 0], float(k)) for k in range(4)]
    assert tie_note(trials) is None
    assert tie_note([]) is None
    assert best_of([trial(space, 0, [0.0, 0.0, 0], math.nan)]) is None


def test_a_newer_trial_is_the_best_if_no_fresh_score_tells_about_it(space: BoundSpace) -> None:
    def found(number: int, score: float, newer: bool = False, fresh: float = math.nan) -> Trial:
        again = {7: Outcome({"s": fresh})} if math.isfinite(fresh) else {}
        made = trial(space, number, [0.1 * number, 0.0, 0], score)
        return replace(made, is_newer=newer, fresh=again)

    def best(*trials: Trial) -> int:
        chosen = best_of(trials)
        assert chosen is not None
        return chosen.number

    older = [found(0, 0.0, fresh=0.0), found(1, 2.0, fresh=1.0), found(2, 1.9)]
    assert best(*older, found(3, 3.0, newer=True)) == 3
    assert best(*older, found(3, 1.5, newer=True)) == 1
    assert best(*older, found(3, 3.0, newer=True, fresh=0.5), found(4, 2.5, newer=True)) == 1


def test_a_gain_within_the_noise_is_told(space: BoundSpace) -> None:
    def scored(number: int, scores: list[float]) -> Trial:
        fresh = {seed: Outcome({"s": score}) for seed, score in enumerate(scores)}
        return replace(trial(space, number, [0.1 * number, 0.0, 0], 2.0), fresh=fresh)

    start, best = scored(0, [0.97, 0.98, 0.99]), scored(1, [0.975, 0.985, 0.995])
    assert headline(best, start) == (
        "0.985 ± 0.01 with fresh seeds (start 0.98 ± 0.01); the gain is within the noise"
    )
    best = scored(1, [1.075, 1.085, 1.095])
    assert headline(best, start) == "1.085 ± 0.01 with fresh seeds (start 0.98 ± 0.01)"

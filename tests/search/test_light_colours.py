"""Colourings from one rendering are scored as renderings of their own, and all are found."""

from __future__ import annotations

import math
import pickle
from collections.abc import Iterator
from itertools import islice

import numpy as np
import pytest
from comparing import SCORE_ROUNDING

import optisense as ots
from optisense.design import SensorDesign
from optisense.errors import SearchError
from optisense.objectives import Evaluation, Objective
from optisense.search import Integer, SearchResult, SearchSpace, search
from optisense.search.evaluation.evaluator import DesignEvaluator
from optisense.search.evaluation.outcome import Outcome
from optisense.search.evaluation.relit import RelitEvaluator
from optisense.search.methods import Problem, find, make
from optisense.search.methods._lights import LightColours

COLOURS = {"lights.*.colour": ["red", "green", "blue"]}
QUICK = {"resolution": (200, 150), "photons": 100_000, "places": ((0.0, 0.0), (3.0, 2.0))}


def redness(evaluation: Evaluation) -> float:
    """A user's objective, which reads whole images."""
    seen = np.mean([press.response[..., 0].mean() for press in evaluation.presses])
    return float(seen + evaluation.untouched.radiance[..., 0].mean() * evaluation.exposure)


GOALS = ("rgb2normal", "normdiff", Objective("redness", redness, "Redness"))


@pytest.fixture(scope="module")
def result() -> SearchResult:
    """All 27 colourings of a GelSight Mini's three groups."""
    design = ots.load("gelsight-mini-ideal")
    return search(design, COLOURS, list(GOALS), method="light-colours", settings=QUICK)


def test_every_colouring_is_tried_once(result: SearchResult) -> None:
    tried = [tuple(trial.values.values()) for trial in result.trials if not trial.is_start]
    assert len(tried) == len(set(tried)) == 27
    assert result.ended == "the method has finished"


def test_a_colouring_scores_as_its_own_rendering(result: SearchResult) -> None:
    """The same seed traces the same light, so that only rounding errors differ."""
    usual = DesignEvaluator(result.study.space, GOALS, QUICK)
    tried = [trial for trial in result.trials if not trial.is_start]
    for trial in np.random.default_rng(2).choice(np.array(tried, dtype=object), 2, replace=False):
        direct = usual(trial.vector, result.study.settings.seed)
        assert direct.failure is None
        found, wanted = trial.scores, direct.scores
        assert found["rgb2normal"] == pytest.approx(wanted["rgb2normal"], abs=SCORE_ROUNDING)
        assert found["normdiff"] == pytest.approx(wanted["normdiff"], abs=0.3)
        assert found["redness"] == pytest.approx(wanted["redness"], rel=SCORE_ROUNDING)
        lines = [each.parts["rgb2normal"]["worst_line"] for each in (trial, direct)]
        assert lines[0] == pytest.approx(lines[1], abs=1e-3)


def test_colours_matter_and_their_names_hardly(result: SearchResult) -> None:
    """Swapping the three colours among themselves leaves the scores almost as they are: the
    aluminium of the coating is nearly grey.
    """
    scores: dict[tuple[int, ...], list[float]] = {}
    for trial in result.trials:
        if not trial.is_start:
            first_seen = list(dict.fromkeys(trial.vector.tolist()))
            kind = tuple(first_seen.index(number) for number in trial.vector.tolist())
            scores.setdefault(kind, []).append(trial.scores["normdiff"])
    assert sorted(map(len, scores.values())) == [3, 6, 6, 6, 6]
    within = max(np.ptp(each) for each in scores.values())
    among = np.ptp([np.mean(each) for each in scores.values()])
    assert within < 0.1 * among


def test_the_best_is_made_as_a_design(result: SearchResult) -> None:
    colours = [group.colour for group in result.best.design.lights.values()]
    assert len(set(colours)) > 1  # one colour for all would not tell normals apart
    assert math.isfinite(result.best.fresh_score())


def test_an_evaluator_travels_without_its_images(result: SearchResult) -> None:
    evaluator = RelitEvaluator(DesignEvaluator(result.study.space, ["rgb2normal"], QUICK))
    evaluator._images[0] = object()  # type: ignore[assignment]
    there = pickle.loads(pickle.dumps(evaluator))
    assert there.names == ["rgb2normal"]
    assert not there._images


class TestOrder:
    """Which colourings are proposed; scored by a formula, without images."""

    def problem(self, budget: int, steps: int = 0) -> Problem:
        varied: dict[str, object] = dict(COLOURS)
        if steps:
            varied["lights.*.flux"] = (1.0, 2.0, steps)
        space = SearchSpace(varied).bind(ots.load("gelsight-mini-ideal"))
        return Problem(space, ("score",), budget, seed=3)

    def drive(self, method: LightColours) -> Iterator[np.ndarray]:
        """Points with their scores told: best where all are at their highest coordinate."""
        while len(points := method.ask()):
            yield from points
            method.tell(points, [Outcome({"score": -np.abs(p - 2.0).sum()}) for p in points])

    def test_beyond_the_budget_it_climbs_to_the_best(self) -> None:
        method = LightColours(self.problem(120, steps=5))
        points = list(islice(self.drive(method), 120))
        assert method.size == 3**3 * 5**3
        assert len(points) == len({tuple(point) for point in points}) == 120
        assert max(-np.abs(point - 2.0).sum() for point in points) == 0.0

    def test_the_usual_budget_is_all_of_them(self) -> None:
        assert find("light-colours").default_budget(self.problem(1, steps=2).space) == 27 * 8


@pytest.mark.parametrize(
    ("varied", "message"),
    [
        ({"coating.specularity": (0.0, 1.0, 3)}, "colours and powers of light groups"),
        ({"lights.*.flux": (1.0, 2.0)}, "number of steps is needed"),
        ({"lights.*.model": ["osram-topled-black-30", "chanzon-5730"]}, "nothing else"),
        ({"camera.resolution[0]": Integer(100, 200)}, "nothing else"),
    ],
)
def test_other_spaces_are_refused(
    mini: SensorDesign, varied: dict[str, object], message: str
) -> None:
    space = SearchSpace(varied).bind(mini)
    with pytest.raises(SearchError, match=message):
        make("light-colours", Problem(space, ("score",), 100))


def test_a_star_stands_for_every_name(mini: SensorDesign) -> None:
    space = SearchSpace({"lights.*.flux": (1.0, 2.0)}).bind(mini)
    assert space.names == [f"lights.{name}.flux" for name in mini.lights]

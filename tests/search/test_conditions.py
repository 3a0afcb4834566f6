"""Searches with conditions: which trial is the best, what is said, and what is refused."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from optisense import set_value
from optisense.cli.verify import print_conditions
from optisense.design import SensorDesign
from optisense.errors import SearchError, UnknownPartError
from optisense.objectives.evaluation import Evaluation
from optisense.objectives.registry import WATCHED, forgetting, objective
from optisense.search import SearchResult, SearchSpace, Study, search
from optisense.search.evaluation.evaluator import DesignEvaluator
from optisense.search.evaluation.outcome import FAILED, Outcome, rank_of
from optisense.search.evaluation.requirements import Requirement, requirements_of
from optisense.search.evaluation.robust import RobustEvaluator
from optisense.search.methods.base import values_to_maximise
from optisense.search.methods.dominance import dominates, ranks
from optisense.search.space.manufacturing import ManufacturingErrors
from optisense.search.study._tally import ALL_FAIL, Tally
from optisense.search.study.best import best_of, nearest
from optisense.search.study.conditions import (
    condition_lines,
    condition_note,
    condition_results,
    unmet,
    worsened,
    worsened_note,
)
from optisense.search.study.progress import SearchProgress
from optisense.search.study.settings import LATER, StudySettings
from optisense.search.study.store import START, Row
from optisense.search.study.trial import Trial

RAYS: dict[str, Any] = {"ray_resolution": (64, 48)}
FOV = {"camera.fov": (40.0, 60.0, 6)}


def searched(design: SensorDesign, goal: Any = "aoap", **given: Any) -> SearchResult:
    """The result of a grid search over the field of view, unless other arguments are given."""
    usual = {"space": FOV, "method": "grid", "settings": RAYS}
    return search(design, objective=goal, **{**usual, **given})


@pytest.fixture(scope="module")
def free(mini: SensorDesign) -> SearchResult:
    """The result without conditions: a narrow view looks straight at the skin, but sees less."""
    return searched(mini)


def outcome(score: float, **conditions: float) -> Outcome:
    limits = {"coverage": "coverage >= 0.5", "distortion": "distortion <= 1.2"}
    parts = {"conditions": {limits[name]: value for name, value in conditions.items()}}
    failure = None if math.isfinite(score) else "no"
    return Outcome({"s": score}, failure, parts)


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("coverage>=0.55", "coverage >= 0.55"),
        (" Coverage  <= 1e-1 ", "coverage <= 0.1"),
        ("aoap.coverage_by_area+1>=-2", "aoap.coverage_by_area + 1 >= -2"),
    ],
)
def test_a_condition_is_read(text: str, shown: str) -> None:
    wanted = Requirement.parse(text)
    assert str(wanted) == shown
    assert Requirement.parse(shown) == wanted


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("coverage>0.5", "one '>=' or '<='"),
        ("coverage", "with the quotes"),
        ("0.1<=coverage<=0.5", "one '>=' or '<='"),
        ("coverage>=high", "is a number"),
        ("coverage>=nan", "is a number"),
        ("coverage>=0.5 mm", "without a unit"),
        ("power<=60 mW", "Give the number alone, in mW"),
        ("coverage>=55%", "which is 0.55 for 55 %"),
        (">=0.5", "nothing is named before '>='"),
        ("0.5<=coverage", "Write it as 'coverage>=0.5'"),
        ("coverage + distorsion <= 2", "no objective 'distorsion'"),
        ("cover age>=0.5", "not expected"),
        ("covrage>=0.5", "Did you mean 'coverage'"),
    ],
)
def test_what_is_no_condition_is_refused(text: str, says: str) -> None:
    with pytest.raises(SearchError, match=says):
        requirements_of([text])


def test_conditions_that_contradict_each_other_are_refused() -> None:
    with pytest.raises(SearchError, match="no design can meet both"):
        requirements_of(["coverage>=0.6", "coverage<=0.5"])
    for text in ("coverage>=2", "distortion <= 0.9"):
        with pytest.raises(SearchError, match="no design can meet"):
            requirements_of([text])
    assert len(requirements_of(["coverage>=0.5", "coverage >= 0.50"])) == 1


def test_a_violation_is_a_share_of_the_limit() -> None:
    low, high = Requirement.parse("coverage>=0.5"), Requirement.parse("distortion<=2")
    assert low.violation(0.4) == pytest.approx(0.2)
    assert low.violation(0.5 - 1e-12) == 0.0
    assert high.violation(2.5) == pytest.approx(0.25)
    assert high.violation(1.0) == 0.0
    assert high.margin(1.5) == 0.5
    assert low.violation(math.nan) == math.inf
    assert Requirement.parse("aoap>=0").violation(-0.25) == 0.25


def test_outcomes_are_ranked_by_conditions_before_scores() -> None:
    good, better = outcome(1.0, coverage=0.6), outcome(2.0, coverage=0.5)
    near, far = outcome(9.0, coverage=0.45), outcome(10.0, coverage=0.1, distortion=1.3)
    failed = outcome(math.nan)
    order = [failed, far, near, good, better]
    rank = [rank_of(each, "s") for each in order]
    assert rank == sorted(rank)
    assert rank[0] == FAILED
    assert list(np.argsort(values_to_maximise(order, "s"))) == [0, 1, 2, 3, 4]
    values = np.array([[9.0], [10.0], [1.0], [2.0]])
    broken = [each.violation for each in (near, far, good, better)]
    assert list(ranks(values, broken)) == [2, 3, 1, 0]
    assert dominates(values, broken)[2, 0]
    assert not dominates(values, broken)[0, 2]


def test_a_generation_in_which_all_break_conditions_still_teaches() -> None:
    values = values_to_maximise([outcome(9.0, coverage=0.1), outcome(1.0, coverage=0.4)], "s")
    assert values[1] > values[0]
    assert np.isfinite(values).all()


def test_a_trial_that_breaks_a_condition_is_never_the_best(
    mini: SensorDesign, capsys: pytest.CaptureFixture[str]
) -> None:
    space = SearchSpace({"camera.fov": (30.0, 60.0)}).bind(mini)

    def trial(number: int, found: Outcome) -> Trial:
        generation = -1 if number == 0 else 0
        return Trial(number, generation, np.array([40.0 + number]), found, space, "s")

    trials = [
        trial(0, outcome(1.0, coverage=0.4)),
        trial(1, outcome(9.0, coverage=0.45)),
        trial(2, outcome(2.0, coverage=0.6)),
    ]
    best = best_of(trials)
    assert best is not None and best.number == 2
    assert nearest(trials) is None
    assert condition_note(trials) == (
        "the start breaks conditions, which is allowed: coverage >= 0.5 (is 0.4)"
    )
    assert condition_lines(trials[2], trials[0]) == ["coverage >= 0.5: 0.6 (margin 0.1, start 0.4)"]
    rounded = trial(3, outcome(2.0, coverage=0.5 - 1e-12))
    assert "margin" in condition_lines(rounded, None)[0] and not unmet(rounded.conditions)
    print_conditions(condition_results(rounded.conditions, rounded, trials[0]))
    printed = capsys.readouterr().out
    assert "0.4" in printed and "-1e-12" in printed and "broken" not in printed
    assert best_of(trials[:2]) is None
    close = nearest(trials[:2])
    assert close is not None and close.number == 1
    note = condition_note(trials[:2])
    assert note is not None and "trial 1 comes nearest: coverage >= 0.5 (is 0.45)" in note


@pytest.mark.parametrize("method", ["grid", "cma-es"])
def test_the_best_of_a_search_keeps_the_condition(
    mini: SensorDesign, free: SearchResult, method: str
) -> None:
    assert free.best.parts["aoap"]["coverage"] < 0.4
    limit = "coverage >= 0.5"
    result = searched(mini, method=method, budget=6, require=limit)
    assert result.best.is_feasible
    assert (result.best.conditions[limit] or 0.0) >= 0.5
    fine = [trial for trial in result.trials if (trial.conditions[limit] or 0.0) >= 0.5]
    assert result.best.score == max(trial.score for trial in fine)


def test_a_front_holds_no_trial_that_breaks_a_condition(mini: SensorDesign) -> None:
    goals, options = ["aoap", "coverage"], {"population": 6}
    given: dict[str, Any] = {"method": "pareto", "budget": 12, "settings": RAYS}
    result = searched(mini, goals, options=options, require=["coverage >= 0.5"], **given)
    assert result.front
    assert all((trial.conditions["coverage >= 0.5"] or 0.0) >= 0.5 for trial in result.front)


def test_nothing_that_meets_the_conditions_is_told_with_the_nearest(mini: SensorDesign) -> None:
    seen: list[SearchProgress] = []
    result = searched(mini, require="coverage >= 0.99", progress=seen.append)
    assert result.study.best is None
    assert any("no trial meets all conditions" in note for note in result.notes)
    assert seen[-1].nearest.startswith("coverage >= 0.99 (is 0.")
    assert seen[-1].broken == 6
    with pytest.raises(SearchError, match="no trial 'best'") as caught:
        _ = result.best
    assert "comes nearest" in str(caught.value.hint)


def test_a_study_with_conditions_goes_on_and_old_ones_do_too(
    mini: SensorDesign, tmp_path: Path
) -> None:
    given: dict[str, Any] = {"method": "random", "budget": 2, "out": tmp_path / "study"}
    first = searched(mini, require="coverage>=0.6", **given)
    again = searched(mini, require="coverage >= 0.6", resume=True, **given)
    assert [t.score for t in again.trials] == [t.score for t in first.trials]
    with pytest.raises(SearchError, match="begun with other settings"):
        searched(mini, require="coverage>=0.5", resume=True, **given)

    old = tmp_path / "old"
    searched(mini, method="random", budget=2, out=old)
    path = old / "study.json"
    plain = json.loads(path.read_text())
    for name in LATER:
        del plain[name]
    path.write_text(json.dumps(plain))
    study = Study.open(old)
    assert study.settings.requirements == []
    assert StudySettings.load(old).comparable() == study.settings.comparable()
    study.close()


def test_a_condition_that_fresh_seeds_break_is_judged_anew(mini: SensorDesign) -> None:
    """With the study's seed all trials meet the condition; a field of view of 50 or more breaks it
    with each fresh seed.
    """
    with forgetting():

        @objective("lucky", rays_only=True)
        def lucky(evaluation: Evaluation) -> float:
            return 1.0 if evaluation.settings.seed == 0 or evaluation.design.camera.fov < 50 else 0

        def wide(design: SensorDesign) -> float:
            return design.camera.fov

        found = searched(mini, wide, require="lucky >= 0.5")
        assert [trial.outcome.is_feasible for trial in found.trials] == [True] * 7
        assert found.best.values["camera.fov"] == 48.0
        assert found.best.is_feasible and found.best.fresh
        everywhere = {"camera.fov": (50.0, 60.0, 2)}
        start = set_value(mini, "camera.fov", 50.0)
        none = searched(start, wide, space=everywhere, require="lucky >= 0.5")
        assert none.study.best is None
        close = nearest(none.trials)
        assert close is not None and close.fresh
        assert any("no trial meets all conditions with fresh seeds" in note for note in none.notes)


def test_what_fresh_seeds_say_of_conditions_is_stored(mini: SensorDesign, tmp_path: Path) -> None:
    with forgetting():

        @objective("seeded", rays_only=True)
        def seeded(evaluation: Evaluation) -> float:
            return float(evaluation.settings.seed % 7)

        out = tmp_path / "study"
        found = searched(mini, lambda each: each.camera.fov, require="seeded >= -1", out=out)
        best, start = found.best, found.start
        found.study.close()
        again = Study.open(out)
        assert again.trial(best.number).conditions == best.conditions != best.outcome.conditions
        assert again.trial("start").conditions == start.conditions
        again.close()


def test_nine_of_ten_manufactured_sensors_meet_a_condition(mini: SensorDesign) -> None:
    """A field of view that is 2 degrees off at random: the best keeps some distance."""
    limit = "coverage >= 0.5"
    given: dict[str, Any] = {"space": {"camera.fov": (50.0, 56.0, 3)}, "require": limit}
    plain = searched(mini, **given)
    robust = searched(mini, errors={"camera.fov": 2.0}, samples=12, **given)
    assert robust.best.values["camera.fov"] > plain.best.values["camera.fov"]
    made = robust.best.conditions[limit]
    exact = plain.best.conditions[limit]
    assert made is not None and exact is not None and made >= 0.5 and exact >= 0.5


def test_a_condition_without_a_value_on_manufactured_sensors_has_a_reason(
    mini: SensorDesign,
) -> None:
    with forgetting():

        @objective("mute", rays_only=True)
        def mute(evaluation: Evaluation) -> float:
            raise SearchError("nothing is in view")

        space = SearchSpace({"camera.fov": (40.0, 60.0)}).bind(mini)
        usual = DesignEvaluator(space, [lambda each: each.camera.fov], requirements=["mute >= 0"])
        errors = ManufacturingErrors({"coating.reflectance.r": 0.01})
        found = RobustEvaluator(usual, errors, seed=0, samples=3)(space.start, 0)
    assert found.unmeasured == ["mute >= 0"]
    reason = "3 of 3 manufactured sensors fail: mute: nothing is in view"
    assert found.failure is not None and found.failure.startswith(reason)
    tally = Tally(usual.names)
    tally.count(Row(0, START, 0, space.start, found, None), found)
    with pytest.raises(SearchError, match=f"all {ALL_FAIL} trials .* because: {reason}"):
        for number in range(1, ALL_FAIL + 1):
            tally.count(Row(number, 0, 0, space.start, found, None), found)
    assert tally.failed == 0


def test_a_score_won_by_seeing_less_is_told(free: SearchResult) -> None:
    assert set(free.start.parts[WATCHED]) == {"coverage", "distortion"}
    assert any("--require 'coverage>=" in note for note in free.notes), free.notes
    assert worsened_note(free.start, free.start) is None


def test_a_score_won_by_reading_worse_is_told(mini: SensorDesign) -> None:
    """A shiny coating has a good NormDiff, but a robot reads it badly."""
    space = SearchSpace({"coating.specularity": (0.0, 0.8)}).bind(mini)
    few = {"resolution": (160, 120), "photons": 60_000, "together": True}
    evaluator = DesignEvaluator(space, ["normdiff"], few)
    start, shiny = (evaluator(np.array([each]), 0) for each in (0.0, 0.8))
    assert shiny.scores["normdiff"] > start.scores["normdiff"]
    now, before = worsened(shiny, start)["reading"]
    assert now > 2.0 * before


def test_lights_alone_are_not_watched(mini: SensorDesign) -> None:
    result = searched(mini, space={"lights.red.flux": (1.0, 2.0, 2)})
    assert WATCHED not in result.start.parts


def test_the_start_may_break_a_condition(mini: SensorDesign) -> None:
    narrow = set_value(mini, "camera.fov", 42.0)
    result = searched(narrow, require="coverage>=0.5")
    assert not result.start.is_feasible
    assert result.best.is_feasible
    assert any("which is allowed" in note for note in result.notes)


def test_a_part_that_does_not_exist_is_found_without_a_sensor() -> None:
    with pytest.raises(SearchError, match="coverage has no part 'by_triangels'") as told:
        requirements_of(["coverage.by_triangels >= 0.5"])
    assert told.value.hint == "Did you mean 'by_triangles'?"
    with pytest.raises(SearchError, match="draft has no part 'least'") as told:
        requirements_of(["draft.least >= 3"])
    assert told.value.hint == "It has no parts that are numbers"


def test_an_unknown_part_of_a_users_objective_ends_a_search_before_its_trials(
    mini: SensorDesign,
) -> None:
    with forgetting():

        @objective("own_parts", rays_only=True)
        def own_parts(evaluation: Evaluation) -> tuple[float, dict[str, float]]:
            return 1.0, {"first": 2.0}

        with pytest.raises(UnknownPartError, match="own_parts has no part 'firts'") as told:
            searched(mini, require="own_parts.firts >= 0.1")
    assert told.value.hint == "Did you mean 'first'?"


@pytest.mark.parametrize(
    ("space", "goal", "options"),
    [
        ({"camera.fov": (45.0, 60.0)}, "aoap", {}),
        ({"lights.*.colour": ["red", "blue"]}, "normdiff", {"method": "light-colours"}),
    ],
)
def test_long_searches_read_the_start_and_the_best_so_far(
    mini: SensorDesign,
    monkeypatch: pytest.MonkeyPatch,
    space: dict[str, object],
    goal: str,
    options: dict[str, Any],
) -> None:
    monkeypatch.setattr("optisense.search.study._reading_watch.FIRST_SECONDS", 0.0)
    settings = {"photons": 60_000, "resolution": [160, 120], "together": True}
    found = search(mini, space, goal, budget=3, settings=settings, **options)
    best = max((each for each in found.trials if not each.failure), key=lambda each: each.score)
    assert not best.is_start
    for trial in (found.start, best):
        assert 0.5 < trial.parts[WATCHED]["reading"] < 40.0

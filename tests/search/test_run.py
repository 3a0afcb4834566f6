"""Studies from beginning to end, scored by cheap functions of the design."""

from __future__ import annotations

import json
import math
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from optisense.design import SensorDesign, save_design, set_value
from optisense.errors import SearchError
from optisense.objectives.registry import forgetting
from optisense.quality import TRIAL_PHOTONS
from optisense.search import (
    Around,
    Continuous,
    Integer,
    Outcome,
    Plan,
    SearchProgress,
    SearchSpace,
    Study,
    search,
)
from optisense.search._run_search import run_study
from optisense.search.methods import METHODS, Method, register
from optisense.search.methods._pareto import Pareto
from optisense.search.space.constraints import UserRule
from optisense.search.space.manufacturing import ManufacturingErrors
from optisense.search.study.failures import incomplete

SPACE = {"coating.specularity": (0.0, 1.0, 5), "camera.position.x": (-1.0, 3.0, 3)}


def vectors(study: Study) -> np.ndarray:
    return np.array([row.vector for row in study.store.rows()])


def test_finds_the_best_and_makes_its_design(mini: SensorDesign, goals: ModuleType) -> None:
    result = search(mini, SPACE, goals.nearness, budget=200, seed=3)
    assert result.best.score > -1e-6
    assert result.best.design.coating.specularity == pytest.approx(0.3, abs=1e-3)
    assert result.start.score == goals.nearness(mini)
    assert result.ended == "the budget is spent"
    assert len(result.trials) == 201
    assert result.trials.index(result.best) == result.best.number
    assert result.start in {*result.trials} and result.start != result.best
    assert mini.coating.specularity == 0.0


def test_numbers_of_numpy_are_stored_in_a_study(mini: SensorDesign) -> None:
    space = {
        "coating.specularity": list(np.linspace(0.0, 1.0, 3)),
        "camera.position.x": Continuous(np.float32(-1.0), np.float64(3.0), np.int64(3)),  # type: ignore[arg-type]
        "camera.position.y": Around(np.float32(0.5)),  # type: ignore[arg-type]
        "camera.resolution[0]": Integer(np.int64(100), np.int32(104)),  # type: ignore[arg-type]
    }
    asked: dict[str, Any] = {
        "budget": np.int64(5),
        "seed": np.uint8(2),
        "options": {"sigma": np.float32(0.25)},
        "settings": {"ray_resolution": np.array([40, 30]), "least_skin": np.float32(0.25)},
        "errors": ManufacturingErrors({"camera.fov": np.float32(0.125)}),
        "samples": np.int64(1),
    }
    settings = Plan(SearchSpace(space), ["coverage"], **asked).settings_for(mini)
    told = json.loads(settings.to_text())
    assert (told["budget"], told["seed"], told["samples"]) == (5, 2, 1)
    assert told["settings"] == {"ray_resolution": [40, 30], "least_skin": 0.25}
    assert told["space"]["camera.position.x"]["high"] == 3.0


def test_the_numbers_of_a_plan_are_whole(mini: SensorDesign) -> None:
    assert Plan(SearchSpace(SPACE), ["coverage"], budget=3.0).settings_for(mini).budget == 3  # type: ignore[arg-type]
    for name, value in (("budget", 2.5), ("budget", math.nan), ("seed", 0.5), ("samples", "2")):
        given: dict[str, Any] = {name: value}
        with pytest.raises(SearchError, match=f"the {name} is {value!r}.* whole number"):
            Plan(SearchSpace(SPACE), ["coverage"], **given)


def test_no_point_is_scored_twice(mini: SensorDesign) -> None:
    """A grid holds the start; whole numbers and options repeat."""
    asked: list[float] = []

    def counted(design: SensorDesign) -> float:
        asked.append(design.coating.specularity)
        return -design.coating.specularity

    assert mini.coating.specularity == 0.0
    result = search(mini, {"coating.specularity": (0.0, 1.0, 5)}, counted, method="grid")
    assert [trial.score for trial in result.trials] == [0.0, 0.0, -0.25, -0.5, -0.75, -1.0]
    assert sorted(set(asked)) == [0.0, 0.25, 0.5, 0.75, 1.0]
    assert asked[:5] == [0.0, 0.25, 0.5, 0.75, 1.0]  # the rest is with fresh seeds


def test_progress_tells_of_best_rate_and_time_left(mini: SensorDesign, goals: ModuleType) -> None:
    seen: list[SearchProgress] = []
    search(mini, SPACE, goals.nearness, budget=40, progress=seen.append)
    last = [each for each in seen if each.stage == "trials"][-1]
    assert last.total == 40
    assert 0 < last.done <= 40
    assert last.trials_per_hour > 0
    assert last.start <= last.best <= 0.0
    stages = [each.stage for each in seen]
    assert list(dict.fromkeys(stages)) == ["start", "trials", "fresh seeds"]
    assert math.isnan(seen[0].seconds_left)  # nothing is known before the start has its score
    assert last.seconds_left >= 0.0
    assert all(each.done <= each.total for each in seen)
    assert 0 < seen[-1].done <= seen[-1].total


def test_a_failed_trial_is_kept_with_its_reason(mini: SensorDesign) -> None:
    def picky(design: SensorDesign) -> float:
        if design.coating.specularity > 0.4:
            raise ValueError("too shiny")
        return design.coating.specularity or math.nan

    result = search(mini, {"coating.specularity": (0.0, 1.0, 11)}, picky, method="grid")
    failed = [trial for trial in result.trials if trial.failure]
    assert ["too shiny" in str(trial.failure) for trial in failed] == [False] * 2 + [True] * 6
    assert all(math.isnan(trial.score) for trial in failed)
    assert result.best.score == pytest.approx(0.4)


def test_stops_early_when_every_trial_fails(
    mini: SensorDesign, goals: ModuleType, tmp_path: Path
) -> None:
    with pytest.raises(SearchError, match="no such sensor can be made") as told:
        search(mini, SPACE, goals.broken, budget=1000, out=tmp_path / "study")
    assert "all 5 trials so far have failed, 5 of them" in told.value.message
    study = Study.open(tmp_path / "study")
    assert 1 <= len(study.trials) <= 6
    with pytest.raises(SearchError, match="'best'"):
        study.trial("best")


@pytest.mark.parametrize(
    ("answer", "reason"),
    [
        ("'high'", "the objective returned a str"),
        ("float('nan')", "the objective returned nan"),
        ("[1, 2][7]", r"IndexError: .*mine\.py:2\)"),
    ],
)
def test_an_objective_that_always_fails_is_to_be_repaired(
    answer: str, reason: str, mini: SensorDesign, tmp_path: Path
) -> None:
    file = tmp_path / "mine.py"
    file.write_text(f"def mine(design):\n    return {answer}\n")
    with forgetting(), pytest.raises(SearchError, match=reason) as told:
        search(mini, SPACE, f"{file}:mine", budget=10)
    assert told.value.hint is not None
    assert told.value.hint.startswith("Repair the objective mine,")


def test_the_first_objective_decides_whether_a_trial_has_failed(
    mini: SensorDesign, goals: ModuleType
) -> None:
    space, both = {"coating.specularity": (0.0, 1.0, 25)}, [goals.brightness, goals.broken]
    seen: list[SearchProgress] = []
    result = search(mini, space, both, method="grid", progress=seen.append)
    assert result.best.score == seen[-1].best == 1.0
    assert seen[-1].failed == 0
    assert {len(trial.fresh) for trial in result.trials} == {0, 1}  # the seed does not matter
    kinds = incomplete(result.trials)
    assert {kind: len(members) for kind, members in kinds.items()} == {
        "without a value of broken": 26
    }
    assert [note for note in result.notes if "another objective failed: broken: ValueError" in note]
    with pytest.raises(SearchError, match="trials so far have failed"):
        search(mini, space, both, method="pareto", budget=25)  # no trial is on its front


def test_a_rule_that_always_fails_is_to_be_repaired(mini: SensorDesign, goals: ModuleType) -> None:
    def torn(design: SensorDesign) -> bool:
        return bool(design.lights["none"])

    space = SearchSpace(SPACE, constraints=[torn])
    with pytest.raises(SearchError, match=r"a constraint failed: KeyError: .*\.py:\d+") as told:
        search(mini, space, goals.brightness, budget=10)
    assert str(told.value.hint).startswith("Repair the rule,")


def test_bounds_are_to_be_changed_where_only_the_start_has_a_score(mini: SensorDesign) -> None:
    start = mini.coating.specularity

    def picky(design: SensorDesign) -> float:
        return 1.0 if design.coating.specularity == start else math.nan

    with pytest.raises(SearchError, match="returned nan") as told:
        search(mini, {"coating.specularity": (0.0, 1.0)}, picky, method="random", budget=30)
    assert str(told.value.hint).startswith("Change the bounds")


def test_a_rule_forbids_designs(mini: SensorDesign, goals: ModuleType) -> None:
    def modest(design: SensorDesign) -> str | None:
        return "too shiny" if design.coating.specularity > 0.2 else None

    space = SearchSpace(SPACE, constraints=[modest])
    result = search(mini, space, goals.brightness, method="grid")
    assert {trial.failure for trial in result.trials} == {None, "too shiny"}
    assert result.best.score == 0.0


class Noisy:
    """Scores of the specularity, with luck that depends on the seed and the design: "shine", and
    "dullness", which is its opposite.
    """

    def __init__(self, names: list[str], spread: float) -> None:
        self.names, self.spread = names, spread

    def __call__(self, vector: np.ndarray, seed: int) -> Outcome:
        shine = float(vector[0])
        luck = np.random.default_rng([seed, int(1e6 * shine)]).normal(0.0, self.spread, 2)
        both = {"shine": shine + luck[0], "dullness": 1.0 - shine + luck[1]}
        return Outcome({name: both[name] for name in self.names})


def shine(design: SensorDesign) -> float:
    raise AssertionError("the method brings an evaluator of its own")


def dullness(design: SensorDesign) -> float:
    raise AssertionError("the method brings an evaluator of its own")


class NoisyLine(Method):
    name = "noisy-line"
    summary = "a test"

    def ask(self) -> np.ndarray:
        asked, self.asked = getattr(self, "asked", False), True
        return np.empty((0, 1)) if asked else np.linspace(0.0, 0.2, 60)[:, None]

    def tell(self, vectors: np.ndarray, outcomes: object) -> None:
        pass

    def evaluator(self, usual: object) -> Noisy:  # type: ignore[override]
        return Noisy(["shine"], 0.05)


class NoisyPareto(Pareto):
    name = "noisy-pareto"

    def evaluator(self, usual: object) -> Noisy:  # type: ignore[override]
        return Noisy(["shine", "dullness"], 0.01)


def test_the_best_is_scored_again_before_it_is_named(mini: SensorDesign) -> None:
    """Of noisy scores the luckiest is not the best: fresh seeds tell."""
    space = {"coating.specularity": (0.0, 1.0)}
    with METHODS.forgetting():
        register(NoisyLine)
        result = search(mini, space, shine, method="noisy-line", budget=60, seed=5)
    again = [trial for trial in result.trials if trial.fresh and not trial.is_start]
    luckiest = max(result.trials, key=lambda trial: trial.score)
    assert luckiest in again
    assert len(again) > 1
    assert all(len(trial.fresh) == 3 for trial in again)
    assert result.study.settings.seed not in {seed for trial in again for seed in trial.fresh}
    assert result.best.fresh_score() == max(trial.fresh_score() for trial in again)
    assert result.best.fresh_score() < luckiest.score
    assert result.start.fresh


def test_several_goals_are_weighed(mini: SensorDesign, goals: ModuleType) -> None:
    """Dull and shiny can't both be had: the front runs from one to the other."""
    both = [goals.nearness, goals.brightness]
    result = search(mini, SPACE, both, method="pareto", budget=120, seed=1)
    scores = np.array([list(trial.scores.values()) for trial in result.front])
    assert len(scores) > 5
    assert (np.diff(scores[:, 0]) <= 0).all()  # the best in the first goal comes first,
    assert (np.diff(scores[:, 1]) >= 0).all()  # and what it costs is won in the second
    assert np.ptp(scores[:, 1]) > 0.5
    for trial in result.trials:
        values = list(trial.scores.values())
        assert not ((values >= scores) & (np.array(values) != scores)).all(axis=1).any()
    plain = search(mini, SPACE, both, budget=30)
    assert set(plain.best.scores) == {"nearness", "brightness"}
    assert plain.best.score == max(trial.score for trial in plain.trials)


def test_trade_offs_are_scored_again_from_end_to_end(mini: SensorDesign) -> None:
    space = {"coating.specularity": (0.0, 1.0)}
    with METHODS.forgetting():
        register(NoisyPareto)
        goals = [shine, dullness]
        result = search(mini, space, goals, method="noisy-pareto", budget=80, seed=5)
    again = [trial for trial in result.front if trial.fresh]
    assert 2 < len(again) < len(result.front)
    assert {result.front[0].number, result.front[-1].number} <= {trial.number for trial in again}
    assert result.start.fresh
    for trial in again:
        assert len(trial.fresh) == 3
        assert result.study.settings.seed not in trial.fresh
        for outcome in trial.fresh.values():
            assert set(outcome.scores) == {"shine", "dullness"}
            assert outcome.scores != trial.scores
            # Both scores of an outcome are of the same design: together they are 1, but for luck.
            assert sum(outcome.scores.values()) == pytest.approx(1.0, abs=0.08)


class TestResume:
    @pytest.fixture
    def folder(self, mini: SensorDesign, goals: ModuleType, tmp_path: Path) -> Path:
        search(mini, SPACE, goals.nearness, budget=5, out=tmp_path / "study").study.close()
        return tmp_path / "study"

    def test_a_larger_budget_goes_on_where_it_ended(
        self, mini: SensorDesign, goals: ModuleType, tmp_path: Path
    ) -> None:
        """In two goes the same trials as in one, and none twice."""
        folder = tmp_path / "study"
        whole = search(mini, SPACE, goals.nearness, budget=60, seed=3)
        first = search(mini, SPACE, goals.nearness, budget=60, seed=3, out=folder)
        first.study.close()
        study = Study.open(folder, goals=[goals.nearness])
        again = run_study(study, limit=90)
        assert len(again.trials) == 91
        assert np.array_equal(vectors(study)[:61], vectors(whole.study))
        longer = search(mini, SPACE, goals.nearness, budget=60, seed=3)
        run_study(longer.study, limit=90)
        assert np.array_equal(vectors(study), vectors(longer.study))

    def test_a_finished_study_has_nothing_left_to_do(
        self, mini: SensorDesign, goals: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        log = tmp_path / "log"
        monkeypatch.setenv("TRIAL_LOG", str(log))
        for resume in (False, True):
            result = search(
                mini, SPACE, goals.told, budget=30, out=tmp_path / "study", resume=resume
            )
            again = sum(len(trial.fresh) for trial in result.trials)
            result.study.close()
        assert len(log.read_text().splitlines()) == 31 + again

    def test_an_edited_design_is_refused_with_the_difference(
        self, mini: SensorDesign, goals: ModuleType, folder: Path
    ) -> None:
        edited = set_value(mini, "lights.red.flux", 12.0)
        with pytest.raises(SearchError) as told:
            search(edited, SPACE, goals.nearness, budget=5, out=folder, resume=True)
        assert "-> 12" in told.value.message
        save_design(edited, folder / "design")
        with pytest.raises(SearchError, match="own copy of the design was edited"):
            Study.open(folder)

    def test_other_settings_are_refused_with_the_difference(
        self, mini: SensorDesign, goals: ModuleType, folder: Path
    ) -> None:
        wider = {**SPACE, "coating.specularity": (0.0, 0.9, 5)}
        with pytest.raises(SearchError, match=r"specularity.*high: 1 -> 0\.9"):
            search(mini, wider, goals.nearness, budget=5, out=folder, resume=True)
        with pytest.raises(SearchError, match="seed: 0 -> 1"):
            search(mini, SPACE, goals.nearness, budget=5, out=folder, resume=True, seed=1)
        with pytest.raises(SearchError, match="searches for nearness, not for brightness"):
            search(mini, SPACE, goals.brightness, budget=5, out=folder, resume=True)

    def test_only_the_program_knows_its_functions(self, folder: Path) -> None:
        study = Study.open(folder)
        assert len(study.trials) == 6
        with pytest.raises(SearchError, match="knows nearness"):
            run_study(study)

    def test_an_edited_file_of_a_user_is_refused(
        self, mini: SensorDesign, goals: ModuleType, tmp_path: Path
    ) -> None:
        rule = tmp_path / "rule.py"
        rule.write_text("def fine(design):\n    return True\n")
        space = SearchSpace(SPACE, constraints=[UserRule(f"{rule}:fine")])
        folder = tmp_path / "study"
        search(mini, space, goals.nearness, budget=5, out=folder).study.close()
        rule.write_text("def fine(design):\n    return False\n")
        with pytest.raises(SearchError, match="was edited") as told:
            run_study(Study.open(folder, goals=[goals.nearness]))
        assert told.value.where == str(rule)


@pytest.mark.parametrize(
    ("goals", "method", "given", "settings"),
    [
        (["rgb2normal"], "cma-es", {}, {"photons": TRIAL_PHOTONS}),
        (["rgb2normal"], "cma-es", {"photons": 10}, {"photons": 10}),
        (["aoap"], "cma-es", {}, {"ray_resolution": [320, 240]}),
        (["rgb2normal"], "light-colours", {}, {}),
        ([lambda design: 0.0], "cma-es", {}, {}),
    ],
)
def test_trials_take_less_light_than_a_single_evaluation(
    mini: SensorDesign,
    goals: list[Any],
    method: str,
    given: dict[str, Any],
    settings: dict[str, Any],
) -> None:
    space = SearchSpace({"lights.red.flux": (1.0, 2.0, 3)})
    plan = Plan(space=space, goals=goals, method=method, settings=given)
    assert plan.settings_for(mini).settings == settings

"""Searches whose trials have coarse scores, and whose promising trials get full ones."""

from __future__ import annotations

import pytest
from comparing import SCORE_ROUNDING

import optisense as ots
from optisense.design import SensorDesign
from optisense.errors import SearchError
from optisense.objectives import Evaluation, Settings
from optisense.optics.scene.surfaces import Region
from optisense.search import SearchResult, Study, run_study, search
from optisense.search.evaluation.coarse import CONTACT_PIXELS, CoarseEvaluator, coarse_settings
from optisense.search.evaluation.evaluator import DesignEvaluator
from optisense.search.space.search_space import SearchSpace
from optisense.search.study.plan import Plan
from optisense.search.study.progress import FRESH, SearchProgress
from optisense.search.study.rescoring import LEAST_PROMOTED
from optisense.search.study.study import beside

FULL = {"resolution": [640, 480], "photons": 1_000_000}
SPACE = {"coating.specularity": (0.0, 1.0, 41)}
BEST = 0.3
"""Specularity with the best full score; coarse scores suggest another one."""

BIASED = """
import numpy as np

def biased(evaluation):
    is_full = evaluation.settings.photons == 1_000_000
    shine = evaluation.design.coating.specularity
    words = [evaluation.settings.seed, round(1e6 * shine)]
    luck = np.random.default_rng(words).normal(0.0, 0.002 if is_full else 0.01)
    return float(1.0 - (shine - (0.3 if is_full else 0.4)) ** 2 + luck)

def quality(evaluation):
    return evaluation.settings.photons
"""
"""File with an objective that is noisy, the more so in coarse scores, which are also biased."""


@pytest.fixture(scope="module")
def biased(tmp_path_factory: pytest.TempPathFactory) -> str:
    file = tmp_path_factory.mktemp("goals") / "biased_by_quality.py"
    file.write_text(BIASED, encoding="utf-8")
    return f"{file}:biased"


def found_by(design: SensorDesign, goal: str) -> SearchResult:
    return search(design, SPACE, goal, method="grid", settings=FULL, coarse_first=True)


def test_the_best_by_full_scores_is_found_although_coarse_ones_are_biased(
    mini: SensorDesign, biased: str
) -> None:
    result = found_by(mini, biased)
    promoted = [trial for trial in result.trials if trial.fresh and not trial.is_start]
    assert len(promoted) <= LEAST_PROMOTED < len(result.trials) / 3
    assert result.best.values["coating.specularity"] == pytest.approx(BEST, abs=0.06)
    assert len(result.best.fresh) == 3
    assert len(result.start.fresh) == 1  # it is so far behind that one score tells
    assert result.best.fresh_score() == max(trial.fresh_score() for trial in promoted)
    least = min(trial.score for trial in promoted)
    left = [trial.score for trial in result.trials if not trial.fresh]
    assert sum(score > least for score in left) <= 2  # only those nearly equal to a promoted one


def test_nothing_coarse_is_shown_beside_a_full_score(mini: SensorDesign, biased: str) -> None:
    space = {"camera.fov": (50.0, 60.0, 2)}
    goals = [biased, biased.replace(":biased", ":quality"), "coverage + 0*power"]
    found = search(mini, space, goals, method="grid", settings=FULL, coarse_first=True)
    best = found.best
    shown = beside(found.study, best)
    assert best.fresh
    assert best.scores["quality"] < shown["quality"] == 1_000_000
    assert shown["coverage"] == best.parts["coverage + 0*power"]["coverage"]  # by rays only


def test_a_search_that_was_stopped_amid_full_scores_ends_alike(
    mini: SensorDesign, biased: str
) -> None:
    plan = Plan(SearchSpace(SPACE), [biased], method="grid", settings=FULL, coarse_first=True)
    study = Study.create(None, mini, plan)

    def stop(progress: SearchProgress) -> None:
        if progress.stage == FRESH and progress.done == 2:
            raise KeyboardInterrupt

    stopped = run_study(study, progress=stop)
    assert stopped.interrupted
    assert sum(len(trial.fresh) for trial in stopped.trials) == 2
    ended, whole = run_study(study), found_by(mini, biased)
    assert [dict(trial.fresh) for trial in ended.trials] == [
        dict(trial.fresh) for trial in whole.trials
    ]


@pytest.mark.parametrize(
    ("goal", "method", "says"),
    [
        ("aoap", "cma-es", "no objective or condition of this search needs pictures"),
        ("reading", "gradient", "gradient can't search by coarse scores"),
        ("reading", "cma-es", "trials render no image"),
    ],
)
def test_coarse_scores_that_do_not_fit_are_refused(
    mini: SensorDesign, goal: str, method: str, says: str
) -> None:
    space = {"lights.red.flux": (1.0, 5.0)}
    with pytest.raises(SearchError, match=says):
        search(mini, space, goal, method=method, coarse_first=True)


def test_coarse_scores_take_fewer_pixels_and_photons_and_one_image(mini: SensorDesign) -> None:
    assert coarse_settings(mini, FULL) == {
        "resolution": [160, 120],
        "photons": 125_000,
        "together": True,
    }
    small = {"resolution": [160, 120], "photons": 20_000, "depth": 0.2}
    assert coarse_settings(mini, small, 1.0) == {**small, "together": True}
    usual = coarse_settings(mini, {"photons": "normal"}, 0.5)
    assert (usual["resolution"], usual["photons"]) == ([320, 240], 125_000)


@pytest.mark.parametrize("name", ["gelsight-mini-ideal", "gelbelt"])
def test_the_smallest_contact_keeps_enough_pixels(name: str) -> None:
    design = ots.load(name)
    space = SearchSpace({"coating.specularity": (0.0, 1.0)}).bind(design)
    evaluator = CoarseEvaluator(DesignEvaluator(space, ["reading"], FULL))
    evaluation = Evaluation(
        ots.OpticalModel(design), Settings(resolution=evaluator.used_settings["resolution"])
    )
    rays = evaluation.model.chief_rays(evaluation.resolution, evaluation.contacts, "conforming")
    pixels = (rays.region == Region.INDENTER).sum() / len(evaluation.contacts)
    assert 0.8 * CONTACT_PIXELS < pixels < 2.5 * CONTACT_PIXELS


def test_a_coarse_score_does_not_depend_on_the_designs_before(mini: SensorDesign) -> None:
    space = SearchSpace({"lights.*.shift.z": (0.0, 1.0), "coating.specularity": (0.0, 1.0)})
    settings = {"photons": 100_000, "places": [[-4.0, -3.0], [4.0, 3.0]]}
    usual = DesignEvaluator(space.bind(mini), ["rgb2normal"], settings)
    points = [usual.space.start, usual.space.upper]
    one, other = CoarseEvaluator(usual), CoarseEvaluator(usual)
    first, second = (one(point, 0).scores["rgb2normal"] for point in points)
    again = [other(point, 0).scores["rgb2normal"] for point in reversed(points)]
    assert again == pytest.approx([second, first], abs=SCORE_ROUNDING)
    assert abs(first - second) > 100 * SCORE_ROUNDING

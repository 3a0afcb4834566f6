"""The gradient method: whole derivatives against differences, ascent, and what it refuses."""

from __future__ import annotations

import numpy as np
import pytest

from optisense import SensorDesign
from optisense.errors import SearchError
from optisense.search import SearchSpace, search
from optisense.search.evaluation import DesignEvaluator
from optisense.search.methods.base import Problem
from optisense.search.methods.gradient import Gradient, SlopeEvaluator
from optisense.sensors import BUILDERS

SETTINGS = {"resolution": (80, 60)}


@pytest.fixture(scope="module")
def svelte() -> SensorDesign:
    return BUILDERS["gelsight-svelte"](tessellation=1.0, m1_grid=(60, 15))


def method(design: SensorDesign, objective: str = "aoap", **space: object) -> Gradient:
    bound = SearchSpace({name.replace("__", "."): v for name, v in space.items()}).bind(design)
    return Gradient(Problem(bound, (objective,), 10), resolution=80)


def slopes_of(found: Gradient) -> SlopeEvaluator:
    evaluator = found.evaluator(DesignEvaluator(found.space, ["aoap"], SETTINGS))
    assert isinstance(evaluator, SlopeEvaluator)
    return evaluator


def test_slopes_by_a_cage_and_a_camera_agree_with_differences(svelte: SensorDesign) -> None:
    space = {
        "cages.M1.points[13].x": (-2.0, 2.0), "cages.M1.points[22].z": (60.0, 90.0),
        "camera.fov": (20.0, 90.0),
    }  # fmt: skip
    bent = svelte.copy()
    cage = bent.cages["M1"]
    points = [{"x": x, "y": y, "z": z} for x, y, z in cage.current_points().tolist()]
    bent.cages["M1"] = type(cage).model_validate(
        {**cage.model_dump(), "blend": None, "points": points}
    )
    start = cage.current_points()
    space["cages.M1.points[13].x"] = (start[13, 0] - 1, start[13, 0] + 1)
    space["cages.M1.points[22].z"] = (start[22, 2] - 1, start[22, 2] + 1)
    found = method(bent, **space)
    evaluator = slopes_of(found)
    point = found.space.start
    _, gradient = evaluator.slope(point)
    for number, step in enumerate((0.1, 0.1, 0.1)):
        beside = np.zeros_like(point)
        beside[number] = step
        ahead, _ = evaluator.slope(point + beside)
        behind, _ = evaluator.slope(point - beside)
        differences = (ahead.value - behind.value) / (2 * step)
        # Mirror M2 and the body also cut rays off, which the gradient does not know.
        assert gradient[number] == pytest.approx(differences, rel=0.3, abs=3e-4)


def test_a_few_steps_make_the_camera_see_more_uprightly(svelte: SensorDesign) -> None:
    result = search(
        svelte, {"cages.M1.blend": (0, 1)}, "aoap", method="gradient", budget=6,
        settings=SETTINGS, options={"resolution": 80},
    )  # fmt: skip
    first = result.trials[0].outcome.scores["aoap"]
    best = result.best
    assert best is not None
    assert best.outcome.scores["aoap"] > 1.5 * first


def test_the_same_search_takes_the_same_steps(svelte: SensorDesign) -> None:
    one, other = (method(svelte, cages__M1__blend=(0, 1)) for _ in range(2))
    evaluator = slopes_of(one)
    for _ in range(3):
        asked = one.ask()
        assert np.array_equal(asked, other.ask())
        outcomes = [evaluator(vector, 0) for vector in asked]
        one.tell(asked, outcomes)
        other.tell(asked, outcomes)


@pytest.mark.parametrize(
    ("space", "objective", "message"),
    [
        ({"coating__specularity": (0, 1)}, "aoap", "neither a surface nor the camera"),
        ({"camera__fov": (40.0, 60.0)}, "rgb2normal", "has no gradient"),
    ],
)
def test_what_has_no_gradient_is_refused(
    svelte: SensorDesign, space: dict[str, object], objective: str, message: str
) -> None:
    with pytest.raises(SearchError, match=message):
        method(svelte, objective, **space)

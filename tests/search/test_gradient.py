"""The gradient method: whole derivatives against differences, ascent, and what it refuses."""

from __future__ import annotations

import pickle
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pytest

from optisense import SensorDesign, evaluate, load, set_value
from optisense.array_types import FloatArray
from optisense.errors import NoDerivativeError, SearchError
from optisense.search import Around, CagePoints, SearchSpace, search
from optisense.search.evaluation.evaluator import DesignEvaluator
from optisense.search.methods.base import Problem
from optisense.search.methods.checked_gradients import (
    FEW_PARAMETERS,
    GRADIENT_BY,
    GRADIENT_HOLDS,
    Agreement,
    GradientEvaluator,
)
from optisense.search.methods.gradient import Gradient
from optisense.search.methods.score_differences import GradientSource, ScoreDifferences

SETTINGS = {"ray_resolution": (160, 120)}

TRUE = {"ray_resolution": (640, 480)}
"""Rays enough that differences of scores over some tenths of a mm or degree are steady."""


RESOLUTION = 160


def method(
    design: SensorDesign, space: Mapping[str, object], objective: str = "aoap", **options: Any
) -> Gradient:
    return Gradient(Problem(SearchSpace(space).bind(design), (objective,), 10), **options)


def slopes_of(
    found: Gradient, objective: str = "aoap", settings: dict[str, object] = SETTINGS
) -> GradientEvaluator:
    usual = DesignEvaluator(found.space, [objective], settings, apart=False)
    evaluator = found.evaluator(usual)
    assert isinstance(evaluator, GradientEvaluator)
    return evaluator


def freed(design: SensorDesign, cage: str) -> SensorDesign:
    """With the points of a cage where they are, instead of shares between two shapes."""
    bent = design.copy()
    old = bent.cages[cage]
    points = [{"x": x, "y": y, "z": z} for x, y, z in old.current_points().tolist()]
    plain = {**old.model_dump(), "blend": None, "points": points}
    bent.cages[cage] = type(old).model_validate(plain)
    return bent


@pytest.mark.parametrize(
    ("name", "step"),
    [("points[12].x", 0.1), ("points[13].x", 0.1), ("points[22].z", 0.1), ("fov", 0.1)],
)
def test_slopes_of_svelte_are_the_changes_of_the_smoothed_score(
    coarse_svelte: SensorDesign, name: str, step: float
) -> None:
    """The mirror's rays are cut off by the second mirror and the body, too."""
    path = "camera.fov" if name == "fov" else f"cages.M1.{name}"
    found = method(freed(coarse_svelte, "M1"), {path: Around(1.0)})
    evaluator, start = slopes_of(found), found.space.start
    _, gradient = evaluator.gradient(start)
    values = [evaluator.gradient(start + way)[0] for way in (step, -step)]
    differences = (values[0] - values[1]) / (2 * step)
    assert gradient[0] == pytest.approx(differences, rel=0.05, abs=2e-5)


def test_a_camera_that_blockers_hem_in_has_the_slope_of_the_true_score() -> None:
    """GelSight360, near where a search by derivatives without edges goes the wrong way."""
    space = {"camera.position.z": (0.0, 16.0), "camera.fov": (90.0, 148.0)}
    evaluator = slopes_of(method(load("gelsight360"), space), settings=TRUE)
    point = np.array([8.0, 118.0])
    _, gradient = evaluator.gradient(point)
    for number, step in enumerate((0.2, 2.0)):
        way = np.zeros(2)
        way[number] = 1.0
        differences = evaluator.difference(point, way, step, 0)
        assert differences is not None
        # Without edges the sign by fov is another one; differences step by some per cent.
        assert gradient[number] == pytest.approx(differences, rel=0.05)


def test_rays_that_leave_the_picture_count_for_nothing_where_the_score_is_flat() -> None:
    """The skin of GelBelt fills the picture: nothing fades at its border."""
    space = {"camera.position.x": Around(1.0), "camera.fov": Around(3.0)}
    evaluator = slopes_of(method(load("gelbelt"), space, resolution=RESOLUTION))
    _, gradient = evaluator.gradient(evaluator.usual.space.start)
    assert np.abs(gradient).max() < 4e-3


CAMERA = {"camera.position": Around(1.0), "camera.fov": Around(3.0)}
CAMERA_RAYS = {"ray_resolution": (320, 240)}


class ScoredOnce(ScoreDifferences):
    """Differences between scores of designs of which each, by its camera, is scored once."""

    def __init__(self, usual: DesignEvaluator) -> None:
        super().__init__(usual)
        self._found: dict[bytes, FloatArray] = {}

    def exact(self, design: SensorDesign, seed: int, names: Sequence[str]) -> FloatArray:
        camera = design.camera
        numbers = [*camera.position, *np.ravel(camera.axes()), camera.fov]
        key = np.round(numbers, 10).tobytes()
        if key not in self._found:
            self._found[key] = super().exact(design, seed, names)
        return self._found[key]


@pytest.fixture(scope="module")
def belt() -> GradientEvaluator:
    """An evaluator of GelBelt's 2to3PW by its camera. Tests take the same steps from its start."""
    evaluator = slopes_of(method(load("gelbelt"), CAMERA, "2to3pw"), "2to3pw", CAMERA_RAYS)
    evaluator._differences = ScoredOnce(evaluator.usual)
    return evaluator


def test_an_unlikely_gradient_does_not_hold_and_a_true_one_does(belt: GradientEvaluator) -> None:
    point = belt.usual.space.start
    true = belt._differences.gradients(point, 0, ["2to3pw"])[0]
    assert belt.agreement(point, true, 0) is Agreement.HOLDS
    assert belt.steady(point, true, 0)
    for wrong in (-true, 1.1 * true):
        assert belt.agreement(point, wrong, 0) is Agreement.DIFFERS
        assert not belt.steady(point, wrong, 0)


def test_a_score_that_steps_is_said_to_have_no_steady_derivative() -> None:
    """The coverage in GelBelt's AOAP counts triangles, of which whole rows come into view."""
    found = method(load("gelbelt"), CAMERA, resolution=RESOLUTION)
    bound = found.space
    usual = DesignEvaluator(bound, ["aoap"], CAMERA_RAYS, apart=False)
    outcome = found.evaluator(usual)(bound.start, 0)
    assert not outcome.parts["aoap"][GRADIENT_HOLDS]
    found.tell(bound.start[None], [outcome])
    assert any("no steady derivative" in note and "cma-es" in note for note in found.notes())
    # The coverage alone makes the difference: the mean cosine has a derivative.
    settings = {**CAMERA_RAYS, "coverage_weight": 0.0}
    smooth = DesignEvaluator(bound, ["aoap"], settings, apart=False)
    assert found.evaluator(smooth)(bound.start, 0).parts["aoap"][GRADIENT_HOLDS]


def test_a_gradient_that_is_said_to_hold_is_within_five_per_cent(belt: GradientEvaluator) -> None:
    bound = belt.usual.space
    outcome = belt(bound.start, 0)
    assert outcome.parts["2to3pw"][GRADIENT_HOLDS]
    assert outcome.gradient is not None
    span = bound.upper - bound.lower
    typical = np.linalg.norm(outcome.gradient * span) / np.sqrt(bound.size)
    random = np.random.default_rng(1)
    for _ in range(3):
        way = random.normal(size=bound.size)
        way *= span / np.linalg.norm(way)
        true = belt.difference(bound.start, way, 0.01, 0)
        assert true is not None
        assert outcome.gradient @ way == pytest.approx(true, rel=0.05, abs=0.05 * typical)


def test_a_transparent_part_that_moves_is_climbed_by_differences() -> None:
    """The cage of GelSight Mini bends its gel, by which rays have no derivative."""
    space = {"cages.skin.points": CagePoints(Around(0.5), points=[4, 13, 14])}
    found = method(load("gelsight-mini-ideal"), space, "2to3pw", resolution=32)
    evaluator, bound = slopes_of(found, "2to3pw", {"ray_resolution": (32, 24)}), found.space
    assert bound.size > FEW_PARAMETERS
    with pytest.raises(NoDerivativeError, match="gel"):
        evaluator.gradient(bound.start)
    outcome = evaluator(bound.start, 0)
    assert outcome.parts["2to3pw"][GRADIENT_BY] == GradientSource.DIFFERENCES.value
    assert outcome.gradient is not None
    assert np.abs(outcome.gradient).max() > 0
    found.tell(bound.start[None], [outcome])
    assert "differences of scores" in found.notes()[0]


def test_gelsight360_by_gradient_ends_at_a_narrow_view() -> None:
    """A wide one is a lower hill: 0.909. CMA-ES ends at 0.935 and 108 degrees."""
    space = {"camera.position.z": (0.0, 8.0), "camera.fov": Around(20.0)}
    result = search(
        load("gelsight360"), space, "aoap", method="gradient", budget=24,
        settings=SETTINGS, options={"resolution": 96},
    )  # fmt: skip
    best = result.best
    assert best.outcome.scores["aoap"] > 0.933
    assert best.values["camera.fov"] == pytest.approx(108.0, abs=0.5)
    assert any("differences of scores" in note for note in result.notes)


MIRROR = {
    "cages.M1.points.x": Around(8.0),
    "cages.M1.points.y": Around(1.0),
    "cages.M1.points.z": Around(2.0),
}
"""All points of the cage of GelSight Svelte's mirror, which soon meets the body and the gel."""


def test_an_ascent_slides_along_the_parts_that_the_mirror_meets() -> None:
    """It gets to 0.668 where forbidden points are bad points to the ascent.

    Its way along the limits depends on rounding: it gets to 0.685 on one kind of processor and to
    0.705 on another.
    """
    result = search(load("gelsight-svelte"), MIRROR, "aoap", method="gradient", budget=20)
    assert not any(trial.outcome.failed for trial in result.trials)
    assert result.best.outcome.scores["aoap"] > 0.675
    assert result.trials[1].outcome.seconds == 0.0  # the start is scored once
    assert sum(GRADIENT_HOLDS in trial.parts["aoap"] for trial in result.trials[1:]) == 1


def test_derivatives_that_differences_contradict_at_the_start_are_checked_everywhere(
    coarse_svelte: SensorDesign,
) -> None:
    for contradicted in (False, True):
        evaluator = slopes_of(method(coarse_svelte, MIRROR, resolution=RESOLUTION))
        evaluator._contradicted = contradicted
        space = evaluator.usual.space
        parts = evaluator(space.start + 0.01 * space.span, 0).parts["aoap"]
        assert (GRADIENT_HOLDS in parts) is contradicted
        if not contradicted:
            assert parts[GRADIENT_BY] == GradientSource.RAYS.value


def test_the_same_search_takes_the_same_steps(coarse_svelte: SensorDesign) -> None:
    space: dict[str, object] = {"cages.M1.blend": (0, 1)}
    one, other = (method(coarse_svelte, space, resolution=RESOLUTION) for _ in range(2))
    evaluator = slopes_of(one)
    for _ in range(2):
        asked = one.ask()
        assert np.array_equal(asked, other.ask())
        outcomes = [evaluator(vector, 0) for vector in asked]
        one.tell(asked, outcomes)
        other.tell(asked, outcomes)


def test_what_conditions_limit_has_slopes(coarse_svelte: SensorDesign) -> None:
    bound = SearchSpace({"cages.M1.points[13].x": Around(1.0)}).bind(freed(coarse_svelte, "M1"))
    wanted = ["coverage >= 0", "distortion >= 0", "aoap - 0.2*distortion >= 0"]
    usual = DesignEvaluator(bound, ["aoap"], SETTINGS, requirements=wanted, apart=False)
    problem = Problem(bound, ("aoap",), 10, requirements=tuple(wanted))
    made = Gradient(problem, resolution=RESOLUTION).evaluator(usual)
    evaluator = pickle.loads(pickle.dumps(made))  # as it is sent to workers
    assert isinstance(evaluator, GradientEvaluator)
    _, gradients = evaluator._slopes(bound.start)
    sides = [evaluator._slopes(bound.start + way)[0] for way in (0.1, -0.1)]
    assert gradients[:, 0] == pytest.approx((sides[0] - sides[1]) / 0.2, rel=0.08, abs=2e-5)
    both = gradients[0] - 0.2 * gradients[2]
    assert gradients[3] == pytest.approx(both, rel=1e-5)


def test_an_ascent_ends_on_the_limit_of_its_conditions(coarse_svelte: SensorDesign) -> None:
    """The mirror that is best by AOAP alone shows the skin distorted."""
    given: dict[str, Any] = {"method": "gradient", "settings": SETTINGS, "budget": 12}
    given["options"] = {"resolution": RESOLUTION, "starts": 1}
    space = {"cages.M1.blend": (0.0, 1.0)}
    found = search(coarse_svelte, space, "aoap", require="distortion <= 1.3", **given)
    assert found.best.score > found.start.score
    kept = found.best.conditions["distortion <= 1.3"]
    assert kept is not None and 1.27 < kept <= 1.3


def test_powers_of_lights_climb_by_relit_pictures(mini: SensorDesign) -> None:
    """RGB2Normal wants back the green light of a sensor; only the start is rendered."""
    dark = set_value(mini, "lights.green.flux", 0.1)
    small = {"resolution": (160, 120), "photons": 60_000, "places": [[0, 0], [4, 3]]}
    result = search(
        dark, {"lights.*.flux": (0.05, 6.0)}, "rgb2normal", method="gradient", budget=5,
        settings=small, options={"starts": 1}, require="power <= 60",
    )  # fmt: skip
    assert result.best.score > result.start.score + 0.01
    assert result.best.parts["rgb2normal"][GRADIENT_BY] == GradientSource.LAYERS.value
    power = result.best.conditions["power <= 60"]
    assert power is not None and power <= 60
    exact = evaluate(result.best.design, "rgb2normal", seed=0, **small).value
    assert result.best.score == pytest.approx(exact, abs=1e-4)


def test_differences_of_trials_are_asked_for_together(mini: SensorDesign) -> None:
    """A quadratic function of the design is climbed to its top within the bounds."""

    def hill(design: SensorDesign) -> float:
        x, y, _ = design.camera.position
        return -((x - 0.4) ** 2) - 2.0 * (y - 0.3) ** 2

    space = {"camera.position.x": (-1.0, 1.0), "camera.position.y": (-1.0, 0.2)}
    result = search(mini, space, hill, method="gradient", budget=40)
    assert result.best.values == pytest.approx(
        {"camera.position.x": 0.4, "camera.position.y": 0.2}, abs=0.01
    )
    first = [trial for trial in result.trials if trial.generation == 0]
    assert len(first) == 5


def test_scores_without_derivatives_of_rays_may_depend_on_other_numbers(
    mini: SensorDesign,
) -> None:
    """The power is traced by no ray, as are functions of the design in a file."""
    found = method(mini, {"lights.red.flux": (1.0, 5.0)}, "power")
    assert found.source is GradientSource.TRIALS


@pytest.mark.parametrize(
    ("space", "message"),
    [
        ({"coating.specularity": (0, 1)}, "neither a surface nor the camera"),
        ({"camera.resolution[0]": (100, 104)}, "a whole number has no gradient"),
    ],
)
def test_what_has_no_gradient_is_refused(
    coarse_svelte: SensorDesign, space: dict[str, object], message: str
) -> None:
    with pytest.raises(SearchError, match=message):
        method(coarse_svelte, space)

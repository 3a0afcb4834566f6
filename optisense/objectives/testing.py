"""Contract tests of objectives, for those of this package and for users' own.

To use them, add to a test file for pytest::

    from optisense.objectives.testing import ObjectiveContract

    class TestMine(ObjectiveContract):
        objective = "mine"  # or "path/to/file.py:function"
"""

from __future__ import annotations

import io
import json
import math
from functools import cache, lru_cache
from typing import TYPE_CHECKING, Any

from optisense.objectives.evaluation import Evaluation
from optisense.objectives.registry import Objective, find
from optisense.objectives.run import evaluate
from optisense.objectives.score import Score, numbers_of
from optisense.objectives.settings import Settings

if TYPE_CHECKING:
    from optisense.optics import OpticalModel

PIXELS = (160, 120)
"""Resolution of the images that contract tests score, which then take a few seconds."""
PHOTONS = 300_000
"""Number of photons of these images, small enough for a test of a few seconds."""


@cache
def gelsight_mini() -> OpticalModel:
    """Return a GelSight Mini, which all contract tests share."""
    from optisense.optics import OpticalModel
    from optisense.sensors import load

    return OpticalModel(load("gelsight-mini-ideal"))


@lru_cache(maxsize=4)
def evaluation(seed: int = 0) -> Evaluation:
    """Return an evaluation with small images of the GelSight Mini."""
    settings = Settings(resolution=PIXELS, ray_resolution=PIXELS, photons=PHOTONS, seed=seed)
    return Evaluation(gelsight_mini(), settings)


@cache
def unlit_evaluation() -> Evaluation:
    """Return an evaluation of the GelSight Mini with its lights off."""
    from optisense.design import set_value
    from optisense.optics import OpticalModel
    from optisense.sensors import load

    design = load("gelsight-mini-ideal")
    for name in design.lights:
        design = set_value(design, f"lights.{name}.flux", 1e-12)
    settings = Settings(resolution=(40, 30), ray_resolution=(40, 30), photons=10_000)
    return Evaluation(OpticalModel(design), settings)


ODD_CAMERAS = (
    ("camera.fov", 0.01),
    ("camera.fov", 179.0),
    ("camera.position.z", -900.0),
    ("camera.position.z", 100.0),
    ("camera.position.z", -2.0),
)
"""Camera values with unusual views: a spot of the skin, the skin as a spot, the skin from far away,
from behind, and from inside the gel."""


@lru_cache(maxsize=len(ODD_CAMERAS))
def odd_evaluation(path: str, value: float) -> Evaluation:
    """Return an evaluation of a GelSight Mini with one value of its camera changed."""
    from optisense.design import set_value
    from optisense.optics import OpticalModel
    from optisense.sensors import load

    design = set_value(load("gelsight-mini-ideal"), path, value)
    settings = Settings(resolution=(40, 30), ray_resolution=(80, 60), photons=10_000)
    return Evaluation(OpticalModel(design), settings)


class ObjectiveContract:
    """The contract; a subclass names the objective.

    Attributes:
        objective: name, or ``file.py:function``.
        settings: settings of the objective for the tests.
    """

    objective: str
    settings: dict[str, Any] = {}  # noqa: RUF012
    _kept: Score | None = None

    def __init_subclass__(cls) -> None:
        cls._kept = None

    def found(self) -> Objective:
        """The objective under test."""
        return find(self.objective)

    def score(self) -> Score:
        """Its score of a GelSight Mini."""
        return evaluate(evaluation(), self.found(), **self.settings)

    def kept_score(self) -> Score:
        """The same, evaluated once for all tests that only read it."""
        contract = type(self)
        if contract._kept is None:
            contract._kept = self.score()
        return contract._kept

    def test_it_is_found_by_its_name(self) -> None:
        """The registry returns the same objective for its name."""
        found = self.found()
        assert find(found.name) is found

    def test_its_settings_have_defaults(self) -> None:
        """Every setting has a name and a default."""
        assert all(isinstance(name, str) for name in self.found().settings)

    def test_it_says_what_it_measures(self) -> None:
        """It has a title and a description."""
        assert self.found().title
        assert len(self.found().summary) > 10

    def test_it_scores_a_gelsight_mini(self) -> None:
        """The score of a GelSight Mini is finite."""
        score = self.kept_score()
        assert score.failure is None
        assert isinstance(score.value, float)
        assert math.isfinite(score.value)
        assert score.seconds >= 0.0

    def test_the_same_images_give_the_same_score_and_leave_the_sensor_as_it_was(self) -> None:
        """The score depends on nothing but the images, and scoring does not change the design."""
        first = self.kept_score().value
        before = gelsight_mini().design.model_dump_json()
        assert self.score().value == first
        assert gelsight_mini().design.model_dump_json() == before

    def test_its_parts_can_be_written_as_json(self) -> None:
        """The score and its parts are valid JSON."""
        score = self.kept_score()
        text = json.dumps(score.to_dict(), allow_nan=False)
        assert json.loads(text)["value"] == score.value

    def test_its_numbers_are_those_of_its_parts(self) -> None:
        """The names of its numbers, if it states them, are those of its parts."""
        numbers = self.found().numbers
        found = set(numbers_of(self.kept_score().parts))
        assert numbers is None or set(numbers) == found

    def test_it_can_be_drawn_and_shown(self) -> None:
        """It has a figure, and a table for notebooks."""
        score = self.kept_score()
        buffer = io.BytesIO()
        score.figure().savefig(buffer, format="png", dpi=30)
        assert buffer.getvalue().startswith(b"\x89PNG")
        assert score.name in score._repr_html_()

    def test_its_range_is_told_and_kept(self) -> None:
        """The score lies within the range that the objective states."""
        low, high = self.found().bounds(self.settings)
        assert low < high
        assert low <= self.kept_score().value <= high

    def test_cameras_that_see_little_give_a_score_in_its_range_or_a_reason(self) -> None:
        """Unusual cameras give a valid score, or a failure with a reason."""
        low, high = self.found().bounds(self.settings)
        for path, value in ODD_CAMERAS:
            score = evaluate(odd_evaluation(path, value), self.found(), **self.settings)
            if score.failure is None:
                assert low <= score.value <= high, f"{path} = {value}"
            else:
                assert math.isnan(score.value), f"{path} = {value}"
                assert len(score.failure) > 10, f"{path} = {value}"

    def test_a_sensor_without_light_gives_a_score_or_a_reason(self) -> None:
        """A dark sensor gives a valid score, or a failure with a reason."""
        score = evaluate(unlit_evaluation(), self.found(), **self.settings)
        if score.failure is None:
            assert math.isfinite(score.value)
        else:
            assert math.isnan(score.value)
            assert len(score.failure) > 10

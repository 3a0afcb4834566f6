"""Cameras that look past the mirrors of their sensor, or at a small part of what they should.

The points are winners of `benchmarks/single_parameters.py` that a person would not accept.
"""

from __future__ import annotations

import pickle

import numpy as np
import pytest

import optisense as ots
from optisense import sensors
from optisense.design import SensorDesign
from optisense.search.evaluation.evaluator import DesignEvaluator
from optisense.search.evaluation.models import SameMirrors
from optisense.search.space.search_space import SearchSpace

RAYS = {"ray_resolution": (40, 30)}


def evaluator(design: SensorDesign, path: str) -> DesignEvaluator:
    bound = SearchSpace({path: (-100.0, 100.0)}).bind(design, tried=False)
    return DesignEvaluator(bound, ["aoap"], RAYS)


def test_which_mirrors_a_camera_looks_by(svelte: SensorDesign) -> None:
    """All rays of Svelte go by both of its mirrors, and those of Mini, which has none, straight."""
    both = frozenset({"M1", "M2"})
    assert ots.OpticalModel(svelte).views_by_mirrors((48, 36)) == {both: 1.0}
    mini = ots.OpticalModel(sensors.load("gelsight-mini-ideal"))
    assert mini.views_by_mirrors((48, 36)) == {frozenset(): 1.0}


@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("camera.turn.y", -30.0),
        ("camera.direction.z", 1.1832),
        ("camera.position.z", 10.0),
    ],
)
def test_a_camera_that_looks_past_its_mirrors(
    svelte: SensorDesign, path: str, value: float
) -> None:
    said = evaluator(svelte, path)(np.array([value]), 0).failure
    assert "directly instead of by 'M1' and 'M2'" in str(said)


@pytest.mark.parametrize(
    ("path", "value"),
    [("camera.turn.y", 10.0), ("camera.position.x", 10.0), ("parts.M2.turn.y", 1.0)],
)
def test_a_camera_that_looks_by_them(svelte: SensorDesign, path: str, value: float) -> None:
    one = evaluator(svelte, path)
    assert any(isinstance(rule, SameMirrors) for rule in one.kept)
    outcome = pickle.loads(pickle.dumps(one))(np.array([value]), 0)
    assert outcome.failure is None


def test_light_does_not_ask_for_the_view(svelte: SensorDesign) -> None:
    bound = SearchSpace({"lights.red.flux": (0.0, 1.0)}).bind(svelte)
    assert DesignEvaluator(bound, ["aoap"], RAYS).kept == []


class TestLeastOfTheStart:
    """GelSight360 sees 0.75 of its skin, so that trials must see 0.375; 50 degrees show 0.31."""

    def failure(self, value: float, settings: dict[str, float]) -> str | None:
        design = sensors.load("gelsight360")
        bound = SearchSpace({"camera.fov": (20.0, 200.0)}).bind(design)
        one = DesignEvaluator(bound, ["aoap"], {**RAYS, **settings})
        return one(np.array([value]), 0).failure

    def test_the_tip_of_a_finger_is_not_the_finger(self) -> None:
        said = str(self.failure(50.0, {}))
        assert "of the sensing surface's area is seen, and a score needs 37." in said
        assert "least_skin" in said

    def test_a_wider_view_is_scored(self) -> None:
        assert self.failure(80.0, {}) is None

    def test_a_setting_goes_before(self) -> None:
        assert self.failure(50.0, {"least_skin": 0.25}) is None

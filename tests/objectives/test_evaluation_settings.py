"""Settings of evaluations and objectives: which are taken, and which are refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from optisense import OpticalModel, evaluate
from optisense.errors import ObjectiveError
from optisense.objectives import Settings


@pytest.mark.parametrize(
    "settings",
    [
        {"depth": 0},
        {"depth": 2.0},
        {"depth": "deep"},
        {"depth": True},
        {"radius": -1},
        {"seed": -1},
        {"seed": 1.5},
        {"photons": 0},
        {"resolution": 320},
        {"resolution": (0, 10)},
        {"places": ()},
        {"places": ((1, 2, 3),)},
        {"exposure": "bright"},
        {"exposure": 0},
        {"noise": "much"},
        {"half_lines": 1},
        {"directions": 4.5},
        {"colours": 3},
        {"dept": 0.3},
    ],
    ids=str,
)
def test_settings_that_make_no_sense_are_refused(
    model: OpticalModel, settings: dict[str, Any]
) -> None:
    with pytest.raises(ObjectiveError):
        evaluate(model, ["rgb2normal", "normdiff"], **settings)


def test_settings_may_be_numbers_and_arrays_of_numpy(model: OpticalModel) -> None:
    given: dict[str, Any] = {
        "resolution": np.array([40, 30]),
        "ray_resolution": (np.int64(40), np.int64(30)),
        "photons": np.int64(1000),
        "seed": np.int64(1),
        "depth": np.float32(0.25),
        "places": np.array([[0.0, 0.0], [2.0, 1.0]]),
        "exposure": np.float32(2.0),
    }
    assert Settings(**given) == Settings(
        (40, 30), (40, 30), 1000, 1, depth=0.25, places=((0, 0), (2, 1)), exposure=2.0
    )
    weight = {"coverage_weight": np.float32(0.5)}  # a setting of the objective itself
    found = evaluate(model, "aoap", ray_resolution=given["resolution"], **weight)  # type: ignore[arg-type]
    same = evaluate(model, "aoap", ray_resolution=(40, 30), coverage_weight=0.5)
    assert found.value == same.value


@pytest.mark.parametrize(
    ("name", "setting", "complaint"),
    [
        ("normdiff", {"noise": -0.1}, "'noise' is -0.1. Give a number from 0 to 1"),
        ("normdiff", {"noise": 1.5}, "from 0 to 1"),
        ("normdiff", {"phi_weight": -1.0}, "'phi_weight' is -1. Give a number from 0"),
        ("normdiff", {"colours": "hue"}, "no colours 'hue'"),
        ("rgb2normal", {"colours": "hue"}, "Use picture or response"),
        ("rgb2normal", {"directions": 3}, "even number"),
        ("rgb2normal", {"directions": 0}, "even number"),
        ("rgb2normal", {"least_pixels": 1}, "from 3"),
        ("aoap", {"coverage_weight": -0.5}, "'coverage_weight'"),
        ("2to3pw", {"jump": 1.0}, "above 1"),
    ],
)
def test_settings_of_objectives_are_refused_before_anything_is_rendered(
    model: OpticalModel,
    monkeypatch: pytest.MonkeyPatch,
    name: str,
    setting: dict[str, Any],
    complaint: str,
) -> None:
    for work in ("render", "chief_rays"):
        monkeypatch.setattr(model, work, lambda *args, **kwargs: pytest.fail("rendered"))
    score = evaluate(model, name, **setting)
    assert score.failure is not None and complaint in score.failure


def test_a_misspelt_setting_gets_the_near_match(model: OpticalModel) -> None:
    with pytest.raises(ObjectiveError, match="Did you mean 'half_lines'"):
        evaluate(model, "rgb2normal", half_line=True)

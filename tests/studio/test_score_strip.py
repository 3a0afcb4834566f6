"""The strip of scores: how good each is among sensors, how it changed, and while one edits."""

from __future__ import annotations

from typing import Any

import bpy
import pytest
from mathutils import Vector
from recording import draw
from waiting import until

from studio.core import scores
from studio.engine import catalogue
from studio.evaluate import live
from studio.evaluate.ui import OPTISENSE_PT_evaluate
from studio.scene.collections import objects_of


def evaluated(*names: str) -> Any:
    until(lambda: bool(catalogue.entries("objectives")))
    values = bpy.context.window_manager.optisense_evaluation
    values.chosen = set(names)
    assert bpy.ops.optisense.evaluate() == {"FINISHED"}
    return values


def test_a_share_goes_from_poor_to_good() -> None:
    about = {"usual": [0.2, 0.6]}
    assert [scores.share(v, about) for v in (0.2, 0.4, 0.9, 0.0)] == pytest.approx([0, 0.5, 1, 0])
    lower = {"usual": [4.0, 1.0], "lower_is_better": True}
    assert scores.share(1.6, lower) == pytest.approx(0.8)
    assert scores.share(0.25, {"range": [0.0, 1.0]}) == 0.25
    assert scores.share(0.25, {"range": [0.0, 1.0], "lower_is_better": True}) == 0.75
    assert scores.share(None, about) is None and scores.share(3.0, {}) is None


def test_a_change_says_whether_it_is_better() -> None:
    assert scores.change(0.52, 0.5, lower_is_better=False) == "+0.02 better"
    assert scores.change(0.52, 0.5, lower_is_better=True) == "+0.02 worse"
    assert scores.change(-51.0, -50.0, lower_is_better=False) == "-1.0 worse"
    assert scores.change(0.5, 0.5 + 1e-8, lower_is_better=False) == "unchanged"
    assert scores.change(0.5, None, lower_is_better=False) == ""


def test_every_score_is_one_line_until_it_is_opened(mini: Any) -> None:
    values = evaluated("aoap", "distortion", "2to3pw")
    layout = draw(OPTISENSE_PT_evaluate)
    assert layout is not None and layout.properties.count("per_cent") == 3
    assert not any("coverage:" in text for text in layout.texts)
    for score in values.scores:
        assert 0.0 <= score.share <= 1.0 and score.has_share and score.change == ""
    assert values.scores["distortion"].direction == "lower is better"
    values.scores["aoap"].is_open = True
    layout = draw(OPTISENSE_PT_evaluate)
    assert layout is not None and "Higher is better" in layout.texts
    assert any("coverage:" in text for text in layout.texts)


def test_the_change_since_the_last_edit_is_told(mini: Any) -> None:
    values = evaluated("aoap")
    before = values.scores["aoap"].number
    objects_of(mini, "CAMERA")[0].rotation_euler.x += 0.3  # it looks at a slant now
    values = evaluated("aoap")
    score = values.scores["aoap"]
    assert score.number < before and score.change.endswith("worse")
    assert evaluated("aoap").scores["aoap"].change == "unchanged"
    bpy.ops.optisense.new(sensor="gelsight-mini-ideal")
    assert evaluated("aoap").scores["aoap"].change == ""  # those of another sensor do not count


def test_scores_by_rays_follow_while_one_edits(mini: Any) -> None:
    values = evaluated("aoap", "2to3pw")
    values.chosen = {"aoap", "2to3pw", "normdiff"}
    assert live.objectives(bpy.context) == ["2to3pw", "aoap"]
    before = values.scores["aoap"].number
    values.live = True
    try:
        objects_of(mini, "CAMERA")[0].location += Vector((4.0, 0.0, 0.0))
        objects_of(mini, "CAMERA")[0].optisense.fov = 65.0
        bpy.context.view_layer.update()
        until(lambda: values.scores["aoap"].is_live)
        assert values.scores["aoap"].number != pytest.approx(before, abs=1e-4)
        layout = draw(OPTISENSE_PT_evaluate)
        assert layout is not None and any("Scored while editing" in text for text in layout.texts)
    finally:
        values.live = False
    assert not live._request.is_wanted
    assert not evaluated("aoap").scores["aoap"].is_live

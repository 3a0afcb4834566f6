"""Scores, and their figures in full."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import pytest

from studio.core.numbers import shown_number
from studio.evaluate import figures
from studio.evaluate import operator as evaluate_operator
from studio.scene.collections import objects_of
from studio.simulate import editors


def evaluated(*names: str, own: str = "") -> Any:
    values = bpy.context.window_manager.optisense_evaluation
    values.chosen, values.own = set(names), own
    assert bpy.ops.optisense.evaluate() == {"FINISHED"}
    values.own = ""
    return values


def test_figures_open_in_full(mini: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    shown: list[Any] = []
    monkeypatch.setattr(editors, "show", lambda context, image: shown.append(image))
    monkeypatch.setattr(editors, "can_show", lambda operator, context: True)
    scores = evaluated("aoap", "2to3pw").scores
    assert bpy.ops.optisense.show_figure(objective="2to3pw") == {"FINISHED"}
    (image,) = shown
    assert image.name == figures.PREFIX + scores["2to3pw"].title
    assert image.packed_file is not None and image.size[0] >= 900 and image.size[1] >= 400
    assert figures.PREFIX + scores["aoap"].title in bpy.data.images  # in the editor's list too
    before = len(bpy.data.images)
    image.use_fake_user = True
    evaluated("aoap", "2to3pw")
    assert bpy.ops.optisense.show_figure(objective="aoap") == {"FINISHED"}
    assert len(bpy.data.images) == before  # in place of those before
    Path(scores["aoap"].figure).unlink()
    with pytest.raises(RuntimeError, match="no figure of 'aoap'"):
        bpy.ops.optisense.show_figure(objective="aoap")


def test_without_a_figure_the_button_says_why(mini: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    bpy.context.window_manager.optisense_evaluation.scores.clear()
    with pytest.raises(RuntimeError, match="There is no figure yet: evaluate first"):
        bpy.ops.optisense.show_figure()


def test_an_objective_of_ones_own(mini: Any, tmp_path: Path) -> None:
    file = tmp_path / "mine.py"
    file.write_text(
        "from optisense.objectives import Score\n\n\n"
        "def lights(evaluation):\n"
        "    count = sum(len(group.lights) for group in evaluation.model.design.lights.values())\n"
        "    return Score('lights', float(count), parts={'groups': 3, 'share': 0.123456})\n"
    )
    values = evaluated(own=f"{file}:lights")
    score = values.scores[0]
    assert (score.value, score.failure) == ("15", "")
    assert score.parts.splitlines() == ["groups: 3", "share: 0.1235"]
    assert Path(score.figure).is_file()


def test_scores_of_the_sensor_before_say_so(mini: Any) -> None:
    values = evaluated("aoap")
    assert not values.is_before
    bpy.ops.optisense.new(sensor="gelsight-mini-ideal")
    assert values.is_before
    evaluate_operator.take({"scores": []}, mini)
    assert not values.is_before


def test_rays_are_coloured_by_outcome_and_leave_with_their_sensor(scene: Any) -> None:
    assert bpy.ops.optisense.new(sensor="gelsight-svelte") == {"FINISHED"}
    assert bpy.ops.optisense.show_rays() == {"FINISHED"}
    values = bpy.context.window_manager.optisense_evaluation
    drawn = {each.optisense.key: tuple(each.color) for each in objects_of(scene, "SHOWN")}
    assert {"ray hit", "ray absorbed"} <= drawn.keys() and len(set(drawn.values())) == len(drawn)
    assert "hit (green)" in values.rays and "absorbed (black)" in values.rays
    assert bpy.ops.optisense.new(sensor="gelsight-mini-ideal") == {"FINISHED"}
    assert not objects_of(scene, "SHOWN") and not values.rays and not bpy.data.curves


def test_counts_are_shown_in_full() -> None:
    assert shown_number(307200) == "307,200"
    assert shown_number(0.97284) == "0.9728"
    assert shown_number(1.0) == "1.0" and shown_number(1.2e-7) == "1.2e-07"
    assert shown_number(True) == "yes"

"""The tour and the help that come with the extension."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import bpy
import pytest
from recording import draw, panels

from studio.core import guide as pages
from studio.engine import guide
from studio.sensor import tour
from studio.sensor.ui import OPTISENSE_PT_sensor


def test_every_panel_has_help_at_its_own_paragraph() -> None:
    for panel in panels():
        assert bpy.ops.optisense.help(topic=panel.bl_label) == {"FINISHED"}
        text, line = guide.text_of(panel.bl_label)
        assert text.lines[line].body.startswith(f"{panel.bl_order} {panel.bl_label}.")
        assert text.current_line_index == line


def test_every_topic_has_a_page_without_pictures_and_addresses() -> None:
    names = {page for page, _ in guide.STEPS.values()}
    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())
    brought = project["tool"]["hatch"]["build"]["targets"]["wheel"]["shared-data"]
    assert names == {Path(file).stem for file in brought if file.startswith("docs/")}
    assert set(guide.MORE) <= set(guide.STEPS) and set(guide.MORE.values()) <= set(guide.STEPS)
    for name in names:
        text = pages.page(name)
        assert "](" not in text and "![" not in text and len(text) > 1000
        assert "**" not in text and "```" not in text
    assert len([each for each in bpy.data.texts if each.name.startswith(guide.NAME)]) <= len(names)


def test_help_that_is_not_there_is_told(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    with pytest.raises(RuntimeError, match="no help on 'Weather'"):
        bpy.ops.optisense.help(topic="Weather")
    monkeypatch.setattr(pages, "folder", lambda: tmp_path)
    with pytest.raises(RuntimeError, match="can't be read"):
        bpy.ops.optisense.help(topic="Simulate")


def test_the_tour_goes_on_as_its_steps_are_done(scene: Any) -> None:
    def told() -> str:
        layout = draw(OPTISENSE_PT_sensor)
        assert layout is not None
        return " ".join(layout.texts)

    manager = bpy.context.window_manager
    manager.optisense_evaluation.scores.clear()
    layout = draw(OPTISENSE_PT_sensor)
    assert layout is not None and "optisense.tour" in layout.operators
    assert bpy.ops.optisense.tour() == {"FINISHED"}
    try:
        assert "step 1 of 5" in told()
        assert bpy.ops.optisense.new(sensor="gelsight-mini-ideal") == {"FINISHED"}
        assert "step 2 of 5" in told() and "Middle" in told()
        assert bpy.ops.optisense.add_contact() == {"FINISHED"}
        assert "step 3 of 5" in told()
        scene = bpy.context.scene
        scene.optisense_simulation.size, scene.optisense_simulation.noise = "160", 50.0
        assert bpy.ops.optisense.simulate() == {"FINISHED"}
        assert "step 4 of 5" in told()
        manager.optisense_picture.is_relit = True
        assert "step 5 of 5" in told()
        manager.optisense_evaluation.chosen = {"aoap"}
        assert bpy.ops.optisense.evaluate() == {"FINISHED"}
        assert tour.step_now(bpy.context) == 5 and "That was the tour" in told()
    finally:
        assert bpy.ops.optisense.tour() == {"FINISHED"}
    assert "Tour" not in told()

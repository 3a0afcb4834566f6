"""The sliders of light groups: whatever they show, the picture shows."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from shown_picture import shown

from studio.engine import session
from studio.simulate import relight


def test_undo_relights_the_picture(mini: Any) -> None:
    mini.optisense_simulation.size, mini.optisense_simulation.noise = "160", 50.0
    assert bpy.ops.optisense.simulate() == {"FINISHED"}
    bpy.ops.ed.undo_push(message="Simulate")
    before = shown()
    mini.optisense_simulation.auto_exposure = False
    assert np.array_equal(shown(), before)
    bpy.ops.ed.undo_push(message="Exposure")
    bpy.context.scene.optisense.light_groups[0].flux = 20.0
    brighter = shown()
    assert brighter.mean() > before.mean()
    bpy.ops.ed.undo_push(message="Flux")
    bpy.ops.ed.undo()
    assert np.allclose(shown(), before, atol=1e-6)
    bpy.ops.ed.redo()
    assert np.array_equal(shown(), brighter)


def test_a_late_answer_does_not_reach_the_next_sensor(mini: Any) -> None:
    settings, now = mini.optisense_simulation, bpy.context.window_manager.optisense_picture
    settings.size, settings.noise = "160", 50.0
    assert bpy.ops.optisense.simulate() == {"FINISHED"}
    before = shown()
    mini.optisense.light_groups[0].flux = 20.0
    assert relight._open is not None and not relight._open.done
    kept = settings.exposure
    mini.optisense.opening = "another sensor"
    assert np.array_equal(shown(), before) and not now.is_relit
    assert settings.auto_exposure and settings.exposure == kept


def test_a_group_without_a_colour_is_dark(mini: Any) -> None:
    mini.optisense_simulation.size, mini.optisense_simulation.noise = "160", 50.0
    assert bpy.ops.optisense.simulate() == {"FINISHED"}
    group = mini.optisense.light_groups[0]
    group.colour = (0.0, 0.0, 0.0)
    dark = shown()
    group.colour, group.flux = (1.0, 0.0, 0.0), 0.0
    assert np.array_equal(dark, shown())


def test_the_lights_of_another_scene_do_not_relight_the_picture(mini: Any) -> None:
    mini.optisense_simulation.size, mini.optisense_simulation.noise = "160", 50.0
    bpy.context.window_manager.optisense_evaluation.chosen = {"aoap"}
    assert bpy.ops.optisense.simulate() == {"FINISHED"}
    assert bpy.ops.optisense.evaluate() == {"FINISHED"}
    before, name = shown(), mini.name
    bpy.ops.scene.new(type="FULL_COPY")
    other = bpy.context.scene
    assert other != mini and other.optisense.is_open
    now = bpy.context.window_manager.optisense_picture
    scored = bpy.context.window_manager.optisense_evaluation
    other.optisense.light_groups[0].flux = 0.0
    session.ask_and_wait("library", kind="coating")  # a relighting would have come before this
    assert np.array_equal(shown(), before) and not now.is_relit
    for result in (now, scored):
        assert result.other_sensor(other) == f"sensor of the scene '{name}'"
    assert not bpy.ops.optisense.report.poll()
    assert bpy.ops.optisense.new(sensor="gelsight-mini-ideal") == {"FINISHED"}
    bpy.context.window.scene = mini
    assert not now.other_sensor(mini) and not scored.other_sensor(mini)
    assert bpy.ops.optisense.report.poll()
    mini.optisense.light_groups[0].flux = 0.0
    session.engine().wait(relight._open)
    assert now.is_relit and not np.array_equal(shown(), before)

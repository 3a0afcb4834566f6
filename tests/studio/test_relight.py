"""The sliders of light groups: whatever they show, the picture shows."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from shown_picture import shown


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


def test_a_group_without_a_colour_is_dark(mini: Any) -> None:
    mini.optisense_simulation.size, mini.optisense_simulation.noise = "160", 50.0
    assert bpy.ops.optisense.simulate() == {"FINISHED"}
    group = mini.optisense.light_groups[0]
    group.colour = (0.0, 0.0, 0.0)
    dark = shown()
    group.colour, group.flux = (1.0, 0.0, 0.0), 0.0
    assert np.array_equal(dark, shown())

"""Introductory tour: five steps from nothing to a picture under other light and its score."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import bpy
from bpy.props import BoolProperty

from ..engine.layout import paragraph
from ..scene.collections import objects_of


class Step(NamedTuple):
    """Step of the tour: an instruction, and the condition under which it is done."""

    text: str
    is_done: Callable[[bpy.types.Context], bool]


def _is_simulated(picture: bpy.types.PropertyGroup) -> bool:
    """Return whether there is a picture that was asked for, not the draft of an opened sensor."""
    return picture.shown and not picture.is_draft


STEPS = (
    Step(
        "Choose New Sensor > GelSight Mini, just below.",
        lambda c: c.scene.optisense.is_open,
    ),
    Step(
        "Open the panel Simulate and press Middle: a ball is pressed into the skin.",
        lambda c: bool(objects_of(c.scene, "CONTACT")),
    ),
    Step(
        "Press Simulate: after some seconds, the picture of the sensor's camera appears.",
        lambda c: _is_simulated(c.window_manager.optisense_picture),
    ),
    Step(
        "Change a flux or a colour under Relight: the picture follows at once.",
        lambda c: c.window_manager.optisense_picture.is_relit,
    ),
    Step(
        "Open Evaluate, tick AOAP and press Evaluate: the arrow beside the score explains it.",
        lambda c: bool(c.window_manager.optisense_evaluation.scores),
    ),
)
"""Steps of the tour in their order."""

OVER = "That was the tour. The question mark in the header of a panel opens its help page."


class OPTISENSE_PG_tour(bpy.types.PropertyGroup):
    """State of the tour; never saved."""

    is_on: BoolProperty(name="Tour", description="Show the next step", options={"SKIP_SAVE"})


def step_now(context: bpy.types.Context) -> int:
    """Return the number of the first step that is not done, from 0, or of all steps."""
    return next(
        (number for number, step in enumerate(STEPS) if not step.is_done(context)), len(STEPS)
    )


class OPTISENSE_OT_tour(bpy.types.Operator):
    """Take the tour: five steps to a first picture and its score; or end it"""

    bl_idname = "optisense.tour"
    bl_label = "Tour"
    bl_options = {"INTERNAL"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        values = context.window_manager.optisense_tour
        values.is_on = not values.is_on
        return {"FINISHED"}


def draw(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw the next step, or the button that starts the tour if no sensor is open."""
    if not context.window_manager.optisense_tour.is_on:
        if not context.scene.optisense.is_open:
            layout.operator("optisense.tour", text="Take the Tour", icon="INFO")
        return
    box = layout.box()
    number = step_now(context)
    row = box.row()
    over = number == len(STEPS)
    row.label(text="Tour" if over else f"Tour: step {number + 1} of {len(STEPS)}", icon="INFO")
    row.operator("optisense.tour", text="", icon="X", emboss=False)
    paragraph(box, OVER if over else STEPS[number].text, boxed=True)


PROPERTIES = {"WindowManager": {"optisense_tour": OPTISENSE_PG_tour}}

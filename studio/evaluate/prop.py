"""Properties of an evaluation: the chosen objectives, and the scores."""

from __future__ import annotations

from collections.abc import Callable

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    FloatProperty,
    StringProperty,
)

from ..engine import catalogue
from ..scene.results import OfScene

when_live_changed: list[Callable[[], None]] = []
"""Callbacks for live scoring being switched on or off."""


def _live_changed(values: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    for each in when_live_changed:
        each()


class OPTISENSE_PG_score(bpy.types.PropertyGroup):
    """Score; its name is that of the objective."""

    title: StringProperty()
    value: StringProperty()
    number: FloatProperty(description="Value of the score in single precision")
    share: FloatProperty(
        description="Position between the worst (0) and the best (1) built-in sensor"
    )
    per_cent: FloatProperty(
        name="How good", subtype="PERCENTAGE", min=0.0, max=100.0, precision=0,
        description="Position between the worst (0) and the best (100) built-in sensor, or "
        "between all "
        "values that the objective can have",
        get=lambda self: round(100.0 * self.share),
    )  # fmt: skip
    has_share: BoolProperty(description="Whether the objective has a scale from worst to best")
    unit: StringProperty()
    direction: StringProperty(description="Whether higher or lower values are better, in words")
    change: StringProperty(description="Change since the last evaluation, in words")
    is_open: BoolProperty(name="Details", description="Show the parts and the figure of this score")
    is_live: BoolProperty(description="Whether the score was computed while the sensor was edited")
    parts: StringProperty(description="Parts of the score, one 'name: number' a line")
    failure: StringProperty()
    figure: StringProperty(description="File of the picture that explains the score")


class OPTISENSE_PG_evaluation(OfScene, bpy.types.PropertyGroup):
    """Last evaluation; never saved."""

    chosen: EnumProperty(
        name="Objectives",
        items=catalogue.objectives,
        options={"ENUM_FLAG", "SKIP_SAVE"},
        description="Objectives with which the sensor is evaluated",
    )
    live: BoolProperty(
        name="Score while editing",
        description="Update the scores that only trace rays, such as AOAP, while the "
        "camera, parts and cages are moved",
        update=_live_changed,
        options={"SKIP_SAVE"},
    )
    own: StringProperty(
        name="Your own",
        description="Your own objective, evaluated with the others: FILE.py:FUNCTION, or only "
        "FILE.py where a decorator in it says which function it is",
        subtype="FILE_PATH",
        options={"SKIP_SAVE"},
    )
    is_before: BoolProperty(
        description="Whether the scores belong to the sensor that was open before",
        options={"SKIP_SAVE"},
    )
    scores: CollectionProperty(type=OPTISENSE_PG_score, options={"SKIP_SAVE"})
    rays: StringProperty(
        description="Numbers of chief rays that reach the skin, escape or are absorbed",
        options={"SKIP_SAVE"},
    )


PROPERTIES = {"WindowManager": {"optisense_evaluation": OPTISENSE_PG_evaluation}}

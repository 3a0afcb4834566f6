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

when_live_changed: list[Callable[[], None]] = []
"""Callbacks for live scoring being switched on or off."""


def _live_changed(values: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    for each in when_live_changed:
        each()


class OPTISENSE_PG_score(bpy.types.PropertyGroup):
    """Score; its name is that of the objective."""

    title: StringProperty()
    value: StringProperty()
    number: FloatProperty(description="The value in single precision")
    share: FloatProperty(description="How good it is, 0 to 1")
    per_cent: FloatProperty(
        name="How good", subtype="PERCENTAGE", min=0.0, max=100.0, precision=0,
        description="From the poorest (0) to the best (100) of the built-in sensors, or of all "
        "values that the objective can have",
        get=lambda self: 100.0 * self.share,
    )  # fmt: skip
    has_share: BoolProperty(description="Its objective says what is poor and what is good")
    unit: StringProperty()
    direction: StringProperty(description="Which way it is good, in words")
    change: StringProperty(description="Since the scores before, in words")
    is_open: BoolProperty(name="Details", description="Show its parts and its figure")
    is_live: BoolProperty(description="It was scored while the sensor was edited")
    parts: StringProperty(description="One 'name: number' a line")
    failure: StringProperty()
    figure: StringProperty(description="A picture file")


class OPTISENSE_PG_evaluation(bpy.types.PropertyGroup):
    """Last evaluation; never saved."""

    chosen: EnumProperty(
        name="Objectives",
        items=catalogue.objectives,
        options={"ENUM_FLAG", "SKIP_SAVE"},
        description="What the sensor is scored by",
    )
    live: BoolProperty(
        name="Score while editing",
        description="Keep the scores up to date that trace rays only, such as AOAP, while the "
        "camera, parts and cages are moved",
        update=_live_changed,
        options={"SKIP_SAVE"},
    )
    own: StringProperty(
        name="Your own",
        description="An objective of your own, scored with the others: FILE.py:FUNCTION, or only "
        "FILE.py where a decorator in it says which function it is",
        subtype="FILE_PATH",
        options={"SKIP_SAVE"},
    )
    is_before: BoolProperty(
        description="They are of the sensor that was open before", options={"SKIP_SAVE"}
    )
    scores: CollectionProperty(type=OPTISENSE_PG_score, options={"SKIP_SAVE"})
    rays: StringProperty(description="What became of the chief rays", options={"SKIP_SAVE"})


PROPERTIES = {"WindowManager": {"optisense_evaluation": OPTISENSE_PG_evaluation}}

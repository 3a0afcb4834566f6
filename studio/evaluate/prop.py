"""Which objectives to score by, and the scores."""

from __future__ import annotations

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    StringProperty,
)

from ..engine import catalogue


class OPTISENSE_PG_score(bpy.types.PropertyGroup):
    """A score; its name is the objective's."""

    title: StringProperty()
    value: StringProperty()
    parts: StringProperty(description="One 'name: number' a line")
    failure: StringProperty()
    figure: StringProperty(description="A picture file")


class OPTISENSE_PG_evaluation(bpy.types.PropertyGroup):
    """The last evaluation; never saved."""

    chosen: EnumProperty(
        name="Objectives",
        items=catalogue.objectives,
        options={"ENUM_FLAG", "SKIP_SAVE"},
        description="What the sensor is scored by",
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

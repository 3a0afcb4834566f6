"""Which objectives to score by, and the scores."""

from __future__ import annotations

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    IntProperty,
    PointerProperty,
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
        name="Objectives", items=catalogue.objectives, options={"ENUM_FLAG", "SKIP_SAVE"}
    )
    own: StringProperty(
        name="Your own",
        description="A Python file with an objective of your own and, where it has several "
        "functions, the one after a colon: FILE.py:FUNCTION",
        subtype="FILE_PATH",
        options={"SKIP_SAVE"},
    )
    is_before: BoolProperty(
        description="They are of the sensor that was open before", options={"SKIP_SAVE"}
    )
    scores: CollectionProperty(type=OPTISENSE_PG_score, options={"SKIP_SAVE"})
    score_index: IntProperty(options={"SKIP_SAVE"})
    rays: StringProperty(description="What became of the chief rays", options={"SKIP_SAVE"})


def register() -> None:
    bpy.utils.register_class(OPTISENSE_PG_score)
    bpy.utils.register_class(OPTISENSE_PG_evaluation)
    bpy.types.WindowManager.optisense_evaluation = PointerProperty(
        type=OPTISENSE_PG_evaluation, options={"SKIP_SAVE"}
    )


def unregister() -> None:
    del bpy.types.WindowManager.optisense_evaluation
    bpy.utils.unregister_class(OPTISENSE_PG_evaluation)
    bpy.utils.unregister_class(OPTISENSE_PG_score)

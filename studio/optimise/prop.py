"""What may vary, how to search, and how far the search is."""

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


def _methods(values: bpy.types.PropertyGroup, context: bpy.types.Context) -> catalogue.Items:
    return catalogue.items("methods")


class OPTISENSE_PG_vary(bpy.types.PropertyGroup):
    """A parameter of the search; its name is a label."""

    active: BoolProperty(name="Vary", default=True)
    text: StringProperty(
        name="Range", description="PATH=LOW:HIGH, PATH=+-REACH, PATH=LOW:HIGH:STEPS or PATH=A,B"
    )


class OPTISENSE_PG_search(bpy.types.PropertyGroup):
    """The search of a scene; kept in the .blend file, so that it can go on another day."""

    vary: CollectionProperty(type=OPTISENSE_PG_vary)
    vary_index: IntProperty()
    objective: StringProperty(name="Objective", default="aoap")
    method: StringProperty(name="Method", default="cma-es")
    budget: IntProperty(
        name="Trials", description="In all; 0 leaves it to the method", min=0, default=60
    )
    workers: IntProperty(name="Workers", description="Processes", min=1, max=256, default=1)
    seed: IntProperty(name="Seed", min=0, max=2**31 - 1)
    go_on: BoolProperty(
        name="Go on without Blender",
        description="Closing Blender does not end the search; Resume finds it again",
    )
    study: StringProperty(
        name="Study", description="Folder that keeps every trial", subtype="DIR_PATH"
    )


class OPTISENSE_PG_found(bpy.types.PropertyGroup):
    """What the running search has found; never saved."""

    objective_choice: EnumProperty(
        name="Objective", items=catalogue.objectives, options={"SKIP_SAVE"},
        update=lambda self, context: _choose(self, context, "objective"),
    )  # fmt: skip
    method_choice: EnumProperty(
        name="Method", items=_methods, options={"SKIP_SAVE"},
        update=lambda self, context: _choose(self, context, "method"),
    )  # fmt: skip
    best: StringProperty(options={"SKIP_SAVE"})
    values: StringProperty(options={"SKIP_SAVE"})
    start: StringProperty(options={"SKIP_SAVE"})
    ended: StringProperty(options={"SKIP_SAVE"})
    offer: StringProperty(description="What a study waits for", options={"SKIP_SAVE"})


def _choose(found: OPTISENSE_PG_found, context: bpy.types.Context, what: str) -> None:
    name = getattr(found, f"{what}_choice")
    if name and name != "NONE":
        setattr(context.scene.optisense_search, what, name)


CLASSES = (OPTISENSE_PG_vary, OPTISENSE_PG_search, OPTISENSE_PG_found)


def register() -> None:
    for each in CLASSES:
        bpy.utils.register_class(each)
    bpy.types.Scene.optisense_search = PointerProperty(type=OPTISENSE_PG_search)
    bpy.types.WindowManager.optisense_found = PointerProperty(
        type=OPTISENSE_PG_found, options={"SKIP_SAVE"}
    )


def unregister() -> None:
    del bpy.types.WindowManager.optisense_found
    del bpy.types.Scene.optisense_search
    for each in reversed(CLASSES):
        bpy.utils.unregister_class(each)

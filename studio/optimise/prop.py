"""Properties of a search: its parameters, settings and progress."""

from __future__ import annotations

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    IntProperty,
    StringProperty,
)

from ..engine import catalogue

_objective_items: catalogue.Items = []


def _objectives(values: bpy.types.PropertyGroup, context: bpy.types.Context) -> catalogue.Items:
    """Return the engine's objectives, and the user's own objective that is named under Evaluate."""
    global _objective_items
    own = bpy.context.window_manager.optisense_evaluation.own.strip()
    row = [("OWN", "Your own", f"As under Evaluate: {own}")] if own else []
    _objective_items = [*catalogue.items("objectives"), *row]
    return _objective_items


def _methods(values: bpy.types.PropertyGroup, context: bpy.types.Context) -> catalogue.Items:
    return catalogue.items("methods")


class OPTISENSE_PG_vary(bpy.types.PropertyGroup):
    """Parameter of the search; its name is a label."""

    active: BoolProperty(name="Vary", description="The search changes it", default=True)
    text: StringProperty(
        name="Range", description="PATH=LOW:HIGH, PATH=+-REACH, PATH=LOW:HIGH:STEPS or PATH=A,B"
    )


class OPTISENSE_PG_search(bpy.types.PropertyGroup):
    """Settings of the search of a scene; kept in the .blend file, so that it can be continued
    later.
    """

    vary: CollectionProperty(type=OPTISENSE_PG_vary)
    vary_index: IntProperty(options={"HIDDEN"})
    objective: StringProperty(
        name="Objective",
        default="aoap",
        description="What to make as high as possible: a name, arithmetic such as aoap + "
        "0.5*coverage, or FILE.py:FUNCTION of your own; several, with commas between them, for the "
        "method pareto",
    )
    require: StringProperty(
        name="Conditions",
        description="What the best sensor must keep, such as coverage>=0.55, distortion<=1.5, with "
        "commas between them; empty for none",
    )
    method: StringProperty(
        name="Method", default="cma-es", description="How the next trials are chosen"
    )
    budget: IntProperty(
        name="Trials", description="In all; 0 leaves it to the method", min=0, default=60
    )
    workers: IntProperty(
        name="Workers", description="Processes that score trials at the same time", min=1, max=256,
        default=1,
    )  # fmt: skip
    seed: IntProperty(
        name="Seed", min=0, max=2**31 - 1,
        description="Of the method's chance: the same seed goes the same way",
    )  # fmt: skip
    go_on: BoolProperty(
        name="Go on without Blender",
        description="Closing Blender does not end the search; Resume finds it again",
    )
    study: StringProperty(
        name="Study", description="Folder that keeps every trial", subtype="DIR_PATH"
    )


# Named functions: Blender reads these annotations where it does not know this module's names.
def _objective_chosen(found: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    name = found.objective_choice
    if name == "OWN":
        name = context.window_manager.optisense_evaluation.own.strip()
    if name and name != "NONE":
        context.scene.optisense_search.objective = name


def _method_chosen(found: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    if found.method_choice and found.method_choice != "NONE":
        context.scene.optisense_search.method = found.method_choice


class OPTISENSE_PG_found(bpy.types.PropertyGroup):
    """Results of the running search; never saved."""

    objective_choice: EnumProperty(
        name="Objective", items=_objectives, options={"SKIP_SAVE"},
        description="Choose an objective",
        update=_objective_chosen,
    )  # fmt: skip
    method_choice: EnumProperty(
        name="Method", items=_methods, options={"SKIP_SAVE"}, description="Choose a method",
        update=_method_chosen,
    )  # fmt: skip
    best: StringProperty(description="The best score so far", options={"SKIP_SAVE"})
    values: StringProperty(description="What it has, one a line", options={"SKIP_SAVE"})
    conditions: StringProperty(
        description="What it has of each condition, one a line", options={"SKIP_SAVE"}
    )
    start: StringProperty(description="The score at the start", options={"SKIP_SAVE"})
    ended: StringProperty(description="Why it is over", options={"SKIP_SAVE"})
    expected: StringProperty(description="How long the search takes", options={"SKIP_SAVE"})
    offer: StringProperty(description="What a study waits for", options={"SKIP_SAVE"})


PROPERTIES = {
    "Scene": {"optisense_search": OPTISENSE_PG_search},
    "WindowManager": {"optisense_found": OPTISENSE_PG_found},
}

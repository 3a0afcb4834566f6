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
from ..scene.results import OfScene

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

    active: BoolProperty(
        name="Vary", description="Whether the search changes this parameter", default=True
    )
    text: StringProperty(
        name="Range",
        description="Values that the search may choose: PATH=LOW:HIGH, PATH=+-REACH, "
        "PATH=LOW:HIGH:STEPS "
        "or PATH=A,B",
    )


class OPTISENSE_PG_search(bpy.types.PropertyGroup):
    """Settings of the search of a scene; kept in the .blend file, to be continued later."""

    vary: CollectionProperty(type=OPTISENSE_PG_vary)
    vary_index: IntProperty(description="Chosen parameter of the list", options={"HIDDEN"})
    objective: StringProperty(
        name="Objective",
        default="aoap",
        description="Score to be maximised: a name, arithmetic such as aoap + "
        "0.5*coverage, or your own FILE.py:FUNCTION; the method pareto takes several, separated by "
        "commas",
    )
    require: StringProperty(
        name="Conditions",
        description="Conditions that the best design must meet, separated by commas, such as "
        "coverage>=0.55, distortion<=1.5; empty for none",
    )
    method: StringProperty(
        name="Method", default="cma-es", description="Method that chooses the next trials"
    )
    budget: IntProperty(
        name="Trials",
        description="Number of trials in total; with 0, the method decides",
        min=0,
        default=60,
    )
    workers: IntProperty(
        name="Workers",
        description="Number of processes that evaluate trials in parallel",
        min=1,
        max=256,
        default=1,
    )
    seed: IntProperty(
        name="Seed", min=0, max=2**31 - 1,
        description="Seed of the method's random numbers: the same seed gives the same search",
    )  # fmt: skip
    coarse_first: BoolProperty(
        name="Coarse First",
        description="Score trials by fewer photons and pixels, and in full only those that may be "
        "the best; saves most of the time of a search by pictures",
    )
    shows_more: BoolProperty(
        name="More Options", description="Show the options that few searches need"
    )
    errors: StringProperty(
        name="Errors",
        description="Manufacturing errors: values and the standard deviations of their errors, "
        "separated by commas, such as lights.*.position.z=0.1; the search then maximises the score "
        "that nine of ten sensors reach",
    )
    samples: IntProperty(
        name="Sensors a Trial", min=2, max=1000, default=8,
        description="With errors: number of manufactured sensors simulated for each trial",
    )  # fmt: skip
    rules: StringProperty(
        name="Rules",
        description="Functions FILE.py:FUNCTION of a design that say whether it is allowed, "
        "separated by commas",
    )
    options: StringProperty(
        name="Method's",
        description="Options of the method, separated by commas, such as sigma=0.1, population=20",
    )
    settings: StringProperty(
        name="Objectives'",
        description="Settings of the objectives, separated by commas, such as photons=1000000",
    )
    may_cross: BoolProperty(
        name="Parts May Cross",
        description="Allow parts that cut through one another or lose contact with those on which "
        "they rest, and a much larger sensor",
    )
    go_on: BoolProperty(
        name="Go on without Blender",
        description="Continue the search when Blender is closed; Resume connects to it again",
    )
    study: StringProperty(
        name="Study", description="Folder in which every trial is stored", subtype="DIR_PATH"
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


class OPTISENSE_PG_found(OfScene, bpy.types.PropertyGroup):
    """Results of the running search; never saved."""

    is_before = False  # opening another sensor clears them
    objective_choice: EnumProperty(
        name="Objective", items=_objectives, options={"SKIP_SAVE"},
        description="Choose an objective",
        update=_objective_chosen,
    )  # fmt: skip
    method_choice: EnumProperty(
        name="Method", items=_methods, options={"SKIP_SAVE"}, description="Choose a method",
        update=_method_chosen,
    )  # fmt: skip
    best: StringProperty(description="Best score so far", options={"SKIP_SAVE"})
    values: StringProperty(
        description="Parameters of the best trial, one a line", options={"SKIP_SAVE"}
    )
    conditions: StringProperty(
        description="Values of the best trial for the conditions, one a line", options={"SKIP_SAVE"}
    )
    start: StringProperty(
        description="Score of the design before the search", options={"SKIP_SAVE"}
    )
    ended: StringProperty(
        description="Number of trials and reason for the end of the search", options={"SKIP_SAVE"}
    )
    expected: StringProperty(description="Expected duration of the search", options={"SKIP_SAVE"})
    offer: StringProperty(
        description="Message about a study that can be continued", options={"SKIP_SAVE"}
    )


PROPERTIES = {
    "Scene": {"optisense_search": OPTISENSE_PG_search},
    "WindowManager": {"optisense_found": OPTISENSE_PG_found},
}

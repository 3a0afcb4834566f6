"""Operators of a search: choose parameters, search, inspect, apply."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
from bpy.props import BoolProperty, StringProperty

from ..core import search_parameters
from ..core.engine import EngineError
from ..engine import design_transfer, polls, session
from ..engine.operators import ChoosingFile, Starting, fail, refuse, start
from ..evaluate import rays
from ..evaluate.operator import draw_again
from ..scene.paths import chosen, objective
from ..scene.subject import scene_of
from ..sensor.opening import new_stage, open_stage
from . import search_advice, search_progress
from .suggestions import suggestions
from .unfinished_studies import NOT_OVER, new_study, study_of

TITLE = "Searching"
WIDEST = 72
"""Number of characters above which an entry of the menu Vary is shortened: it would not fit beside
the sidebar.
"""


class OPTISENSE_OT_vary(polls.Designing, bpy.types.Operator):
    """Add this parameter to those that the search may change"""

    bl_idname = "optisense.vary"
    bl_label = "Vary"
    bl_options = {"REGISTER", "UNDO"}

    label: StringProperty(name="Label", description="Name of the parameter in the list")
    text: StringProperty(
        name="Range",
        description="Values that the search may choose: PATH=LOW:HIGH, PATH=+-REACH, "
        "PATH=LOW:HIGH:STEPS "
        "or PATH=A,B",
    )

    def execute(self, context: bpy.types.Context) -> set[str]:
        search = context.scene.optisense_search
        if all(row.text != self.text for row in search.vary):
            row = search.vary.add()
            row.name, row.text = self.label or self.text.partition("=")[0], self.text
            search.vary_index = len(search.vary) - 1
            search_advice.choose_objective(search)
        return {"FINISHED"}


class OPTISENSE_MT_vary(bpy.types.Menu):
    """Parameters of the selected object that a search may change"""

    bl_label = "Vary ..."

    def draw(self, context: bpy.types.Context) -> None:
        found = suggestions(context)
        if not found:
            self.layout.label(text="Select a light, a part, a cage or the camera")
        for each in found:
            text = f"{each.label}:  {each.text}"
            short = text if len(text) <= WIDEST else f"{text[: WIDEST - 4]} ..."
            choice = self.layout.operator("optisense.vary", text=short)
            choice.label, choice.text = each.label, each.text


class OPTISENSE_OT_vary_remove(polls.Checked, bpy.types.Operator):
    """Remove the selected parameter from the list, so that the search does not change it"""

    bl_idname = "optisense.vary_remove"
    bl_label = "Remove"
    bl_options = {"REGISTER", "UNDO"}

    checks = (
        polls.requires(
            lambda c: c.scene.optisense_search.vary, "The list of varied parameters is empty"
        ),
    )

    def execute(self, context: bpy.types.Context) -> set[str]:
        search = context.scene.optisense_search
        search.vary.remove(search.vary_index)
        search.vary_index = max(0, search.vary_index - 1)
        return {"FINISHED"}


def _is_taken(folder: Path) -> bool:
    """Return whether a folder is not empty; the engine reports an unreadable one, which counts as
    empty.
    """
    try:
        return folder.is_dir() and any(folder.iterdir())
    except OSError:
        return False


def wait_property() -> Any:
    """Return the property with which scripts wait until the search is over."""
    return BoolProperty(
        name="Wait",
        description="Return only when the search is over; for scripts",
        default=True,
        options={"HIDDEN", "SKIP_SAVE"},
    )


class OPTISENSE_OT_search(polls.Checked, Starting, bpy.types.Operator):
    """Search for a better sensor; every trial is kept in a folder"""

    bl_idname = "optisense.search"
    bl_label = "Search"

    wait: wait_property()

    checks = (
        *polls.ASKING,
        polls.requires(
            lambda c: search_parameters.texts_of(c.scene.optisense_search.vary),
            "Add a parameter with Vary first",
        ),
        polls.requires(
            lambda c: c.scene.optisense_search.study or c.scene.optisense.is_saved,
            "Save the sensor first, or name a folder for the study",
        ),
    )

    def start(self, context: bpy.types.Context, *, wait: bool) -> set[str]:
        search = context.scene.optisense_search
        study = study_of(context.scene)
        if not study or _is_taken(Path(study)):
            if not context.scene.optisense.is_saved:
                return refuse(self, "The folder of the study is not empty; name another one")
            study = search.study = str(new_study(Path(context.scene.optisense.folder)))
            session.push_undo("Search")  # so that Blender asks to save the file that names it
        try:
            design = design_transfer.design(context.scene)
        except EngineError as error:
            return fail(self, error, TITLE)
        fields: dict[str, Any] = {"budget": search.budget} if search.budget else {}
        try:
            expected = search_advice.advice(design, search, fields)
        except EngineError as error:
            return fail(self, error, TITLE)
        fields |= more_fields(search)
        search_progress.begin(context.scene)
        bpy.context.window_manager.optisense_found.expected = expected
        return start(
            self,
            TITLE,
            "search",
            search_progress.finished,
            on_event=search_progress.take,
            wait=wait,
            design=design,
            study=study,
            vary=search_parameters.texts_of(search.vary),
            objectives=[objective(each) for each in search_parameters.listed(search.objective)],
            require=search_parameters.listed(search.require),
            method=search.method,
            seed=search.seed,
            workers=search.workers,
            go_on=search.go_on,
            name="search",
            **fields,
        )


def more_fields(search: bpy.types.PropertyGroup) -> dict[str, Any]:
    """Return the fields of a request for the options that few searches need."""
    fields: dict[str, Any] = {
        "coarse_first": search.coarse_first,
        "may_cross": search.may_cross,
        "errors": search_parameters.listed(search.errors),
        "rules": [objective(each) for each in search_parameters.listed(search.rules)],
        "options": search_parameters.listed(search.options),
        "settings": search_parameters.listed(search.settings),
    }
    if fields["errors"]:
        fields["samples"] = search.samples
    return fields


class _WithStudy(polls.Checked):
    """Base of operators that need a study that was begun."""

    checks = (
        *polls.ASKING,
        polls.requires(
            lambda c: c.scene.optisense_search.study,
            "There is no study yet: search first, or name its folder",
        ),
    )


class OPTISENSE_OT_resume(_WithStudy, Starting, bpy.types.Operator):
    """Continue the study until it has the given number of trials"""

    bl_idname = "optisense.resume"
    bl_label = "Resume"

    wait: wait_property()

    def start(self, context: bpy.types.Context, *, wait: bool) -> set[str]:
        search = context.scene.optisense_search
        study, number = study_of(context.scene), context.scene.session_uid
        fields: dict[str, Any] = {"workers": search.workers, "go_on": search.go_on}
        if search.budget:
            fields["budget"] = search.budget

        def follow(what: str, then: Callable[[dict[str, Any]], None], **fields: Any) -> None:
            session.start_job(
                TITLE, what, then, on_event=search_progress.take, wait=wait, study=study,
                name="search", **fields,
            )  # fmt: skip

        def watched(result: dict[str, Any]) -> None:
            if result["ended"] in NOT_OVER:  # it was ending, as Blender had been closed
                follow("resume", search_progress.finished, **fields)
            else:
                search_progress.finished(result)

        def known(result: dict[str, Any]) -> None:
            scene = scene_of(number)
            if scene is None:
                return
            search_progress.take_curve(scene, result["curve"])
            if result.get("running"):
                follow("watch", watched)
            else:
                follow("resume", search_progress.finished, **fields)

        return start(self, "Reading the study", "study", known, wait=wait, study=study)


class OPTISENSE_OT_apply_best(_WithStudy, bpy.types.Operator):
    """Replace the sensor in this scene by the best design of the study"""

    bl_idname = "optisense.apply_best"
    bl_label = "Apply Best"

    def execute(self, context: bpy.types.Context) -> set[str]:
        scene = context.scene
        number, folder, saved = scene.session_uid, scene.optisense.folder, scene.optisense.is_saved
        wait = bpy.app.background
        try:
            stage = new_stage()
        except EngineError as error:
            return fail(self, error, "Applying")

        def applied(_: dict[str, Any]) -> None:
            scene = scene_of(number)
            if scene is not None:
                search_progress.clear_ghosts(scene)
                open_stage(
                    scene,
                    stage,
                    wait=wait,
                    folder=folder if saved else "",
                    keep_others=True,
                    then=draw_again if rays.drawn(scene) else None,
                )

        return start(
            self,
            "Applying",
            "apply",
            applied,
            wait=wait,
            study=study_of(context.scene),
            to=str(stage),
        )


class OPTISENSE_OT_keep_variant(_WithStudy, ChoosingFile, bpy.types.Operator):
    """Write the best design of the study to a new folder; the sensor in this scene does not
    change"""

    bl_idname = "optisense.keep_variant"
    bl_label = "Keep as Variant"

    filepath: StringProperty(
        name="Folder",
        description="New folder for the design; it must not exist yet",
        subtype="DIR_PATH",
    )

    def suggested(self, context: bpy.types.Context) -> str:
        return f"{study_of(context.scene)}-best"

    def execute(self, context: bpy.types.Context) -> set[str]:
        target = chosen(self, "a folder")
        if target is None:
            return {"CANCELLED"}

        def kept(result: dict[str, Any]) -> None:
            session.state().note = f"Written to {result['folder']}"

        return start(
            self,
            "Applying",
            "apply",
            kept,
            study=study_of(context.scene),
            to=str(target),
        )

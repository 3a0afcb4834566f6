"""Score the sensor, draw its chief rays."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.props import StringProperty

from ..core import scores
from ..core.engine import EngineError
from ..core.numbers import shown_number
from ..engine import catalogue, design_transfer, polls, session
from ..engine.operators import Starting, refuse, start_with_design
from ..scene.paths import objective
from ..scene.subject import Subject
from ..simulate import editors
from . import figures, rays

ABOUT = ("unit", "lower_is_better")
"""Entries of a score that describe its objective; the catalogue lacks the user's own ones."""


class OPTISENSE_OT_choose_objective(bpy.types.Operator):
    """Select or clear this objective for the evaluation"""

    bl_idname = "optisense.choose_objective"
    bl_label = "Choose Objective"
    bl_options = {"INTERNAL"}

    objective: StringProperty(
        name="Objective", description="Name of the objective to select or clear"
    )

    @classmethod
    def description(cls, context: bpy.types.Context, values: bpy.types.OperatorProperties) -> str:
        entries = {name: text for name, _, text in catalogue.items("objectives")}
        return entries.get(values.objective) or str(cls.__doc__)

    def execute(self, context: bpy.types.Context) -> set[str]:
        values = context.window_manager.optisense_evaluation
        if self.objective not in {name for name, _, _ in catalogue.items("objectives")}:
            return refuse(self, f"There is no objective '{self.objective}'")
        values.chosen = set(values.chosen) ^ {self.objective}
        return {"FINISHED"}


class OPTISENSE_OT_evaluate(polls.Checked, Starting, bpy.types.Operator):
    """Score the sensor by the chosen objectives"""

    bl_idname = "optisense.evaluate"
    bl_label = "Evaluate"

    checks = (*polls.ASKING, polls.requires(lambda c: chosen(c), "Choose an objective first"))

    def start(self, context: bpy.types.Context, *, wait: bool) -> set[str]:
        subject = Subject(context.scene)
        return start_with_design(
            self,
            context,
            "Evaluating",
            "evaluate",
            subject.taking(take),
            subject=subject,
            wait=wait,
            objectives=chosen(context),
            figures=True,
            name="scores",
        )


def chosen(context: bpy.types.Context) -> list[str]:
    """Return the chosen objectives, the user's own last."""
    values = context.window_manager.optisense_evaluation
    names = [name for name in sorted(values.chosen) if name != "NONE"]
    return [*names, objective(values.own)] if values.own.strip() else names


def take(result: dict[str, Any], scene: bpy.types.Scene) -> None:
    """Replace the scores in the panel by those of a scene's sensor."""
    values = bpy.context.window_manager.optisense_evaluation
    before = _before(scene)
    opened = {score.name for score in values.scores if score.is_open}
    values.scores.clear()
    values.is_before, values.scene = False, scene.session_uid
    for row in result["scores"]:
        score = values.scores.add()
        score.name = row["objective"]
        _fill(score, row, before.get(score.name))
        score.is_open = score.name in opened
    session.redraw()


def take_live(result: dict[str, Any], scene: bpy.types.Scene) -> None:
    """Update the scores that are made while a scene's sensor is edited, and keep its others."""
    values = bpy.context.window_manager.optisense_evaluation
    before = _before(scene)
    if not values.is_of(scene):
        values.scores.clear()
    for row in result["scores"]:
        score = values.scores.get(row["objective"]) or values.scores.add()
        score.name = row["objective"]
        _fill(score, row, before.get(score.name))
        score.is_live = True
    values.is_before, values.scene = False, scene.session_uid
    session.redraw()


def _before(scene: bpy.types.Scene) -> dict[str, float]:
    """Return the present scores of a scene's sensor by objective."""
    values = bpy.context.window_manager.optisense_evaluation
    if values.other_sensor(scene):
        return {}
    return {score.name: score.number for score in values.scores if score.value}


def _fill(score: bpy.types.PropertyGroup, row: dict[str, Any], before: float | None) -> None:
    """Fill an entry of the panel with a score and its change."""
    known = {each["name"]: each for each in catalogue.entries("objectives")}
    about = {**known.get(row["objective"], {}), **{k: row[k] for k in ABOUT if k in row}}
    value = row["value"]
    score.title = row.get("title") or row["objective"]
    score.value = "" if value is None else f"{value:.4g}"
    score.unit = about.get("unit") or ""
    score.number = value or 0.0
    found = scores.share(value, about)
    score.has_share, score.share = found is not None, found or 0.0
    score.direction = scores.direction(about)
    lower = bool(about.get("lower_is_better"))
    score.change = scores.change(value, before, lower_is_better=lower)
    score.failure = row.get("failure") or ""
    parts = row.get("parts") or {}
    score.parts = "\n".join(
        f"{name.replace('_', ' ')}: {shown_number(value)}"
        for name, value in parts.items()
        if isinstance(value, (int, float))
    )
    score.figure = row.get("figure") or ""
    score.is_live = False


class OPTISENSE_OT_show_figure(polls.Checked, bpy.types.Operator):
    """Show the figure of this score in full, in an Image Editor"""

    bl_idname = "optisense.show_figure"
    bl_label = "Open Figure"

    objective: StringProperty(
        name="Objective",
        description="Name of the score whose figure is opened; if empty, the first score that has "
        "one",
    )

    checks = (
        polls.requires(
            lambda c: any(
                figures.is_there(each.figure)
                for each in c.window_manager.optisense_evaluation.scores
            ),
            "There is no figure yet: evaluate first",
        ),
        editors.can_show,
    )

    def execute(self, context: bpy.types.Context) -> set[str]:
        found = context.window_manager.optisense_evaluation.scores
        drawn = [each for each in found if figures.is_there(each.figure)]
        chosen = [each for each in drawn if self.objective in ("", each.name)]
        if not chosen:
            return refuse(self, f"There is no figure of '{self.objective}'; evaluate again")
        try:
            # All of them, so that the editor's list of images offers the others too.
            shown = {each.name: figures.load(each.title, each.figure) for each in drawn}
        except RuntimeError as error:
            return refuse(self, f"The figure can't be read; evaluate again ({error})")
        editors.show(context, shown[chosen[0].name])
        return {"FINISHED"}


def draw_again(scene: bpy.types.Scene, _: str | None) -> None:
    """Trace the chief rays of a sensor that replaced another one, without waiting."""
    try:
        design = design_transfer.design(scene)
    except EngineError:  # the buttons say that
        return
    traced = Subject(scene).taking(_show_rays)
    request = session.ask("chief_rays", traced, lambda _: None, design=design)
    running = session.running()
    if bpy.app.background and request is not None and running is not None:
        running.wait(request)


def _show_rays(result: dict[str, Any], scene: bpy.types.Scene) -> None:
    bpy.context.window_manager.optisense_evaluation.rays = rays.show(scene, result)


class OPTISENSE_OT_show_rays(polls.Asking, bpy.types.Operator):
    """Draw a coarse grid of chief rays, coloured by their outcome"""

    bl_idname = "optisense.show_rays"
    bl_label = "Show Chief Rays"

    def execute(self, context: bpy.types.Context) -> set[str]:
        subject = Subject(context.scene)

        def traced(result: dict[str, Any], scene: bpy.types.Scene) -> None:
            _show_rays(result, scene)
            session.push_undo("Chief rays")

        return start_with_design(
            self,
            context,
            "Tracing rays",
            "chief_rays",
            subject.taking(traced),
            subject=subject,
        )


class OPTISENSE_OT_hide_rays(polls.Checked, bpy.types.Operator):
    """Remove the chief rays"""

    bl_idname = "optisense.hide_rays"
    bl_label = "Hide"
    bl_options = {"REGISTER", "UNDO"}

    checks = (polls.requires(lambda c: rays.drawn(c.scene), "No rays are shown"),)

    def execute(self, context: bpy.types.Context) -> set[str]:
        rays.clear(context.scene)
        context.window_manager.optisense_evaluation.rays = ""
        return {"FINISHED"}

"""Step 6 in the sidebar."""

from __future__ import annotations

import bpy

from ..core import scores
from ..engine import catalogue
from ..engine.layout import SidebarPanel, lines_of, paragraph, show_job, show_outcome
from ..simulate.picture import file_icon
from . import figures, ledger

TITLE, VALUE, VALUE_AND_CHANGE = 0.3, 0.5, 0.78
"""Share of a score's line that the title takes, and shares of the rest that a value takes alone and
with its change; the bar takes what is left.
"""

COLUMNS = 2
"""Number of columns of the objectives to tick: one would take half a screen."""

ARROWS = {"better": "TRIA_UP", "worse": "TRIA_DOWN"}
"""Icon of each change: up is better, even if a lower value is better."""

FIGURE = 10.5
"""Width of a figure in the panel, in widths of an icon; a button opens it in full in an editor."""


class OPTISENSE_PT_evaluate(SidebarPanel, bpy.types.Panel):
    bl_label = "Evaluate"
    bl_order = 6

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        values = context.window_manager.optisense_evaluation
        if catalogue.entries("objectives"):
            grid = layout.grid_flow(columns=COLUMNS, row_major=True, even_columns=True, align=True)
            for name, title, _ in catalogue.items("objectives"):
                is_chosen = name in values.chosen
                grid.operator(
                    "optisense.choose_objective",
                    text=title,
                    icon="CHECKBOX_HLT" if is_chosen else "CHECKBOX_DEHLT",
                    depress=is_chosen,
                ).objective = name
        else:
            layout.label(text=catalogue.items("objectives")[0][1])
        layout.prop(values, "own")
        layout.prop(values, "live")
        row = layout.row()
        row.scale_y = 1.4
        if not show_job(row, "Evaluating"):
            row.operator("optisense.evaluate", icon="CHECKMARK")
        show_outcome(layout, "Evaluating", "Tracing rays")
        if values.scores:
            _strip(layout.box(), context.scene, values)
        row = layout.row(align=True)
        if not show_job(row, "Tracing rays"):
            row.operator("optisense.show_rays", icon="CURVE_DATA")
            row.operator("optisense.hide_rays", icon="X")
        if values.rays:
            paragraph(layout, values.rays)
        ledger.draw(layout, context.scene)


def _strip(
    layout: bpy.types.UILayout, scene: bpy.types.Scene, values: bpy.types.PropertyGroup
) -> None:
    """Draw all scores, one line each; the arrow unfolds the parts of a score."""
    other = values.other_sensor(scene)
    if other:
        layout.label(text=f"Scores of the {other}", icon="INFO")
    column = layout.column(align=True)
    for score in values.scores:
        _line(column, score)
        if score.failure:
            paragraph(column, score.failure, boxed=True)
        elif score.is_open:
            _details(column, score)
    notes = []
    if any(score.is_live for score in values.scores):
        named = ", ".join(score.title for score in values.scores if score.is_live)
        notes.append(f"Scored while editing: {named}.")
    if any(score.has_share for score in values.scores):
        notes.append("Bars: worst to best built-in sensor.")
    if notes:
        paragraph(layout, " ".join(notes), boxed=True)


def _line(column: bpy.types.UILayout, score: bpy.types.PropertyGroup) -> None:
    row = column.row(align=True)
    icon = "DOWNARROW_HLT" if score.is_open else "RIGHTARROW"
    row.prop(score, "is_open", text="", icon=icon, emboss=False)
    parts = row.split(factor=TITLE, align=True)
    parts.label(text=score.title)
    if score.failure:
        parts.label(text="failed", icon="ERROR")
        return
    amount, _, sense = score.change.partition(" ")  # that of an unchanged score is one word
    said = scores.with_unit(score.number, score.unit, 3 if sense else 4)
    said = f"{said} {amount}" if sense else said
    if score.has_share:
        parts = parts.split(factor=VALUE_AND_CHANGE if sense else VALUE, align=True)
    parts.label(text=said, icon=ARROWS.get(sense, "NONE"))
    if not score.has_share:
        return
    bar = parts.row(align=True)
    bar.enabled = False
    bar.prop(score, "per_cent", text="", slider=True)


def _details(layout: bpy.types.UILayout, score: bpy.types.PropertyGroup) -> None:
    column = layout.column(align=True)
    column.scale_y = 0.8
    column.label(text=score.direction.capitalize(), icon="DOT")
    if score.change:
        column.label(text=f"Since the score before: {score.change}", icon="DOT")
    for line in score.parts.splitlines():
        for number, piece in enumerate(lines_of(line, has_icon=True, boxed=True)):
            column.label(text=piece, icon="BLANK1" if number else "DOT")
    icon = file_icon(score.figure)
    if icon:
        layout.template_icon(icon_value=icon, scale=FIGURE)
    if figures.is_there(score.figure):
        layout.operator("optisense.show_figure", icon="IMAGE_DATA").objective = score.name

"""Step 6 in the sidebar."""

from __future__ import annotations

import bpy

from ..engine import catalogue
from ..engine.layout import SidebarPanel, lines_of, paragraph, show_job, show_outcome
from ..simulate.picture import file_icon
from . import figures

FIGURE = 10.5
"""Width of a figure in the panel, in widths of an icon; in full it opens in an editor."""


class OPTISENSE_PT_evaluate(SidebarPanel, bpy.types.Panel):
    bl_idname = "OPTISENSE_PT_evaluate"
    bl_label = "Evaluate"
    bl_order = 6
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        values = context.window_manager.optisense_evaluation
        column = layout.column(align=True)
        if catalogue.entries("objectives"):
            for name, title, _ in catalogue.items("objectives"):
                is_chosen = name in values.chosen
                column.operator(
                    "optisense.choose_objective",
                    text=title,
                    icon="CHECKBOX_HLT" if is_chosen else "CHECKBOX_DEHLT",
                    depress=is_chosen,
                ).objective = name
        else:
            column.label(text=catalogue.items("objectives")[0][1])
        layout.prop(values, "own")
        row = layout.row()
        row.scale_y = 1.4
        if not show_job(row, "Evaluating"):
            row.operator("optisense.evaluate", icon="CHECKMARK")
        show_outcome(layout, "Evaluating", "Tracing rays")
        if values.scores and values.is_before:
            layout.label(text="Scores of the sensor that was open before", icon="INFO")
        for score in values.scores:
            _score(layout.box(), score)
        row = layout.row(align=True)
        if not show_job(row, "Tracing rays"):
            row.operator("optisense.show_rays", icon="CURVE_DATA")
            row.operator("optisense.hide_rays", icon="X")
        if values.rays:
            paragraph(layout, values.rays)


def _score(layout: bpy.types.UILayout, score: bpy.types.PropertyGroup) -> None:
    row = layout.row()
    row.label(text=score.title)
    if score.failure:
        row.label(text="failed", icon="ERROR")
        paragraph(layout, score.failure, boxed=True)
        return
    row.label(text=score.value)
    column = layout.column(align=True)
    column.scale_y = 0.8
    for line in score.parts.splitlines():
        for number, piece in enumerate(lines_of(line, has_icon=True, boxed=True)):
            column.label(text=piece, icon="BLANK1" if number else "DOT")
    icon = file_icon(score.figure)
    if icon:
        layout.template_icon(icon_value=icon, scale=FIGURE)
    if figures.is_there(score.figure):
        layout.operator("optisense.show_figure", icon="IMAGE_DATA").objective = score.name

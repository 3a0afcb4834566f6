"""Step 7 in the sidebar."""

from __future__ import annotations

import bpy

from ..engine import catalogue, session
from ..engine.layout import (
    SidebarPanel,
    labelled,
    paragraph,
    show_job,
    show_outcome,
    shows_more,
)
from ..simulate.picture import icon
from .search_advice import is_flat
from .search_progress import CURVE, has_trials, known_scores


class OPTISENSE_UL_vary(bpy.types.UIList):
    """List of the parameters of a search: tick, label, range."""

    def draw_item(self, context, layout, data, item, icon, active_data, active_property) -> None:
        row = layout.row(align=True)
        row.prop(item, "active", text="")
        row.prop(item, "text", text="", emboss=False)


class OPTISENSE_PT_optimise(SidebarPanel, bpy.types.Panel):
    bl_label = "Optimise"
    bl_order = 7

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        search = context.scene.optisense_search
        found = context.window_manager.optisense_found
        row = layout.row(align=True)
        menu = row.operator("wm.call_menu", text="Vary ...", icon="ADD")
        menu.name = "OPTISENSE_MT_vary"
        row.operator("optisense.vary_remove", text="", icon="REMOVE")
        layout.template_list("OPTISENSE_UL_vary", "", search, "vary", search, "vary_index", rows=3)
        column = labelled(layout)
        for what in ("objective", "method"):
            if catalogue.entries(f"{what}s"):
                row = column.row(align=True)
                row.prop(search, what)
                row.prop(found, f"{what}_choice", text="", icon_only=True)
            else:
                column.prop(search, what)
        column.prop(search, "require")
        for name in ("budget", "workers", "seed", "study"):
            column.prop(search, name)
        for name in ("coarse_first", "go_on"):
            layout.prop(search, name)  # their names are longer than half a line
        if shows_more(layout, search):
            column = labelled(layout)
            for name in ("errors", "samples", "rules", "options", "settings"):
                column.prop(search, name)
            layout.prop(search, "may_cross")
        if found.offer:
            paragraph(layout, found.offer, "TIME")
        row = layout.row(align=True)
        row.scale_y = 1.4
        if not show_job(row, "Searching", "Reading the study"):
            row.operator("optisense.search", icon="VIEWZOOM")
            row.operator("optisense.resume", icon="PLAY")
        if found.expected and session.state().busy == "Searching":
            layout.label(text=session.state().left or found.expected, icon="TIME")
        show_outcome(layout, "Searching", "Reading the study")
        if is_flat(known_scores()):
            text = (
                "All trials score alike: the varied parameters do not affect the objective. Vary "
                "others, or choose another objective"
            )
            paragraph(layout, text, "ERROR")
        other = found.other_sensor(context.scene)
        if other and has_trials():
            layout.label(text=f"Search of the {other}", icon="INFO")
        curve = icon(CURVE) if has_trials() else 0
        if curve:
            layout.template_icon(icon_value=curve, scale=8.0)
        column = layout.column(align=True)
        column.scale_y = 0.8
        if found.best:
            start = f", at the start {found.start}" if found.start else ""
            column.label(text=f"Best so far {found.best}{start}")
        for line in found.conditions.splitlines():
            column.label(text=line, icon="CHECKMARK")
        for line in found.values.splitlines():
            column.label(text=line, icon="DOT")
        if found.ended:
            column.label(text=found.ended)
        row = layout.row(align=True)
        if not show_job(row, "Applying"):
            row.operator("optisense.apply_best", icon="CHECKMARK")
            row.operator("optisense.keep_variant", icon="DUPLICATE")
        show_outcome(layout, "Applying")

"""Step 9 in the sidebar."""

from __future__ import annotations

from pathlib import Path

import bpy

from ..engine import catalogue
from ..engine.layout import SidebarPanel, labelled, paragraph, show_job, show_outcome, shows_more
from .operator import TITLE


class OPTISENSE_PT_calibrate(SidebarPanel, bpy.types.Panel):
    bl_label = "Calibrate"
    bl_order = 9

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        values = context.window_manager.optisense_calibration
        column = labelled(layout)
        column.prop(values, "photos")
        column.prop(values, "ball")
        column.prop(values, "as_labelled")
        for text, is_usual, ticked in (
            ("What may change:", True, False),
            ("What else may change:", False, True),
        ):
            rows = catalogue.entries("calibration_families")
            rows = [row for row in rows if row["usual"] == is_usual]
            if rows:
                layout.label(text=text)
            grid = layout.grid_flow(columns=2, even_columns=True, align=True)
            chosen = values.added if ticked else values.kept
            for row in rows:
                may = (row["name"] in chosen) == ticked
                grid.operator(
                    "optisense.keep_family", text=row["name"].capitalize(), depress=may,
                    icon="CHECKBOX_HLT" if may else "CHECKBOX_DEHLT",
                ).family = row["name"]  # fmt: skip
        if shows_more(layout, values):
            column = labelled(layout)
            for name in ("fit", "hold_out", "rounds", "photons", "seed"):
                column.prop(values, name)
        if not show_job(layout, TITLE):
            layout.operator("optisense.calibrate", icon="CAMERA_DATA")
        show_outcome(layout, TITLE)
        if not values.result:
            return
        box = layout.box()
        for line in values.result.splitlines():
            paragraph(box, line, "DOT", boxed=True)
        row = layout.row(align=True)
        row.operator("optisense.open_calibrated", icon="FILE_FOLDER")
        if Path(values.page).exists():
            row.operator("wm.path_open", text="Open Page", icon="URL").filepath = values.page

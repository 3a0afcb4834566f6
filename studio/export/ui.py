"""Step 8 in the sidebar."""

from __future__ import annotations

from pathlib import Path

import bpy

from ..engine import session
from ..engine.layout import SidebarPanel, show_job, show_outcome


class OPTISENSE_PT_export(SidebarPanel, bpy.types.Panel):
    bl_label = "Report and Export"
    bl_order = 8

    def draw(self, context: bpy.types.Context) -> None:
        if show_job(self.layout, "Writing"):
            return
        column = self.layout.column(align=True)
        column.operator("optisense.report", icon="TEXT")
        column.operator("optisense.export", icon="EXPORT")
        column.operator("optisense.export_robot", icon="ARMATURE_DATA")
        show_outcome(self.layout, "Writing")
        written = session.state().written
        if written and Path(written).exists():
            text = f"Open {Path(written).name}"
            row = self.layout.row()
            row.operator("wm.path_open", text=text, icon="URL").filepath = written

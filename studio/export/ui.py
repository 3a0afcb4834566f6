"""Step 8 in the sidebar."""

from __future__ import annotations

import bpy

from ..engine.layout import SidebarPanel, show_job


class OPTISENSE_PT_export(SidebarPanel, bpy.types.Panel):
    bl_idname = "OPTISENSE_PT_export"
    bl_label = "Report and Export"
    bl_order = 8
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        if show_job(self.layout, "Writing"):
            return
        column = self.layout.column(align=True)
        column.operator("optisense.report", icon="TEXT")
        column.operator("optisense.export", icon="EXPORT")


register, unregister = bpy.utils.register_classes_factory((OPTISENSE_PT_export,))

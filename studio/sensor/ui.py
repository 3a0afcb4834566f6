"""Step 1 in the sidebar."""

from __future__ import annotations

import bpy

from ..engine import session
from ..engine.layout import TAB, SidebarPanel, labelled, paragraph, show_job, show_other_outcomes
from ..engine.preferences import HOW_TO_GET, engine_command
from ..looks import footprint, markers
from . import cad, tour
from .warming import prepare


class OPTISENSE_PT_sensor(SidebarPanel, bpy.types.Panel):
    bl_label = "Sensor"
    bl_order = 1
    bl_options = frozenset()

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.scene is not None

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        if not engine_command():
            paragraph(layout, f"No engine was found. {HOW_TO_GET}.", "ERROR")
        elif session.running() is None:
            layout.operator("optisense.start_engine", icon="PLAY")
        tour.draw(layout, context)
        layout.menu("OPTISENSE_MT_new", icon="FILE_NEW")
        cad.draw(layout)
        row = layout.row(align=True)
        row.operator("optisense.open", text="Open", icon="FILE_FOLDER")
        row.operator("optisense.save", icon="FILE_TICK")
        row.operator("optisense.save_as", icon="BLANK1")
        design = context.scene.optisense
        if not design.is_open:
            prepare()  # the user looks at this panel, and may soon open a sensor
        else:
            column = labelled(layout)
            column.prop(design, "title")
            column.prop(design, "description")
            if design.is_saved:
                paragraph(layout, design.folder, "FILE_FOLDER")
            if not show_job(layout, "Checking"):
                layout.operator("optisense.check", icon="CHECKMARK")
            _looks(layout.row(align=True), context.scene.optisense_looks)
            row = layout.row()
            row.prop(context.scene.optisense_looks, "footprint")
            if markers.of_design(context.scene):
                row.prop(context.scene.optisense_looks, "markers")
            text = footprint.in_words(context.scene)
            if text:
                paragraph(layout, text, "CAMERA_DATA")
        if context.workspace is not None and context.workspace.name != TAB:
            layout.operator("optisense.workspace", icon="WORKSPACE")
        show_job(layout, "Opening the sensor", "Saving")
        show_other_outcomes(layout)


def _looks(row: bpy.types.UILayout, looks: bpy.types.PropertyGroup) -> None:
    row.prop(looks, "cut", icon="MOD_BOOLEAN")
    where = row.row(align=True)
    where.enabled = looks.cut
    where.prop(looks, "axis", text="")
    where.prop(looks, "share", text="", slider=True)

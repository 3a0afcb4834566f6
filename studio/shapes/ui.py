"""Step 2 in the sidebar."""

from __future__ import annotations

import bpy

from ..engine.layout import SidebarPanel, labelled, paragraph, show_job, show_outcome
from ..scene.cages import ignored_edits
from ..scene.collections import objects_of
from ..scene.contacts import sensing_surface
from .cage_operator import active_cage
from .cage_warnings import warnings_of
from .reference_operator import READING

HOW_TO_CAGE_MORE = "For more parts in a cage: remove it, select all of them, Create a New Cage."


class OPTISENSE_PT_shapes(SidebarPanel, bpy.types.Panel):
    bl_label = "Shapes"
    bl_order = 2

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        column = layout.column(align=True)
        if not show_job(column, READING):
            column.operator("optisense.add_mesh", icon="IMPORT")
        column.operator("optisense.set_reference", icon="PINNED")
        if sensing_surface(context.scene) is None:
            column.operator("optisense.make_skin", icon="SURFACE_DATA")
        show_outcome(layout, READING)
        active = context.active_object
        if active is not None and active.optisense.kind == "PART":
            _part(layout.box(), active)
        box = layout.box()
        box.label(text="Cage", icon="MESH_GRID")
        column = box.column(align=True)
        column.operator("optisense.new_cage", icon="ADD")
        editing = context.mode == "EDIT_MESH"
        column.operator(
            "optisense.edit_shape",
            text="End Editing" if editing else "Edit Shape",
            icon="EDITMODE_HLT",
        )
        for cage in objects_of(context.scene, "CAGE"):
            row = column.row()
            key = cage.optisense.key
            row.operator(
                "optisense.select_cage", text=key, icon="RESTRICT_SELECT_OFF",
                depress=cage == active,
            ).cage = key  # fmt: skip
        found = active_cage(context)
        if found is not None:
            _cage(box, context.scene, *found)


def _part(layout: bpy.types.UILayout, part: bpy.types.Object) -> None:
    layout.label(text=part.optisense.key or part.name, icon="MESH_DATA")
    column = labelled(layout)
    column.prop(part.optisense, "role")
    column.prop(part.optisense, "priority")
    row = layout.row(align=True)
    row.operator("optisense.flip", icon="UV_SYNC_SELECT")
    row.operator("optisense.remove_part", text="", icon="X")


def _cage(
    layout: bpy.types.UILayout, scene: bpy.types.Scene, cage: bpy.types.Object, values: dict
) -> None:
    along = " x ".join(str(count) for count in values["resolution"])
    text = f"{cage.optisense.key}: {along}, bends {', '.join(values['parts'])}"
    paragraph(layout, text, boxed=True)
    problems = warnings_of(scene, cage.optisense.key)
    for problem in [*ignored_edits(scene, cage), *problems]:
        message = problem["message"]
        hint = f" {problem['hint']}." if problem["hint"] else ""
        text = f"{message[:1].upper()}{message[1:]}.{hint}"
        paragraph(layout, text, "ERROR", boxed=True)
    if problems:
        paragraph(layout, HOW_TO_CAGE_MORE, "BLANK1", boxed=True)
    row = layout.row(align=True)
    for bound, name in (("c_min", "C_min"), ("c_max", "C_max")):
        icon = "CHECKMARK" if values.get(bound) else "BLANK1"
        row.operator("optisense.set_bound", text=f"Set {name}", icon=icon).bound = bound
    if isinstance(values.get("blend"), (int, float)):
        row = layout.row()
        row.enabled = cage.mode != "EDIT"  # undo in edit mode does not know of it
        row.prop(cage.optisense, "blend", text="A", slider=True)
    elif values.get("c_min") and values.get("c_max"):
        layout.operator("optisense.blend")
    row = layout.row(align=True)
    row.operator("optisense.rest_cage", icon="LOOP_BACK")
    row.operator("optisense.remove_cage", text="", icon="X")

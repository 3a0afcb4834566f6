"""Step 3 in the sidebar."""

from __future__ import annotations

from typing import Any

import bpy

from ..engine.layout import SidebarPanel, labelled, show_job, show_outcome
from ..looks import markers
from ..simulate.picture import file_icon
from . import gallery
from .operator import KEEPING


class OPTISENSE_PT_materials(SidebarPanel, bpy.types.Panel):
    bl_label = "Materials"
    bl_order = 3

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        choice = context.window_manager.optisense_material
        row = layout.row(align=True)
        row.prop(choice, "kind", expand=True)
        if gallery.is_begun(choice.kind):
            layout.template_icon_view(choice, choice.kind, show_labels=True, scale=5.0)
        row = layout.row(align=True)
        row.prop(choice, choice.kind, text="")
        row.operator("optisense.material_pictures", text="", icon="IMGDISPLAY")
        coming = gallery.waiting(choice.kind)
        if coming:
            layout.label(text=f"Drawing {coming} more", icon="SORTTIME")
        column = layout.column(align=True)
        if not show_job(column, "Drawing the material"):
            column.operator("optisense.preview_material", icon="SHADING_RENDERED")
            column.operator("optisense.apply_material", icon="MATERIAL")
        show_outcome(layout, "Drawing the material")
        icon = file_icon(choice.preview)
        if icon:
            layout.template_icon(icon_value=icon, scale=7.0)
            layout.label(text=choice.previewed)
        active = context.active_object
        if active is not None and active.optisense.kind == "PART":
            _part(layout.box(), context, active.optisense)


def _markers(layout: bpy.types.UILayout, values: dict[str, Any] | None) -> None:
    if values is None:
        text = "No markers"
    elif values.get("grid"):
        text = f"Markers: {values['grid'][0]} x {values['grid'][1]}, {values['pitch']:g} mm apart"
    else:
        text = f"Markers: {len(values['places'])}"
    layout.label(text=text)
    row = layout.row(align=True)
    row.operator("optisense.set_markers", text="Change Markers" if values else "Print Markers")
    if values is not None:
        row.operator("optisense.remove_markers", text="", icon="X")


def _part(
    layout: bpy.types.UILayout, context: bpy.types.Context, own: bpy.types.PropertyGroup
) -> None:
    design = context.scene.optisense
    column = labelled(layout)
    if own.role == "sensing_surface":
        layout.label(text=f"Coating: {design.coating.library or 'own'}")
        design.coating.draw(column)
        _markers(layout, markers.of_design(context.scene))
    else:
        column.prop_search(own, "material", design, "materials")
        material = design.materials.get(own.material)
        if material is None:
            none = "absorbs all light" if own.role == "blocker" else "needs a material"
            layout.label(text=f"No material: {none}", icon="INFO")
            return
        column.prop(material, "kind")
        material.draw(column)
    layout.operator("optisense.keep_material", icon="FILE_TICK")
    show_outcome(layout, KEEPING)

"""Step 4 in the sidebar."""

from __future__ import annotations

import json

import bpy

from ..engine.layout import SidebarPanel, labelled
from ..scene.cameras import imaging
from ..scene.collections import objects_of
from . import snapping


class OPTISENSE_UL_light_groups(bpy.types.UIList):
    """List of light groups: name, colour, flux."""

    def draw_item(self, context, layout, data, item, icon, active_data, active_property) -> None:
        row = layout.row(align=True)
        row.label(text=item.name)
        row.prop(item, "colour", text="")
        row.prop(item, "flux", text="")
        icon = "HIDE_OFF" if item.shown else "HIDE_ON"
        row.prop(item, "shown", text="", icon=icon, emboss=False)
        alone = [each.name for each in data.light_groups if each.shown] == [item.name]
        icon = "SOLO_ON" if alone else "SOLO_OFF"
        row.operator("optisense.solo_group", text="", icon=icon, emboss=False).group = item.name


class OPTISENSE_PT_lights(SidebarPanel, bpy.types.Panel):
    bl_label = "Lights and Camera"
    bl_order = 4

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        scene = context.scene
        design = scene.optisense
        row = layout.row(align=True)
        row.operator("optisense.add_light", icon="LIGHT_AREA")
        row.operator("optisense.add_camera", icon="CAMERA_DATA")
        layout.label(text="Groups: colour, flux of each light (mW)")
        layout.template_list(
            "OPTISENSE_UL_light_groups", "", design, "light_groups", design, "light_group_index",
            rows=3,
        )  # fmt: skip
        if 0 <= design.light_group_index < len(design.light_groups):
            _group(layout.box(), design.light_groups[design.light_group_index])
        row = layout.row(align=True)
        row.operator("optisense.arrange_row", icon="MOD_ARRAY")
        row.operator("optisense.set_group", icon="GROUP")
        row = layout.row(align=True)
        row.operator("optisense.snap_row", icon="SNAP_EDGE")
        is_on = snapping.is_on(scene)
        row.operator("optisense.snap_moves", icon="SNAP_ON", depress=is_on)
        cameras = objects_of(scene, "CAMERA")
        if cameras:
            _camera(layout.box(), cameras[0].optisense)


def _group(layout: bpy.types.UILayout, group: bpy.types.PropertyGroup) -> None:
    row = layout.row()
    row.label(text=f"{group.model}")
    row.operator("optisense.set_model", text="Choose", icon="VIEWZOOM").group = group.name
    column = labelled(layout)
    column.prop(group, "emitter")
    group.draw(column)


def _camera(layout: bpy.types.UILayout, camera: bpy.types.PropertyGroup) -> None:
    row = layout.row()
    row.label(text=f"Camera: {camera.model}", icon="CAMERA_DATA")
    row.operator("optisense.look_through", text="", icon="HIDE_OFF")
    column = labelled(layout)
    column.prop(camera, "projection")
    column.prop(camera, "fov", text="View angle (°)")
    column.prop(camera, "pixels")
    given = imaging(json.loads(camera.data)) if camera.data else {}
    if given:
        names = ", ".join(name.replace("_", " ") for name in given)
        layout.label(text=f"With {names}", icon="INFO")

"""Step 5 in the sidebar."""

from __future__ import annotations

import bpy

from ..engine import session
from ..engine.layout import TAB, SidebarPanel, labelled, paragraph, show_job, show_outcome
from ..scene.contacts import pressing
from . import picture


class OPTISENSE_PT_simulate(SidebarPanel, bpy.types.Panel):
    bl_label = "Simulate"
    bl_order = 5
    bl_options = frozenset()

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        scene = context.scene
        column = layout.column(align=True)
        row = column.row(align=True)
        row.operator("optisense.place_contact", icon="CURSOR")
        row.operator("optisense.add_contact", text="Middle", icon="ADD")
        row = column.row(align=True)
        row.operator("optisense.nine_contacts", icon="GRID")
        row.operator("optisense.clear_contacts", icon="X")
        settings = scene.optisense_simulation
        layout.prop(settings, "draft")
        row = layout.row()
        row.scale_y = 1.4
        if not show_job(row, "Simulating", "Finding nine places"):
            row.operator("optisense.simulate", icon="RENDER_STILL")
        show_outcome(layout, "Simulating", "Finding nine places")
        active = context.active_object
        if active is not None and active.optisense.kind == "CONTACT":
            _contact(labelled(layout.box()), active.optisense)
        _settings(labelled(layout), settings)
        now = context.window_manager.optisense_picture
        if not now.shown:
            count = len(pressing(scene))
            layout.label(text=f"{count} contacts" if count != 1 else "1 contact")
            return
        icon = picture.icon()
        if icon and context.workspace.name != TAB:  # there the picture stands beside the bench
            layout.template_icon(icon_value=icon, scale=11.0)
        other = now.other_sensor(scene)
        if other:
            layout.label(text=f"Picture of the {other}", icon="INFO")
        paragraph(layout, picture.kind(now) + now.summary)
        for line in now.presses.splitlines():
            paragraph(layout, line, "FORCE_FORCE")
        layout.operator("optisense.show_picture", icon="IMAGE_DATA")
        _light_levels(layout, scene)


def _settings(column: bpy.types.UILayout, settings: bpy.types.PropertyGroup) -> None:
    """Draw the settings of pictures; their height is constant, so that nothing below moves."""
    column.prop(settings, "size")
    column.prop(settings, "noise", text="Noise (%)")
    column.prop(settings, "skin")
    row = column.row(align=True, heading="Exposure")
    row.prop(settings, "auto_exposure", text="Auto")
    factor = row.row()
    factor.enabled = not settings.auto_exposure
    factor.prop(settings, "exposure", text="")


def _contact(column: bpy.types.UILayout, values: bpy.types.PropertyGroup) -> None:
    column.prop(values, "indenter")
    if values.indenter in ("sphere", "cylinder"):
        column.prop(values, "radius", text="Radius (mm)")
    if values.indenter == "cylinder":
        column.prop(values, "length", text="Length (mm)")
    if values.indenter == "plane":
        column.prop(values, "tilt", text="Tilt (°)")
        column.prop(values, "size", text="Size (mm)")
    if values.indenter == "mesh":
        column.prop(values, "file")
        if not values.file:
            column.prop(values, "shape")
        column.prop(values, "scale")
    column.row().prop(values, "press_by", expand=True)
    if values.press_by == "FORCE":
        column.prop(values, "force", text="Force (N)")
    else:
        column.prop(values, "depth", text="Depth (mm)")
    column.prop(values, "rotation", text="Rotation (°)")
    column.prop(values, "shift", text="Drag (mm)")
    column.prop(values, "twist", text="Twist (°)")


def _light_levels(layout: bpy.types.UILayout, scene: bpy.types.Scene) -> None:
    """Draw flux and colour of each group; a change relights the picture at once."""
    box = layout.box().column(align=True)
    box.label(text="Relight: flux (mW), colour", icon="LIGHT")
    box.enabled = session.running() is not None
    for group in scene.optisense.light_groups:
        row = box.row(align=True)
        row.label(text=group.name)
        row.prop(group, "flux", text="")
        row.prop(group, "colour", text="")

"""Operations on a row of lights: pitch, count and length; visibility; light of one group."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.props import FloatProperty, IntProperty, StringProperty

from ..core import rows
from ..engine import polls
from ..engine.layout import labelled
from ..engine.operators import refuse
from ..scene import properties
from ..scene.collections import objects_of, select_only
from ..scene.lamps import add_light, light_pose
from .group_selection import lights_of
from .windows import ask_for_windows

_setting = False


def of_one_group(context: bpy.types.Context) -> list[bpy.types.Object]:
    """Return the selected lights in the design's order; empty if they are of several groups."""
    chosen = [each for each in objects_of(context.scene, "LIGHT") if each.select_get()]
    return chosen if len({each.optisense.group for each in chosen}) == 1 else []


def _pitch_changed(values: Any, context: bpy.types.Context) -> None:
    _keep(values, "length", values.pitch * (values.count - 1))


def _length_changed(values: Any, context: bpy.types.Context) -> None:
    if values.count > 1:
        _keep(values, "pitch", values.length / (values.count - 1))


def _keep(values: Any, name: str, value: float) -> None:
    """Set a dependent number without triggering its own update."""
    global _setting
    if not _setting:
        _setting = True
        try:
            setattr(values, name, value)
        finally:
            _setting = False


class OPTISENSE_OT_arrange_row(polls.Checked, bpy.types.Operator):
    """Give the selected row of lights another count, pitch or length; its middle, its direction and
    the way its lights shine stay"""

    bl_idname = "optisense.arrange_row"
    bl_label = "Arrange Row"
    bl_options = {"REGISTER", "UNDO"}

    count: IntProperty(
        name="Count", description="Number of lights in the row", min=1, max=1000, default=1,
        update=_pitch_changed,
    )  # fmt: skip
    pitch: FloatProperty(
        name="Pitch (mm)",
        description="Distance between the centres of neighbouring lights, mm",
        min=0.0,
        precision=3,
        default=4.0,
        update=_pitch_changed,
    )
    length: FloatProperty(
        name="Length (mm)", description="Distance between the centres of the first and the last "
        "light, mm",
        min=0.0, precision=3, update=_length_changed,
    )  # fmt: skip

    checks = (
        polls.has_design,
        polls.in_object_mode,
        polls.requires(of_one_group, "Select the lights of one row: click on their group"),
    )

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        poses = [light_pose(each) for each in of_one_group(context)]
        self.count = len(poses)
        row = rows.row_through([pose["position"] for pose in poses])
        self.pitch = row.pitch if row is not None and len(poses) > 1 else self.pitch
        return context.window_manager.invoke_props_dialog(self)

    def draw(self, context: bpy.types.Context) -> None:
        column = labelled(self.layout)
        for name in ("count", "pitch", "length"):
            column.prop(self, name)

    def execute(self, context: bpy.types.Context) -> set[str]:
        scene, lights = context.scene, of_one_group(context)
        poses = [light_pose(each) for each in lights]
        row = rows.row_through([pose["position"] for pose in poses])
        if row is None:
            return refuse(self, "These lights do not stand in one row; select those of one row")
        group = scene.optisense.light_groups[lights[0].optisense.group]
        first = poses[0]
        for each in lights:
            bpy.data.objects.remove(each)
        made = []
        for place in row.places(self.count, self.pitch):
            pose = {**first, "position": [round(float(x), 6) + 0.0 for x in place]}
            made.append(add_light(scene, group, pose))
        select_only(*made)
        ask_for_windows(scene)
        return {"FINISHED"}


class OPTISENSE_OT_solo_group(polls.Designing, bpy.types.Operator):
    """Show the light of this group alone in the picture, or that of all groups again; the design
    stays as it is"""

    bl_idname = "optisense.solo_group"
    bl_label = "Solo"
    bl_options = {"REGISTER", "UNDO"}

    group: StringProperty(name="Group", description="Light group that is shown alone")

    def execute(self, context: bpy.types.Context) -> set[str]:
        groups = context.scene.optisense.light_groups
        if self.group not in groups:
            return refuse(self, f"There is no light group '{self.group}'")
        alone = [each.name for each in groups if each.shown] == [self.group]
        for each in groups:
            each.shown = alone or each.name == self.group
        if not alone:
            select_only(*lights_of(context.scene, self.group))
        return {"FINISHED"}


def hide_lights(scene: bpy.types.Scene, group: bpy.types.PropertyGroup) -> None:
    """Show or hide the lights of a group in 3D views, as the group's property says."""
    layer = bpy.context.view_layer
    for each in lights_of(scene, group.name):
        if layer is not None and each.name in layer.objects:
            each.hide_set(not group.shown)


HOOKS = ((properties.when_group_hidden, hide_lights),)

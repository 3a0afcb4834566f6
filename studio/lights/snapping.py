"""Snapping of lights to edges of parts: a row is put onto the nearest edge, and moves snap."""

from __future__ import annotations

import bpy
import numpy as np
from bpy.props import FloatProperty
from mathutils import Matrix, Vector

from ..core import rows
from ..engine import polls
from ..engine.operators import refuse
from ..looks.drawing import outline
from ..scene.collections import objects_of
from ..scene.lamps import light_pose
from ..scene.world import world_matrix
from .rows import of_one_group

CAUGHT = {"EDGE", "EDGE_MIDPOINT", "VERTEX"}
"""Elements of parts to which moves snap: edges, their midpoints and ends."""


def is_on(scene: bpy.types.Scene) -> bool:
    """Return whether moves snap to edges."""
    settings = scene.tool_settings
    return settings.use_snap and set(settings.snap_elements) >= {"EDGE"}


class OPTISENSE_OT_snap_moves(polls.Designing, bpy.types.Operator):
    """Let lights and rows that are moved (G, or an arrow of a row) snap to the edges, corners and
    middles of edges of parts; pressed again, they move freely"""

    bl_idname = "optisense.snap_moves"
    bl_label = "Snap Moves"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        settings = context.scene.tool_settings
        if is_on(context.scene):
            settings.use_snap = False
        else:
            settings.snap_elements = CAUGHT
            settings.snap_target = "CENTER"
            settings.use_snap = settings.use_snap_translate = True
        return {"FINISHED"}


class OPTISENSE_OT_snap_row(polls.Checked, bpy.types.Operator):
    """Put the selected row of lights onto the nearest edge of a part: its middle on the edge, its
    lights along it at their pitch; the way they shine turns with the row"""

    bl_idname = "optisense.snap_row"
    bl_label = "Snap to Edge"
    bl_options = {"REGISTER", "UNDO"}

    away: FloatProperty(
        name="Away (mm)", min=-100.0, max=100.0, precision=3,
        description="Distance of the lights from the edge along their direction, mm",
    )  # fmt: skip

    checks = (
        polls.has_design,
        polls.in_object_mode,
        polls.requires(of_one_group, "Select the lights of one row: click on their group"),
    )

    def execute(self, context: bpy.types.Context) -> set[str]:
        lights = of_one_group(context)
        poses = [light_pose(each) for each in lights]
        row = rows.row_through([pose["position"] for pose in poses])
        if row is None:
            return refuse(self, "These lights do not stand in one row; select those of one row")
        parts = [each for each in objects_of(context.scene, "PART") if each.visible_get()]
        ends = np.concatenate([np.empty((0, 3)), *(outline(each) for each in parts)])
        found = rows.nearest_edge(row, ends.reshape(-1, 2, 3))
        if found is None:
            return refuse(self, "No part that is shown has an edge")
        place, along = Vector(found[0]), Vector(found[1])
        turn = Vector(row.along).rotation_difference(along) if len(lights) > 1 else None
        moved = Matrix.Identity(4) if turn is None else turn.to_matrix().to_4x4()
        shine = moved.to_3x3() @ sum((Vector(pose["direction"]) for pose in poses), Vector())
        target = place + shine.normalized() * self.away
        moved = Matrix.Translation(target) @ moved @ Matrix.Translation(-Vector(row.middle))
        for each in lights:
            each.matrix_world = moved @ world_matrix(each)
        return {"FINISHED"}

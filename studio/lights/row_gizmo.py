"""Gizmo that moves and turns a row of lights: arrows along the row, along its light and across
both, and a ring about the row.
"""

from __future__ import annotations

import bpy
from mathutils import Matrix, Vector

from ..core import rows
from ..scene.lamps import light_pose
from .rows import of_one_group

COLOURS = ((0.95, 0.75, 0.2), (0.3, 0.85, 0.95), (0.85, 0.45, 0.9))
"""Colours (red, green, blue) of the arrows along the row, along its light and across; none is that
of a coordinate axis, which the arrows need not follow.
"""

LENGTH, BRIGHT, FAINT = 1.5, 1.0, 0.6
"""Length of an arrow in units of gizmos, and its opacities with and without the pointer on it."""

RING = 0.6
"""Radius of the ring in units of gizmos: the heads of foreshortened arrows stay free of it."""

LEAST = 2
"""Smallest number of lights in a row that has a gizmo."""


def frame(lights: list[bpy.types.Object]) -> Matrix:
    """Return the frame of a row: x along it, z against its light, and the origin in its middle."""
    poses = [light_pose(each) for each in lights]
    row = rows.row_through([pose["position"] for pose in poses])
    places = [Vector(pose["position"]) for pose in poses]
    middle = sum(places, Vector()) / len(places) if row is None else Vector(row.middle)
    back = -sum((Vector(pose["direction"]) for pose in poses), Vector())
    if back.length < 1e-6:
        back = Vector((0.0, 0.0, 1.0))
    back.normalize()
    along = Vector((1.0, 0.0, 0.0)) if row is None else Vector(row.along)
    along -= along.dot(back) * back
    along = back.orthogonal() if along.length < 1e-6 else along
    along.normalize()
    turn = Matrix((along, back.cross(along), back)).transposed().to_4x4()
    return Matrix.Translation(middle) @ turn


class OPTISENSE_GGT_row(bpy.types.GizmoGroup):
    """Moves and turns a row of lights"""

    bl_idname = "OPTISENSE_GGT_row"
    bl_label = "Row of Lights"
    bl_space_type = "VIEW_3D"
    bl_region_type = "WINDOW"
    bl_options = {"3D", "PERSISTENT"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        scene = context.scene
        if scene is None or not scene.optisense.is_open or context.mode != "OBJECT":
            return False
        return len(of_one_group(context)) >= LEAST

    def setup(self, context: bpy.types.Context) -> None:
        self.arrows = []
        for axis, colour in enumerate(COLOURS):
            arrow = self.gizmos.new("GIZMO_GT_arrow_3d")
            values = arrow.target_set_operator("transform.translate")
            values.constraint_axis = tuple(each == axis for each in range(3))
            self._common(arrow, values, colour)
            arrow.length = LENGTH
            self.arrows.append((arrow, values))
        ring = self.gizmos.new("GIZMO_GT_dial_3d")
        values = ring.target_set_operator("transform.rotate")
        values.constraint_axis = (True, False, False)
        self._common(ring, values, COLOURS[0])
        ring.scale_basis = RING
        self.ring = (ring, values)

    @staticmethod
    def _common(
        gizmo: bpy.types.Gizmo, values: bpy.types.OperatorProperties, colour: tuple[float, ...]
    ) -> None:
        values.orient_type = "GLOBAL"
        values.release_confirm = True
        gizmo.color, gizmo.color_highlight = colour, (1.0, 1.0, 1.0)
        gizmo.alpha, gizmo.alpha_highlight = FAINT, BRIGHT
        gizmo.line_width = 2.5
        gizmo.use_draw_modal = True

    def draw_prepare(self, context: bpy.types.Context) -> None:
        found = frame(of_one_group(context))
        turn = found.to_3x3()
        for axis, (arrow, values) in enumerate(self.arrows):
            way = turn.col[axis] * (-1.0 if axis == 2 else 1.0)  # along the light, not against it
            quaternion = way.to_track_quat("Z", "Y")
            arrow.matrix_basis = Matrix.Translation(found.translation) @ (
                quaternion.to_matrix().to_4x4()
            )
            values.orient_matrix = turn
            values.orient_matrix_type = "GLOBAL"
        ring, values = self.ring
        about = turn.col[0].to_track_quat("Z", "Y").to_matrix().to_4x4()
        ring.matrix_basis = Matrix.Translation(found.translation) @ about
        values.orient_matrix = turn
        values.orient_matrix_type = "GLOBAL"

"""Operator that makes the sensing surface of a gel."""

from __future__ import annotations

import bmesh
import bpy
import numpy as np
from mathutils import Vector
from numpy.typing import NDArray

from ..core import outer_faces
from ..core.errors import SceneError
from ..engine import polls
from ..engine.operators import refuse
from ..scene.build import add_part
from ..scene.cages import cage_around, join_cage
from ..scene.collections import objects_of, select_only
from ..scene.contacts import sensing_surface
from ..scene.gather import free_name, part_names
from ..scene.meshes import part_mesh
from ..scene.world import world_matrix

ROLES = ("elastomer",)


def _gel(context: bpy.types.Context) -> bpy.types.Object | None:
    """Return the active gel, or the only gel of the sensor; otherwise None."""
    active = context.active_object
    if active is not None and active.optisense.kind == "PART" and active.optisense.role in ROLES:
        return active
    gels = [each for each in objects_of(context.scene, "PART") if each.optisense.role in ROLES]
    return gels[0] if len(gels) == 1 else None


def outward(scene: bpy.types.Scene, gel: bpy.types.Object) -> NDArray[np.float64]:
    """Return the coordinate direction, (3,), nearest to that from the rest of the sensor to the
    gel; +z for a gel by itself.
    """
    others = [each for each in objects_of(scene, "PART", "CAMERA", "LIGHT") if each != gel]
    if not others:
        return np.array((0.0, 0.0, 1.0))
    way = _middle(gel) - sum((_middle(each) for each in others), Vector()) / len(others)
    axis = max(range(3), key=lambda each: abs(way[each]))
    found = np.zeros(3)
    found[axis] = 1.0 if way[axis] >= 0.0 else -1.0
    return found


def _middle(item: bpy.types.Object) -> Vector:
    corners = [Vector(corner) for corner in item.bound_box] if item.type == "MESH" else [Vector()]
    return world_matrix(item) @ (sum(corners, Vector()) / len(corners))


def _chosen(gel: bpy.types.Object) -> NDArray[np.int64]:
    """Return the indices of the triangles of the faces that are selected in edit mode."""
    edited = bmesh.from_edit_mesh(gel.data)
    edited.faces.ensure_lookup_table()
    picked = np.array([face.select for face in edited.faces], dtype=bool)
    gel.update_from_editmode()
    gel.data.calc_loop_triangles()
    owner = np.empty(len(gel.data.loop_triangles), dtype=np.int32)
    gel.data.loop_triangles.foreach_get("polygon_index", owner)
    return np.flatnonzero(picked[owner])


class OPTISENSE_OT_make_skin(polls.Checked, bpy.types.Operator):
    """Make the sensing surface of the outer faces of the gel, or of those that are selected in edit
    mode. It faces inward, and joins the gel's cage"""

    bl_idname = "optisense.make_skin"
    bl_label = "Make Sensing Surface"
    bl_options = {"REGISTER", "UNDO"}

    checks = (
        polls.has_design,
        polls.requires(_gel, "Select a gel first: a part with the role Elastomer"),
        polls.requires(
            lambda c: sensing_surface(c.scene) is None,
            "There is a sensing surface already; remove it from the sensor first",
        ),
    )

    def execute(self, context: bpy.types.Context) -> set[str]:
        scene, gel = context.scene, _gel(context)
        cage = cage_around(scene, gel)
        try:
            mesh = part_mesh(gel, caged=cage is not None)
        except SceneError as error:
            return refuse(self, f"{error}")
        if gel.mode == "EDIT":
            faces = _chosen(gel)
            if not len(faces):
                return refuse(self, "Select the outer faces of the gel first")
            bpy.ops.object.mode_set(mode="OBJECT")
        else:
            faces = outer_faces.outer_faces(mesh, outward(scene, gel))
            if not len(faces):
                return refuse(
                    self, f"No face of {gel.name} looks outward; select its faces in edit mode"
                )
        key = free_name("skin", part_names(scene))
        values = {"role": "sensing_surface", "mesh": f"meshes/{key}.obj"}
        skin = add_part(scene, key, values, outer_faces.skin_of(mesh, faces))
        if cage is not None:
            join_cage(scene, cage, skin)
        select_only(skin)
        self.report({"INFO"}, f"The sensing surface lies on {len(faces)} triangles of {gel.name}")
        return {"FINISHED"}

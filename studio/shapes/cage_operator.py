"""Operators for cages: create, edit, set bounds, remove."""

from __future__ import annotations

import json
from typing import Any

import bpy
import numpy as np
from bpy.props import EnumProperty, IntVectorProperty

from ..core import cage as core
from ..core.numbers import kept_array
from ..engine import polls
from ..engine.operators import refuse
from ..scene.cages import (
    add_cage,
    as_array,
    as_points,
    cage_around,
    cage_data,
    cage_values,
    current_points,
    follow,
    lock,
    set_points,
    shown_points,
)
from ..scene.collections import object_of, objects_of, select_only
from ..scene.gather import free_name, part_names
from ..scene.meshes import rest_shape, settle, show_vertices


def _cage(context: bpy.types.Context) -> bpy.types.Object | None:
    """Return the active cage, or the one around the active part."""
    active = context.active_object
    if active is not None and active.optisense.kind == "CAGE":
        return active
    if active is not None and active.optisense.kind == "PART":
        return cage_around(context.scene, active)
    return None


_has_cage = polls.requires(_cage, "Select a cage, or a part that is in one")


def _has_bounds(context: bpy.types.Context) -> bool:
    values = cage_data(_cage(context))
    return bool(values.get("c_min") and values.get("c_max"))


def _are_free(context: bpy.types.Context) -> bool:
    """Return whether no selected part is in a cage."""
    caged = {n for c in objects_of(context.scene, "CAGE") for n in cage_data(c)["parts"]}
    return not any(each.optisense.key in caged for each in polls.picked(context, "PART"))


class _OfCage(polls.Checked):
    """Base of operators on a cage: the active one, or the one around the active part."""

    checks = (_has_cage,)


def _end_editing(cage: bpy.types.Object) -> None:
    """Leave edit mode, as a separate step of the undo history.

    In edit mode Blender's undo restores only the vertices of a mesh, not the object's properties:
    bounds and blend would stay while the points go back.
    """
    if cage.mode == "EDIT":
        bpy.ops.object.mode_set(mode="OBJECT")
        if bpy.ops.ed.undo_push.poll():
            bpy.ops.ed.undo_push(message="End Editing")


class OPTISENSE_OT_new_cage(polls.Checked, bpy.types.Operator):
    """Put a cage of control points around the selected parts"""

    bl_idname = "optisense.new_cage"
    bl_label = "Create a New Cage"
    bl_options = {"REGISTER", "UNDO"}

    resolution: IntVectorProperty(
        name="Points along x, y, z", size=3, min=2, max=64, soft_max=9, default=(3, 3, 3),
        description="Numbers of control points; more points allow finer shapes",
    )  # fmt: skip

    checks = (
        polls.has_design,
        polls.in_object_mode,
        polls.selecting("PART", what="the parts to bend"),
        polls.requires(_are_free, "A selected part is in a cage already"),
    )

    def execute(self, context: bpy.types.Context) -> set[str]:
        scene = context.scene
        if np.prod(self.resolution) > 20_000:
            return refuse(self, "More than 20,000 control points")
        named = {part: name for name, part in part_names(scene).items()}
        parts = polls.picked(context, "PART")
        corners = []
        for part in parts:
            part.optisense.key = named[part]
            vertices = settle(part).vertices
            corners += [vertices.min(axis=0), vertices.max(axis=0)]
        lower, upper = np.min(corners, axis=0), np.max(corners, axis=0)
        thin = upper - lower < 1e-3  # a flat sheet needs a box with some height
        lower, upper = lower - 0.5 * thin, upper + 0.5 * thin
        box = np.array([lower, upper])
        resolution = tuple(self.resolution)
        taken = [each.optisense.key for each in objects_of(scene, "CAGE")]
        key = free_name(parts[0].optisense.key, taken)
        values = {
            "parts": [part.optisense.key for part in parts],
            "resolution": list(resolution),
            "box": box.tolist(),
            "points": as_points(core.rest_points(box, resolution)),
        }
        cage = add_cage(scene, key, values)
        select_only(cage)
        return {"FINISHED"}


class OPTISENSE_OT_edit_shape(_OfCage, bpy.types.Operator):
    """Move control points; the parts in the cage follow. Press again, or Tab, to end"""

    bl_idname = "optisense.edit_shape"
    bl_label = "Edit Shape"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        cage = _cage(context)
        if cage.mode == "EDIT":
            bpy.ops.object.mode_set(mode="OBJECT")
            return {"FINISHED"}
        if context.mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")
        if cage.name not in context.view_layer.objects:
            return refuse(self, f"'{cage.name}' is hidden with its collection; show that first")
        cage.hide_set(False)
        select_only(cage)
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.select_mode(type="VERT")
        bpy.ops.mesh.select_all(action="DESELECT")
        return {"FINISHED"}


class OPTISENSE_OT_set_bound(_OfCage, bpy.types.Operator):
    """Take the present shape as one end of the range that A blends and searches use"""

    bl_idname = "optisense.set_bound"
    bl_label = "Set Bound"
    bl_options = {"REGISTER", "UNDO"}

    bound: EnumProperty(
        name="Bound", items=[("c_min", "C_min", "A = 0"), ("c_max", "C_max", "A = 1")],
        description="End of the range that the present shape becomes",
    )  # fmt: skip

    def execute(self, context: bpy.types.Context) -> set[str]:
        cage = _cage(context)
        _end_editing(cage)
        shown = shown_points(cage)
        try:
            values = cage_values(cage)
        except ValueError as error:
            return refuse(self, str(error))
        now = kept_array(current_points(values), shown)
        values[self.bound] = as_points(now)
        values.pop("blend", None)
        values["points"] = as_points(now)
        cage.optisense.data = json.dumps(values)
        return {"FINISHED"}


class OPTISENSE_OT_blend(polls.Checked, bpy.types.Operator):
    """Give the cage the shape (1 - A) C_min + A C_max, with the slider for A"""

    bl_idname = "optisense.blend"
    bl_label = "Blend C_min and C_max"
    bl_options = {"REGISTER", "UNDO"}

    checks = (_has_cage, polls.requires(_has_bounds, "Set C_min and C_max first"))

    def execute(self, context: bpy.types.Context) -> set[str]:
        cage = _cage(context)
        _end_editing(cage)
        values, shown = cage_data(cage), shown_points(cage)
        lower, upper = as_array(values["c_min"]), as_array(values["c_max"])
        if len(shown) != len(lower):
            return refuse(self, "Control points were added or removed; undo that first")
        cage.optisense.blend = core.nearest_blend(shown, lower, upper)  # its update shows it
        return {"FINISHED"}


class OPTISENSE_OT_rest_cage(_OfCage, bpy.types.Operator):
    """Put all control points back: the parts take their undeformed shape"""

    bl_idname = "optisense.rest_cage"
    bl_label = "Back to Rest"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        cage = _cage(context)
        _end_editing(cage)
        values = cage_data(cage)
        points = core.rest_points(values["box"], tuple(values["resolution"]))
        values.pop("blend", None)
        values["points"] = as_points(points)
        cage.optisense.data = json.dumps(values)
        try:
            set_points(cage, points)
        except ValueError:
            return refuse(self, "Control points were added or removed; undo that first")
        follow(context.scene, cage)
        return {"FINISHED"}


class OPTISENSE_OT_remove_cage(polls.Checked, bpy.types.Operator):
    """Remove the cage; its parts go back to rest, or stay as they are if they got new vertices"""

    bl_idname = "optisense.remove_cage"
    bl_label = "Remove Cage"
    bl_options = {"REGISTER", "UNDO"}

    checks = (polls.in_object_mode, _has_cage)

    def execute(self, context: bpy.types.Context) -> set[str]:
        cage = _cage(context)
        for name in cage_data(cage)["parts"]:
            part = object_of(context.scene, "PART", name)
            if part is not None:
                rest = rest_shape(part.data)
                if rest is not None:
                    show_vertices(part.data, rest)
                lock(part, False)
        bpy.data.objects.remove(cage)
        return {"FINISHED"}


def active_cage(context: bpy.types.Context) -> tuple[bpy.types.Object, dict[str, Any]] | None:
    """Return the cage that the panel shows, with its values; None without one."""
    active = context.active_object
    cages = objects_of(context.scene, "CAGE")
    for cage in cages:
        values = cage_data(cage)
        if cage == active or (active is not None and active.optisense.key in values["parts"]):
            return cage, values
    return None

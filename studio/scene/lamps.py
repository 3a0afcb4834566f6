"""Lights in the viewport, drawn as the emitting window in its real size."""

from __future__ import annotations

import json
import math
from functools import lru_cache
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix

from ..core.pose import matrix_of, pose_of
from .collections import OPTICAL_SYSTEM, collection, next_order, objects_of
from .world import world_matrix

MOST_POSES = 4096
"""Number of cached poses of lights; most lights stand still while one is moved."""

USUAL_HALF_ANGLE = 60.0
"""Half angle in degrees of a lamp that is not known yet: that of a flat LED."""

POINT_SIZE = (0.6, 0.6)
"""Drawn size in mm of a point lamp, or of one whose size is not known."""


def add_light(
    scene: bpy.types.Scene, group: bpy.types.PropertyGroup, pose: dict[str, Any]
) -> bpy.types.Object:
    """Add an object for one light.

    Args:
        pose: `position`, `direction` and optionally `up`, as in the design file.
    """
    light = bpy.data.objects.new(group.name, _mesh(scene, group))
    values = light.optisense
    values.kind = "LIGHT"
    values.group = group.name
    values.order = next_order(scene, "LIGHT")
    values.data = json.dumps(pose)
    place(light, pose)
    light.color = lamp_colour(group)
    light.show_in_front = True
    light.lock_scale = (True, True, True)  # its group says how large it is
    collection(scene, OPTICAL_SYSTEM).objects.link(light)
    return light


def place(item: bpy.types.Object, pose: dict[str, Any]) -> None:
    """Move a light or camera to the pose in the design."""
    matrix = matrix_of(pose["position"], pose["direction"], pose.get("up"))
    item.matrix_world = Matrix(matrix.tolist())


def light_pose(light: bpy.types.Object) -> dict[str, Any]:
    """Return the pose of a light as for the design file."""
    matrix = tuple(tuple(row) for row in world_matrix(light))
    found = _pose(matrix, light.optisense.data)
    return {name: list(values) for name, values in found.items()}


@lru_cache(maxsize=MOST_POSES)
def _pose(matrix: tuple[tuple[float, ...], ...], data: str) -> dict[str, list[float]]:
    """Return the pose of a light from its matrix and the pose as read; cached."""
    return pose_of(np.array(matrix), json.loads(data) if data else {}, up=False)


def redraw(scene: bpy.types.Scene, group: bpy.types.PropertyGroup) -> None:
    """Redraw the lights of a group after a change of the group."""
    lights = [each for each in objects_of(scene, "LIGHT") if each.optisense.group == group.name]
    if lights:
        mesh = _mesh(scene, group)
        for light in lights:
            light.data = mesh
            light.color = lamp_colour(group)


def lamp_colour(group: bpy.types.PropertyGroup) -> tuple[float, float, float, float]:
    """Return the colour of a group at the greatest brightness that can be drawn."""
    brightest = max(*group.colour, 1e-6)
    red, green, blue = (0.12 + 0.88 * channel / brightest for channel in group.colour)
    return red, green, blue, 1.0


def window(group: bpy.types.PropertyGroup) -> tuple[str, tuple[float, float], float]:
    """Return shape, size (mm) and half angle (degrees) with which a group's lamps are drawn."""
    known = json.loads(group.drawn) if group.drawn else {}
    face = known.get("window") or {"shape": "disc", "size": POINT_SIZE}
    return face["shape"], tuple(face["size"]), known.get("half_angle", USUAL_HALF_ANGLE)


def _mesh(scene: bpy.types.Scene, group: bpy.types.PropertyGroup) -> bpy.types.Mesh:
    """Return the mesh that the lights of a group share, in the group's present size; a mesh that
    another scene uses, too, keeps its size.
    """
    lights = [each for each in objects_of(scene, "LIGHT") if each.optisense.group == group.name]
    mesh = next((each.data for each in lights if isinstance(each.data, bpy.types.Mesh)), None)
    if mesh is None or mesh.users > sum(each.data == mesh for each in lights):
        mesh = bpy.data.meshes.new(f"lamp {group.name}")
    mesh.clear_geometry()
    mesh.from_pydata(*lamp_drawing(*window(group)[:2]))
    mesh.update()
    return mesh


def lamp_drawing(
    shape: str, size: tuple[float, float]
) -> tuple[list[tuple[float, ...]], list[tuple[int, int]], list[list[int]]]:
    """Return vertices (mm), edges and faces of a lamp that shines along -z; y is its height."""
    width, height = size[0] / 2, size[1] / 2
    if shape == "rectangle":
        rim = [(-width, -height), (width, -height), (width, height), (-width, height)]
    else:
        turns = [math.tau * step / 24 for step in range(24)]
        rim = [(width * math.cos(turn), height * math.sin(turn)) for turn in turns]
    return [(x, y, 0.0) for x, y in rim], [], [list(range(len(rim)))[::-1]]

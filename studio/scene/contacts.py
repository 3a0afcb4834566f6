"""Contacts: objects that press on the sensing surface, drawn at their place and depth."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import bmesh
import bpy
import numpy as np
from mathutils import Matrix, Vector
from mathutils.bvhtree import BVHTree

from ..core.mesh_file import Mesh
from ..core.numbers import short
from .collections import CONTACTS, collection, next_order, objects_of
from .meshes import drawn_mesh, mesh_of
from .paths import absolute

COLOUR = (0.48, 0.37, 0.07, 1.0)
"""Colour of contacts in the 3D view (red, green, blue, alpha, 0 to 1); no part has it."""

file_meshes: dict[str, Mesh] = {}
"""Known meshes of indenter files by path, in the files' own units."""

when_file_unknown: list[Callable[[str], None]] = []
"""Callbacks with the path of an indenter's file whose mesh has to be drawn and is not known."""


def add_contact(
    scene: bpy.types.Scene, point: tuple[float, float, float], outward: tuple[float, float, float]
) -> bpy.types.Object:
    """Add an object for a ball that presses at a point of the sensing surface.

    It stays on the surface when it is moved.

    Args:
        point: point of contact, (3,) mm.
        outward: normal of the surface, (3,), out of the sensor.
    """
    contact = bpy.data.objects.new("contact", bpy.data.meshes.new("contact"))
    values = contact.optisense
    values.order = next_order(scene, "CONTACT")
    values.kind = "CONTACT"
    contact.color = COLOUR
    # Its rotation follows the surface, and its size its own properties.
    contact.lock_rotation = contact.lock_scale = (True, True, True)
    turn = Vector(outward).to_track_quat("Z", "Y").to_matrix().to_4x4()
    contact.matrix_world = Matrix.Translation(point) @ turn
    collection(scene, CONTACTS).objects.link(contact)
    stay_on_surface(scene, contact)
    redraw(contact)
    return contact


def stay_on_surface(scene: bpy.types.Scene, contact: bpy.types.Object) -> None:
    """Constrain a contact to the nearest point of the scene's present sensing surface."""
    contact.constraints.clear()
    surface = sensing_surface(scene)
    if surface is not None:
        stay = contact.constraints.new("SHRINKWRAP")
        stay.name = "On the sensing surface"
        stay.target = surface
        stay.shrinkwrap_type = "NEAREST_SURFACE"
        stay.use_track_normal = True
        stay.track_axis = "TRACK_NEGATIVE_Z"  # the surface's normals point inward


def hold_contacts(scene: bpy.types.Scene) -> None:
    """Constrain all contacts to the scene's present sensing surface."""
    for contact in objects_of(scene, "CONTACT"):
        stay_on_surface(scene, contact)


def sensing_surface(scene: bpy.types.Scene) -> bpy.types.Object | None:
    """Return the object of the sensing surface, or None."""
    parts = objects_of(scene, "PART")
    return next((each for each in parts if each.optisense.role == "sensing_surface"), None)


def tree_of(surface: bpy.types.Object) -> BVHTree:
    """Return the faces of a part for the search of points on it, in the frame of the design.

    Blender's own search fails for parts that it does not evaluate.
    """
    mesh = drawn_mesh(surface)
    return BVHTree.FromPolygons(mesh.vertices.tolist(), mesh.faces.tolist())


def redraw(contact: bpy.types.Object) -> None:
    """Draw the indenter: its z axis points outward, and its lowest point lies at -depth."""
    values = contact.optisense
    if values.kind != "CONTACT" or not isinstance(contact.data, bpy.types.Mesh):
        return
    shape = drawing(values)
    shape.to_mesh(contact.data)
    shape.free()
    contact.data.shade_smooth()
    contact.data.update()


def drawing(values: bpy.types.PropertyGroup) -> bmesh.types.BMesh:
    """Return the shape with which a contact is drawn, in its own frame; empty if its file is not
    known yet, which is then asked for.
    """
    shape = bmesh.new()
    down = Matrix.Translation((0.0, 0.0, -values.depth))
    if values.indenter == "sphere":
        at = down @ Matrix.Translation((0.0, 0.0, values.radius))
        bmesh.ops.create_icosphere(shape, subdivisions=4, radius=values.radius, matrix=at)
    elif values.indenter == "cylinder":
        lying = Matrix.Rotation(math.pi / 2, 4, "Y")
        at = down @ Matrix.Translation((0.0, 0.0, values.radius)) @ lying
        bmesh.ops.create_cone(
            shape, cap_ends=True, segments=48, radius1=values.radius, radius2=values.radius,
            depth=values.length, matrix=at,
        )  # fmt: skip
    elif values.indenter == "plane":
        about_x, about_y = (
            Matrix.Rotation(math.radians(angle), 4, axis)
            for angle, axis in zip(values.tilt, "XY", strict=True)
        )
        tilt = about_y @ about_x
        bmesh.ops.create_grid(shape, x_segments=1, y_segments=1, size=values.size / 2, matrix=tilt)
        lowest = min((vertex.co.z for vertex in shape.verts), default=0.0)
        bmesh.ops.translate(shape, verts=shape.verts, vec=(0.0, 0.0, -lowest - values.depth))
    elif values.file:
        file = absolute_file(values)
        if file in file_meshes:
            _add_file_mesh(shape, file_meshes[file], values.scale, values.depth)
        else:
            for each in when_file_unknown:
                each(file)
    elif values.shape is not None:
        _add_file_mesh(shape, mesh_of(values.shape), values.scale, values.depth)
    bmesh.ops.rotate(
        shape, verts=shape.verts, cent=(0.0, 0.0, 0.0),
        matrix=Matrix.Rotation(math.radians(values.rotation), 3, "Z"),
    )  # fmt: skip
    return shape


def absolute_file(values: bpy.types.PropertyGroup) -> str:
    """Return the absolute path of a contact's mesh file."""
    return str(absolute(values.file))


def _add_file_mesh(shape: bmesh.types.BMesh, mesh: Mesh, scale: float, depth: float) -> None:
    """Add the mesh of a file as the engine presses it: the middle of its lowest points lies at the
    place of the contact.
    """
    points = np.asarray(mesh.vertices) * scale
    bottom = points[:, 2].min()
    lowest = points[points[:, 2] <= bottom + 1e-6 * np.ptp(points, axis=0).max()]
    middle = (lowest.min(axis=0) + lowest.max(axis=0)) / 2
    corners = [
        shape.verts.new(point) for point in (points - [*middle[:2], bottom + depth]).tolist()
    ]
    for face in np.asarray(mesh.faces).tolist():
        three = [corners[each] for each in face]
        if len(set(face)) == 3 and shape.faces.get(three) is None:
            shape.faces.new(three)


def contact_values(
    contact: bpy.types.Object, depsgraph: bpy.types.Depsgraph, write: Callable[[Mesh], str]
) -> dict[str, Any]:
    """Return a contact as the engine reads it.

    Args:
        depsgraph: evaluated dependency graph, for the pose on the surface.
        write: function that returns the path of a file with the given mesh.
    """
    values = contact.optisense
    held = contact.evaluated_get(depsgraph).matrix_world
    place = held.translation
    indenter: dict[str, Any] = {"kind": values.indenter}
    if values.indenter == "sphere":
        indenter["radius"] = short(values.radius)
    elif values.indenter == "cylinder":
        indenter.update(radius=short(values.radius), length=short(values.length))
    elif values.indenter == "plane":
        indenter.update(
            tilt_x=short(values.tilt[0]), tilt_y=short(values.tilt[1]), size=short(values.size)
        )
    else:
        own = values.shape is not None and not values.file
        file = write(mesh_of(values.shape)) if own else absolute_file(values)
        indenter.update(file=file, scale=short(values.scale))
    given: dict[str, Any] = {}
    if values.press_by == "FORCE":
        given["force"] = short(values.force)
    if any(values.shift):
        given["shift"] = [short(value) for value in values.shift]
    if values.twist:
        given["twist"] = short(values.twist)
    return {
        **given,
        "indenter": indenter,
        "point": [round(short(value), 6) + 0.0 for value in place],
        "depth": short(values.depth),
        "rotation": short(values.rotation),
        "along": [round(short(value), 6) + 0.0 for value in held.col[0][:3]],
    }


def pressing(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Return the visible contacts in the order in which the engine receives them."""
    return [each for each in objects_of(scene, "CONTACT") if each.visible_get()]


def contact_list(
    scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph, write: Callable[[Mesh], str]
) -> list[dict[str, Any]]:
    """Return the values of all visible contacts, as `contact_values`."""
    return [contact_values(each, depsgraph, write) for each in pressing(scene)]

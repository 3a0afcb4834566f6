"""Meshes of parts in Blender: the drawn shape, and the shape at rest in full precision."""

from __future__ import annotations

import math

import bpy
import numpy as np
from mathutils import Matrix
from numpy.typing import ArrayLike, NDArray

from ..core.errors import SceneError
from ..core.mesh_file import Mesh
from ..core.numbers import joined, kept_array, split
from .world import is_evaluated, world_matrix

SHARP = math.radians(30.0)
"""Smallest angle in radians between two faces for which their common edge is sharp; a cylinder of
13 sides or more is shaded round.
"""

REST = "optisense_rest"
NORMAL = "optisense_normal"


def new_mesh(name: str, mesh: Mesh) -> bpy.types.Mesh:
    """Create a Blender mesh that shows a mesh at rest and stores it exactly."""
    made = bpy.data.meshes.new(name)
    made.from_pydata(mesh.vertices.tolist(), [], mesh.faces.tolist(), shade_flat=False)
    remember(made, REST, mesh.vertices)
    if mesh.normals is not None:
        remember(made, NORMAL, mesh.normals)
    made.update()
    made.set_sharp_from_angle(angle=SHARP)
    return made


def remember(mesh: bpy.types.Mesh, name: str, values: ArrayLike) -> None:
    """Store numbers (n, 3) at the vertices exactly; undo and .blend files keep them.

    Vertices that Blender adds later have zeros, also in the attribute that marks known ones.
    """
    known = mesh.attributes.get(f"{name}_known")
    if known is None:
        known = mesh.attributes.new(f"{name}_known", "FLOAT", "POINT")
    known.data.foreach_set("value", np.ones(len(mesh.vertices), dtype=np.float32))
    for number, part in enumerate(split(values)):
        attribute = mesh.attributes.get(f"{name}_{number}")
        if attribute is None:
            attribute = mesh.attributes.new(f"{name}_{number}", "FLOAT_VECTOR", "POINT")
        attribute.data.foreach_set("vector", part.ravel())


def remembered(mesh: bpy.types.Mesh, name: str) -> NDArray[np.float64] | None:
    """Return the numbers that `remember` stored, not-a-number for vertices that were added since;
    None if no numbers are stored.

    Meshes in .blend files of earlier versions have no marks: all their vertices count as known.
    """
    parts = []
    for number in range(3):
        attribute = mesh.attributes.get(f"{name}_{number}")
        if attribute is None or len(attribute.data) != len(mesh.vertices):
            return None
        values = np.empty(3 * len(mesh.vertices), dtype=np.float32)
        attribute.data.foreach_get("vector", values)
        parts.append(values.reshape(-1, 3))
    found = joined(parts)
    attribute = mesh.attributes.get(f"{name}_known")
    if attribute is not None and len(attribute.data) == len(mesh.vertices):
        known = np.empty(len(mesh.vertices), dtype=np.float32)
        attribute.data.foreach_get("value", known)
        found[known < 0.5] = np.nan  # marks of new vertices between others are interpolated
    return found


def rest_shape(mesh: bpy.types.Mesh) -> NDArray[np.float64] | None:
    """Return the vertices of a part at rest, (n, 3) mm; None if not all are known, because some
    were added in Blender.
    """
    rest = remembered(mesh, REST)
    return None if rest is None or np.isnan(rest).any() else rest


def shown_vertices(mesh: bpy.types.Mesh) -> NDArray[np.float32]:
    """Return the drawn positions of the vertices, (n, 3) in mm."""
    values = np.empty(3 * len(mesh.vertices), dtype=np.float32)
    # Attributes are read as one block, a hundred times as fast as vertex by vertex.
    stored = mesh.attributes.get("position")
    if stored is not None and len(stored.data) == len(mesh.vertices):
        stored.data.foreach_get("vector", values)
    else:
        mesh.vertices.foreach_get("co", values)
    return values.reshape(-1, 3)


def corners_of(mesh: bpy.types.Mesh) -> NDArray[np.int32]:
    """Return the index of the vertex at each corner of the faces, (m,), face after face."""
    values = np.empty(len(mesh.loops), dtype=np.int32)
    stored = mesh.attributes.get(".corner_vert")
    if stored is not None and len(stored.data) == len(mesh.loops):
        stored.data.foreach_get("value", values)
    else:
        mesh.loops.foreach_get("vertex_index", values)
    return values


def show_vertices(mesh: bpy.types.Mesh, vertices: ArrayLike) -> None:
    """Move the drawn vertices to other positions (n, 3), mm."""
    flat = np.ascontiguousarray(vertices, dtype=np.float32).ravel()
    mesh.attributes["position"].data.foreach_set("vector", flat)
    mesh.update()


def mesh_of(mesh: bpy.types.Mesh) -> Mesh:
    """Return a Blender mesh as triangles; positions as `new_mesh` set them have full precision."""
    return Mesh(kept_array(remembered(mesh, REST), shown_vertices(mesh)), _triangles(mesh))


def part_mesh(part: bpy.types.Object, *, caged: bool) -> Mesh:
    """Return the mesh of a part at rest, in the frame of the design.

    Args:
        caged: whether a cage deforms the part, so that its drawn shape is not that at rest.

    Raises:
        SceneError: the part has modifiers that Blender does not evaluate, or its shape at rest is
            not known.
    """
    if part.mode == "EDIT":
        part.update_from_editmode()
    world = np.array(world_matrix(part), dtype=np.float64)
    if part.modifiers and not caged:
        return _placed(_modified(part), world)
    data = part.data
    at_rest = caged and len(data.vertices) > 0  # an empty mesh has no shape at rest
    if at_rest and rest_shape(data) is None:
        raise SceneError(f"{added(part.optisense.key)}. {KEEP_OR_UNDO}", "parts")
    rest = remembered(data, REST)
    vertices = rest if at_rest else kept_array(rest, shown_vertices(data))
    normals = remembered(data, NORMAL)
    if normals is not None and (rest is None or not np.array_equal(vertices, rest)):
        normals = None
    return _placed(Mesh(vertices, _triangles(data), normals), world)


def added(name: str) -> str:
    """Return the message about a part in a cage that has vertices without a place at rest."""
    return f"part '{name}' got new vertices in its cage, so that its shape at rest is not known"


KEEP_OR_UNDO = "Undo that, or remove the cage: the part then keeps its drawn shape"
"""What to do about a part whose shape at rest is not known."""


def drawn_mesh(part: bpy.types.Object) -> Mesh:
    """Return a part as it is drawn, in the frame of the design; without its modifiers while Blender
    does not evaluate it.
    """
    modified = part.modifiers and is_evaluated(part)
    mesh = _modified(part) if modified else mesh_of(part.data)
    return _placed(mesh, np.array(world_matrix(part), dtype=np.float64))


def settle(part: bpy.types.Object) -> Mesh:
    """Make the present shape of a part in no cage, as it was edited, moved and modified, its shape
    at rest; return it in the frame of the design, where its object then stays.

    Modifiers, constraints and the parent are removed; children keep their places.

    Raises:
        SceneError: the part has modifiers that Blender does not evaluate.
    """
    mesh, world, before = part_mesh(part, caged=False), world_matrix(part), part.data
    rest = remembered(before, REST)
    if world == Matrix() and rest is not None and np.array_equal(mesh.vertices, rest):
        return mesh
    part.data = new_mesh(before.name, mesh)
    part.modifiers.clear()
    part.constraints.clear()
    part.parent = None
    part.matrix_world = Matrix()
    for child in part.children:
        child.matrix_parent_inverse = world @ child.matrix_parent_inverse
    if before.users == 0:
        name = before.name
        bpy.data.meshes.remove(before)
        part.data.name = name
    return mesh


def _modified(part: bpy.types.Object) -> Mesh:
    """Return a part as its modifiers shape it, in its own frame.

    Raises:
        SceneError: the part has modifiers that Blender does not evaluate.
    """
    if not is_evaluated(part):
        raise SceneError(
            f"part '{part.name}' has modifiers, which Blender does not evaluate while the part is "
            "disabled in viewports or its collection is excluded; enable it, or apply them",
            "parts",
        )
    shown = part.evaluated_get(bpy.context.evaluated_depsgraph_get())
    data = shown.to_mesh()
    mesh = Mesh(shown_vertices(data).astype(np.float64), _triangles(data))
    shown.to_mesh_clear()
    return mesh


def _placed(mesh: Mesh, world: NDArray[np.float64]) -> Mesh:
    """Transform a mesh by the matrix of its object; faces of a mirrored one are reversed, so that
    they still face outward.
    """
    if np.array_equal(world, np.eye(4)):
        return mesh
    mirrored = np.linalg.det(world[:3, :3]) < 0.0
    faces = np.ascontiguousarray(mesh.faces[:, ::-1]) if mirrored else mesh.faces
    return Mesh(mesh.vertices @ world[:3, :3].T + world[:3, 3], faces)


def _triangles(mesh: bpy.types.Mesh) -> NDArray[np.int32]:
    if all(polygon.loop_total == 3 for polygon in mesh.polygons):
        return corners_of(mesh).reshape(-1, 3)
    mesh.calc_loop_triangles()
    corners = np.empty(3 * len(mesh.loop_triangles), dtype=np.int32)
    mesh.loop_triangles.foreach_get("vertices", corners)
    return corners.reshape(-1, 3)

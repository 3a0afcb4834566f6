"""Matrices of objects in the world, also of objects that Blender does not evaluate."""

from __future__ import annotations

import bpy
from mathutils import Matrix


def is_evaluated(item: bpy.types.Object) -> bool:
    """Return whether Blender evaluates an object in the present view layer: not if it is disabled
    in viewports, by itself or with a collection, or if its collection is excluded.
    """
    layer = bpy.context.view_layer
    graph = None if layer is None else layer.depsgraph
    return graph is not None and item.evaluated_get(graph).is_evaluated


def world_matrix(item: bpy.types.Object) -> Matrix:
    """Return the matrix of an object in the world, (4, 4), mm.

    `matrix_world` of an object that is not evaluated is that of its last evaluation, and the
    identity after a file was opened. Its matrix is that of its parents and its own properties;
    constraints have no effect on it.
    """
    if is_evaluated(item):
        return item.matrix_world.copy()
    own = item.matrix_basis.copy()
    if item.parent is None:
        return own
    return world_matrix(item.parent) @ item.matrix_parent_inverse @ own

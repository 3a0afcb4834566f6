"""Objects that are drawn in another place or shape than they are simulated in."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from . import cages
from .collections import objects_of
from .contacts import absolute_file, drawing, file_meshes, pressing
from .lamps import lamp_drawing, window
from .meshes import shown_vertices
from .world import world_matrix

SAME_SCALE = 1e-4
"""Largest difference between a scale and 1 that counts as equal: the rounding of matrices."""

SAME_BOX = 1e-3
"""Largest distance in mm between bounds of a drawing that count as equal: rounding, and the depth
that a force gives, which is drawn to this precision.
"""

HINT = "Undo that: set the scale to 1, and move the object in object mode, without Apply (Ctrl A)"
"""What to do about a lamp or contact that is drawn otherwise than it is simulated."""


def ignored_edits(scene: bpy.types.Scene) -> list[dict[str, Any]]:
    """Return a problem, in the form of the engine's, for each object with an edit that the picture
    ignores: cages and parts in them (see `cages.ignored_edits`), and lamps and contacts that are
    scaled or whose meshes were moved.
    """
    found = [p for cage in objects_of(scene, "CAGE") for p in cages.ignored_edits(scene, cage)]
    for group in scene.optisense.light_groups:
        # The size of a lamp is not known before the engine has answered.
        expected = np.array(lamp_drawing(*window(group)[:2])[0]) if group.drawn else None
        lamps = [e for e in objects_of(scene, "LIGHT") if e.optisense.group == group.name]
        for number, lamp in enumerate(lamps):
            message = _message(lamp, "light", expected)
            if message:
                path = f"lights.{group.name}.lights[{number}]"
                found.append(cages.warning(message, HINT, path=path))
    for number, contact in enumerate(pressing(scene)):
        message = _message(contact, "contact", _expected(contact.optisense))
        if message:
            found.append({**cages.warning(message, HINT), "contact": number})
    return found


def _expected(values: bpy.types.PropertyGroup) -> NDArray[np.float64] | None:
    """Return the vertices, (n, 3) mm, that a contact should have; None if they are not known."""
    if values.indenter == "mesh" and values.file and absolute_file(values) not in file_meshes:
        return None
    shape = drawing(values)
    vertices = np.array([vertex.co for vertex in shape.verts]).reshape(-1, 3)
    shape.free()
    return vertices


def _message(item: bpy.types.Object, what: str, expected: NDArray[np.float64] | None) -> str:
    """Return how an object is drawn otherwise than it is simulated; empty if it is not.

    Args:
        what: kind of object, in words.
        expected: vertices, (n, 3) mm, that its mesh should have, of which the bounds are compared;
            None if they are not known.
    """
    scale = np.linalg.norm(np.array(world_matrix(item))[:3, :3], axis=0)
    if np.abs(scale - 1.0).max() > SAME_SCALE:
        return f"{what} '{item.name}' is scaled, which does not change its size in the picture"
    if expected is None or not len(expected) or not isinstance(item.data, bpy.types.Mesh):
        return ""
    shown = shown_vertices(item.data)
    if len(shown) and np.abs(_box(shown) - _box(expected)).max() < SAME_BOX:
        return ""
    return f"{what} '{item.name}' is drawn in another place or shape than it is simulated in"


def _box(vertices: NDArray[Any]) -> NDArray[Any]:
    return np.array([vertices.min(axis=0), vertices.max(axis=0)])

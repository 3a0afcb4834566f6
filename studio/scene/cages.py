"""Cages as meshes of control points; the parts in them follow while points are moved."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import bmesh
import bpy
import numpy as np
from numpy.typing import NDArray

from ..core import cage as core
from ..core.errors import SceneError
from ..core.numbers import kept, kept_array
from .collections import CAGES, collection, next_order, object_of, objects_of
from .meshes import KEEP_OR_UNDO, added, rest_shape, show_vertices, shown_vertices
from .world import world_matrix

MOST_KEPT = 32
"""Number of cages whose weights are cached, so that bending one again needs no new ones."""
SAME_SHAPE = 1e-3
"""Largest distance in mm between a drawn vertex and its place in the cage that counts as equal: the
rounding of positions and weights in single precision, for sensors of up to a metre.
"""

SAME_FRAME = 1e-5
"""Largest difference between elements of two matrices that count as equal (mm, or mm per mm): the
rounding of an object's matrix under a parent. It moves a point 100 mm away by `SAME_SHAPE`.
"""

_weights: dict[tuple[bytes, bytes, tuple[int, int, int]], NDArray[np.float32]] = {}

when_bent: list[Callable[[], None]] = []
"""Callbacks for parts that took the shape of their cage."""


def add_cage(scene: bpy.types.Scene, key: str, values: dict[str, Any]) -> bpy.types.Object:
    """Add an object for a cage; its parts follow it.

    Args:
        key: name of the cage in the design.
        values: cage as in the design file.
    """
    points = current_points(values)
    mesh = bpy.data.meshes.new(f"cage {key}")
    resolution = tuple(values["resolution"])
    mesh.from_pydata(points.tolist(), core.edges(resolution).tolist(), [])
    cage = bpy.data.objects.new(f"cage {key}", mesh)
    cage.optisense.key = key
    cage.optisense.order = next_order(scene, "CAGE")
    cage.optisense.data = json.dumps(values)
    if isinstance(values.get("blend"), (int, float)):
        cage.optisense.blend = values["blend"]
    cage.optisense.kind = "CAGE"
    cage.show_in_front = True
    cage.lock_location = cage.lock_rotation = cage.lock_scale = (True, True, True)
    collection(scene, CAGES).objects.link(cage)
    for name in values["parts"]:
        part = object_of(scene, "PART", name)
        if part is not None:
            lock(part, True)
    follow(scene, cage)
    return cage


def lock(part: bpy.types.Object, locked: bool) -> None:
    """Lock or unlock a part: a part in a cage is shaped by the cage, and not moved by itself."""
    part.lock_location = part.lock_rotation = part.lock_scale = (locked,) * 3
    part.optisense.is_caged = locked


def cage_around(scene: bpy.types.Scene, part: bpy.types.Object) -> bpy.types.Object | None:
    """Return the cage that a part is in; None for a part in no cage."""
    key = part.optisense.key
    return next((c for c in objects_of(scene, "CAGE") if key in cage_data(c)["parts"]), None)


def join_cage(scene: bpy.types.Scene, cage: bpy.types.Object, part: bpy.types.Object) -> None:
    """Put another part, which is at rest and lies inside the box of a cage, into the cage."""
    values = cage_data(cage)
    if part.optisense.key not in values["parts"]:
        values["parts"].append(part.optisense.key)
        cage.optisense.data = json.dumps(values)
    lock(part, True)
    follow(scene, cage)


def release(scene: bpy.types.Scene) -> None:
    """Unlock parts whose cage was deleted, and copies of parts, which are in no cage."""
    cages = objects_of(scene, "CAGE")
    bent = {name for cage in cages for name in cage_data(cage)["parts"]}
    for part in objects_of(scene, "PART"):
        if part.optisense.is_caged and part.optisense.key not in bent:
            lock(part, False)


def cage_data(cage: bpy.types.Object) -> dict[str, Any]:
    """Return the cage as it was read from the file, or last set by an operator."""
    values: dict[str, Any] = json.loads(cage.optisense.data)
    return values


def current_points(values: dict[str, Any]) -> NDArray[np.float64]:
    """Return the positions of a cage's control points, (N, 3) mm."""
    blend = values.get("blend")
    if blend is None:
        return as_array(values["points"])
    share = as_array(blend) if isinstance(blend, list) else blend
    return core.blended(as_array(values["c_min"]), as_array(values["c_max"]), share)


def as_array(points: list[dict[str, float]]) -> NDArray[np.float64]:
    """Convert a list of points of the design file to an array, (N, 3)."""
    return np.array([(p["x"], p["y"], p["z"]) for p in points], dtype=np.float64).reshape(-1, 3)


def as_points(array: NDArray[np.float64]) -> list[dict[str, float]]:
    """Convert an array of points, (N, 3), to a list for the design file."""
    return [{"x": x, "y": y, "z": z} for x, y, z in array.tolist()]


def shown_points(cage: bpy.types.Object) -> NDArray[np.float32]:
    """Return the control points as drawn, (N, 3) mm, also while they are being edited."""
    if cage.mode == "EDIT":
        mesh = bmesh.from_edit_mesh(cage.data)
        return np.array([vertex.co for vertex in mesh.verts], dtype=np.float32).reshape(-1, 3)
    return shown_vertices(cage.data)


def cage_values(cage: bpy.types.Object) -> dict[str, Any]:
    """Return the cage as for the design file, with its present control points.

    Raises:
        SceneError: control points were added or removed.
    """
    values = cage_data(cage)
    shown = shown_points(cage)
    before = current_points(values)
    if len(shown) != len(before):
        key = cage.optisense.key
        raise SceneError(
            f"cage '{key}' has {len(shown)} control points instead of {len(before)}; undo what "
            "added or removed some",
            f"cages.{key}",
        )
    if values.get("blend") is not None:
        blend = values["blend"]
        if not isinstance(blend, list):
            values["blend"] = kept(blend, cage.optisense.blend)
        if np.allclose(shown, current_points(values), rtol=1e-6, atol=1e-5):
            return values
        del values["blend"]
    values["points"] = as_points(kept_array(before, shown))
    return values


def show_blend(cage: bpy.types.Object) -> None:
    """Draw a cage with bounds at its present blend, and let its parts follow."""
    if cage.optisense.kind != "CAGE":
        return
    values = cage_data(cage)
    if values.get("c_min") is None or values.get("c_max") is None:
        return
    values["blend"] = kept(values.get("blend"), cage.optisense.blend)
    values.pop("points", None)
    cage.optisense.data = json.dumps(values)
    set_points(cage, current_points(values))
    for scene in cage.users_scene:
        follow(scene, cage)


def set_points(cage: bpy.types.Object, points: NDArray[np.float64]) -> None:
    """Move the control points, in object mode or while they are being edited."""
    if cage.mode == "EDIT":
        mesh = bmesh.from_edit_mesh(cage.data)
        for vertex, point in zip(mesh.verts, points, strict=True):
            vertex.co = point
        bmesh.update_edit_mesh(cage.data)
    else:
        show_vertices(cage.data, points)


def follow(scene: bpy.types.Scene, cage: bpy.types.Object) -> None:
    """Deform the parts of a cage according to its control points."""
    values = cage_data(cage)
    points = shown_points(cage)
    resolution = tuple(values["resolution"])
    if len(points) != np.prod(resolution):
        return
    for name in values["parts"]:
        part = object_of(scene, "PART", name)
        rest = None if part is None else rest_shape(part.data)
        if part is None or rest is None or part.mode == "EDIT":
            continue
        try:
            weights = _kept_weights(rest, np.array(values["box"]), resolution)
        except ValueError:  # The engine's check reports the error in words.
            continue
        show_vertices(part.data, weights @ points)
    for each in when_bent:
        each()


def ignored_edits(scene: bpy.types.Scene, cage: bpy.types.Object) -> list[dict[str, Any]]:
    """Return a problem, in the form of the engine's, for a cage that was moved as an object, and
    for each of its parts that is drawn in another place or shape than the cage gives it.

    Such parts were moved, their vertices were edited, or they have modifiers.
    """
    values, points, key = cage_data(cage), shown_points(cage), cage.optisense.key
    resolution = tuple(values["resolution"])
    found = []
    if not _is_in_place(cage):
        message = f"cage '{key}' was moved, turned or scaled as an object; its parts ignore that"
        hint = "Undo that, and move its control points in Edit Shape"
        found.append(warning(message, hint, path=f"cages.{key}"))
    for name in values["parts"]:
        part = object_of(scene, "PART", name)
        if part is None:
            continue
        if not _is_in_place(part):
            message = (
                f"part '{name}' was moved, turned or scaled in its cage, which bends it as if it "
                "had been moved before"
            )
            hint = "Undo that; or remove the cage, move the part, and create the cage again"
            found.append(warning(message, hint, part=name))
        if part.mode == "EDIT" or len(points) != np.prod(resolution):
            continue
        if rest_shape(part.data) is None:
            found.append(warning(added(name), KEEP_OR_UNDO, part=name))
        elif part.modifiers or not _is_bent(part, np.array(values["box"]), resolution, points):
            message = f"part '{name}' was edited by hand, or has modifiers; its cage ignores that"
            hint = "Remove the cage, edit the part, and create the cage again"
            found.append(warning(message, hint, part=name))
    return found


def warning(message: str, hint: str, *, path: str = "", part: str = "") -> dict[str, Any]:
    """Return a warning in the form of the engine's."""
    return {"severity": "warning", "message": message, "hint": hint, "path": path, "part": part}


def _is_in_place(item: bpy.types.Object) -> bool:
    """Return whether the frame of an object is that of the design, as of all parts in cages."""
    return bool(np.abs(np.array(world_matrix(item)) - np.eye(4)).max() < SAME_FRAME)


def _is_bent(
    part: bpy.types.Object,
    box: NDArray[np.float64],
    resolution: tuple[int, int, int],
    points: NDArray[np.float32],
) -> bool:
    """Return whether a part has the shape that its cage gives it, as far as that is known."""
    rest = rest_shape(part.data)
    if rest is None or not len(rest):
        return True
    try:
        weights = _kept_weights(rest, box, resolution)
    except ValueError:  # The engine's check reports the error in words.
        return True
    return bool(np.abs(weights @ points - shown_vertices(part.data)).max() < SAME_SHAPE)


def _kept_weights(
    rest: NDArray[np.float64], box: NDArray[np.float64], resolution: tuple[int, int, int]
) -> NDArray[np.float32]:
    key = (rest.tobytes(), box.tobytes(), resolution)
    if key not in _weights:
        while len(_weights) >= MOST_KEPT:
            _weights.pop(next(iter(_weights)))
        _weights[key] = core.weights(rest, box, resolution).astype(np.float32)
    return _weights[key]


@bpy.app.handlers.persistent
def _moved(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    changed = {
        update.id.original.name
        for update in depsgraph.updates
        if update.is_updated_geometry and isinstance(update.id, bpy.types.Object)
    }
    if changed:
        for cage in objects_of(scene, "CAGE"):
            if cage.name in changed:
                follow(scene, cage)
    show_idle(scene)


def show_idle(scene: bpy.types.Scene) -> None:
    """Show and make selectable only the cage that is in use: others would hide the lights.

    A cage is in use if it is active or selected, or contains the active part; others are drawn as
    boxes.
    """
    layer = bpy.context.view_layer
    active = None if layer is None else layer.objects.active
    for cage in objects_of(scene, "CAGE"):
        own = active is not None and active.optisense
        inside = own and own.kind == "PART" and own.key in cage_data(cage)["parts"]
        at_work = cage == active or inside or (layer is not None and cage.select_get())
        look = "TEXTURED" if at_work else "BOUNDS"
        if cage.display_type != look:
            cage.display_type = look
            cage.hide_select = not at_work


@bpy.app.handlers.persistent
def _undone(*_: Any) -> None:
    for cage in objects_of(bpy.context.scene, "CAGE"):
        follow(bpy.context.scene, cage)


HOOKS = (
    (bpy.app.handlers.depsgraph_update_post, _moved),
    (bpy.app.handlers.undo_post, _undone),
    (bpy.app.handlers.redo_post, _undone),
)


def unregister() -> None:
    _weights.clear()

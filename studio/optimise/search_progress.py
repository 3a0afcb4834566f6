"""Progress of a running search in the panel and the viewport."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..core.errors import SceneError
from ..core.search_parameters import curve_picture
from ..engine import session
from ..scene.collections import collection, object_of, objects_of
from ..scene.kinds import GHOST
from ..scene.meshes import part_mesh
from ..scene.subject import scene_of
from ..simulate import picture

CURVE = "OptiSense search"
CURVE_SIZE = (220, 150)
"""Width and height of the picture of a search's curve, pixels; as wide as the sidebar."""
GHOSTS = "Best so far"
COLOUR = (0.1, 0.85, 0.95, 0.4)
"""Colour (red, green, blue, opacity) of ghosts, the transparent parts of the best design; no light,
part or outline has it."""

SAME_PLACE = 1e-3
"""Distance in mm below which a vertex counts as unmoved and is not drawn."""


_curve: dict[int, float | None] = {}
"""Score of each trial by its number; trials may be reported twice."""


def begin(scene: bpy.types.Scene) -> None:
    """Clear the results of the search before; those that come are of a scene's sensor."""
    _curve.clear()
    found = bpy.context.window_manager.optisense_found
    found.scene = scene.session_uid
    found.best = found.values = found.start = found.ended = found.offer = found.conditions = ""
    clear_ghosts(scene)


def take(event: dict[str, Any]) -> None:
    """Handle an event of a search: show a trial that is finished."""
    found = bpy.context.window_manager.optisense_found
    scene = scene_of(found.scene)
    if event.get("event") != "trial" or scene is None:
        return
    scores = event.get("scores") or {}
    objective = scene.optisense_search.objective
    score = scores.get(objective, next(iter(scores.values()), None))
    _curve[event["number"]] = score
    if score is not None and event.get("start"):
        found.start = f"{score:.4g}"
    if score is not None and event.get("best"):
        found.best = f"{score:.4g}"
        found.values = "\n".join(
            f"{name} = {value:.4g}" if isinstance(value, float) else f"{name} = {value}"
            for name, value in list((event.get("values") or {}).items())[:8]
        )
        found.conditions = "\n".join(
            f"{each['condition']}: {each['value']:.4g}"
            for each in event.get("conditions") or []
            if each["value"] is not None
        )
        show_ghosts(scene, event.get("shapes") or {})
    in_order = [_curve[number] for number in sorted(_curve)]
    picture.show_icon(CURVE, curve_picture(in_order, CURVE_SIZE))
    session.redraw()


def take_curve(scene: bpy.types.Scene, rows: list[dict[str, Any]]) -> None:
    """Show all trials of a study of a scene's sensor at once."""
    begin(scene)
    best = None
    for row in rows:
        score = next(iter((row.get("scores") or {}).values()), None)
        allowed = score is not None and row.get("feasible", True)
        better = allowed and (best is None or score > best)
        best = score if better else best
        take({"event": "trial", "best": better, **row})


def show_ghosts(scene: bpy.types.Scene, shapes: dict[str, Any]) -> None:
    """Draw those parts of the best design so far that differ from the scene, transparent."""
    clear_ghosts(scene)
    for name, files in shapes.items():
        vertices, faces = np.load(files["vertices"]), np.load(files["faces"])
        faces = faces[_moved(scene, name, vertices)[faces].any(axis=1)]
        if len(faces) == 0:
            continue
        mesh = bpy.data.meshes.new(f"{GHOST}{name}")
        mesh.from_pydata(vertices.tolist(), [], faces.tolist(), shade_flat=False)
        ghost = bpy.data.objects.new(f"{GHOST}{name}", mesh)
        ghost.optisense.kind = "SHOWN"
        ghost.optisense.key = f"{GHOST}{name}"
        ghost.color = COLOUR
        ghost.show_in_front = True
        ghost.hide_select = True
        collection(scene, GHOSTS).objects.link(ghost)


def _moved(scene: bpy.types.Scene, name: str, vertices: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which vertices of a part lie elsewhere in the scene, (n,) bool."""
    part = object_of(scene, "PART", name)
    if part is None or len(part.data.vertices) != len(vertices):
        return np.ones(len(vertices), dtype=bool)
    try:
        shown = part_mesh(part, caged=False).vertices
    except SceneError:  # the part was disabled during the search
        return np.ones(len(vertices), dtype=bool)
    return np.abs(vertices - shown).max(axis=1) > SAME_PLACE


def clear_ghosts(scene: bpy.types.Scene) -> None:
    """Remove the objects of `show_ghosts`."""
    for each in objects_of(scene, "SHOWN"):
        if each.optisense.key.startswith(GHOST):
            mesh = each.data
            bpy.data.objects.remove(each)
            bpy.data.meshes.remove(mesh)


def has_trials() -> bool:
    """Return whether there is a curve to show."""
    return bool(_curve)


def known_scores() -> list[float]:
    """Return the scores of the trials so far, without failed trials."""
    return [score for score in _curve.values() if score is not None]


def finished(result: dict[str, Any]) -> None:
    """Show that the search is over, and why."""
    found = bpy.context.window_manager.optisense_found
    done = result.get("done")
    why = "stopped" if result.get("interrupted") else result.get("ended") or "finished"
    found.ended = f"{done} trials: {why}"
    scene = scene_of(found.scene)
    if result.get("interrupted") and scene is not None:  # it stays as before the search
        clear_ghosts(scene)
    notes = [str(note) for note in result.get("notes") or []]
    session.state().note = "; ".join(notes)
    session.redraw()


def unregister() -> None:
    _curve.clear()

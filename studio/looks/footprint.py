"""Footprint of the camera on the skin: the visible part is outlined, the rest is drawn in red."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from bpy.props import StringProperty
from numpy.typing import NDArray

from ..core import outlines
from ..core.engine import EngineError
from ..engine import session
from ..engine.latest_request import LatestRequest
from ..scene.collections import is_edited
from ..scene.contacts import sensing_surface
from ..scene.meshes import shown_vertices
from ..scene.world import world_matrix
from . import drawing, section

KINDS = ("PART", "CAMERA", "CAGE")

SEEN, UNSEEN, BORDER = (0.1, 0.8, 0.45, 0.22), (0.9, 0.08, 0.05, 0.45), (0.1, 1.0, 0.5, 1.0)
"""Colours (red, green, blue, opacity) of the visible skin, of the rest, and of the line between."""

LIFT, UNSEEN_LIFT = 0.06, 0.02
"""Distances from the skin in mm at which the visible part and the red are drawn, on both sides: the
former hides the latter, neither is hidden by the skin, and both still seem to lie on it.
"""

BORDER_WIDTH = 2.5
"""Width of the border in pixels: distinguishable from the outlines of parts."""

_shown: dict[str, Any] = {}
"""Footprint that is drawn: `seen` and `border`, arrays of corners (n, 3) in mm, and `of`, the
sensing surface that they belong to.
"""

_request = LatestRequest()


class OPTISENSE_PG_footprint(bpy.types.PropertyGroup):
    """Text about the footprint; never saved."""

    text: StringProperty(
        description="Share of the skin that the camera sees, in words", options={"SKIP_SAVE"}
    )


def is_on(scene: bpy.types.Scene | None) -> bool:
    """Return whether a scene shows the footprint of its camera."""
    return scene is not None and scene.optisense.is_open and scene.optisense_looks.footprint


def wanted() -> None:
    """Schedule a new footprint: something that the camera sees, or the switch, changed."""
    _request.want()
    if not is_on(bpy.context.scene):
        _leave()
        session.redraw()
    elif session.running() is not None:
        _ask()


def _ask() -> None:
    scene = bpy.context.scene
    if not is_on(scene) or not _request.is_due:
        return
    _request.send("footprint", _take, _refused, name="footprint")


def _take(result: dict[str, Any], scene: bpy.types.Scene) -> None:
    if scene != bpy.context.scene or not is_on(scene):
        return
    points, hit = np.load(result["files"]["points"]), np.load(result["files"]["hit"]) > 0
    normals = np.load(result["files"]["normals"]).reshape(-1, 3)
    quads, border = outlines.grid_quads(points, hit)
    flat = points.reshape(-1, 3)
    triangles = quads[:, [0, 1, 2, 0, 2, 3]].ravel()
    surface = sensing_surface(scene)
    _shown["of"] = None if surface is None else surface.as_pointer()
    _shown["seen"] = np.concatenate(
        [(flat + side * LIFT * normals)[triangles] for side in (1.0, -1.0)]
    )
    _shown["border"] = np.concatenate(
        [(flat + side * LIFT * normals)[border.ravel()] for side in (1.0, -1.0)]
    )
    bpy.context.window_manager.optisense_footprint.text = words(result)
    session.redraw()


def is_current(scene: bpy.types.Scene) -> bool:
    """Return whether the known footprint is that of the sensor in a scene, not an earlier one."""
    surface = sensing_surface(scene)
    return surface is not None and _shown.get("of") == surface.as_pointer()


def in_words(scene: bpy.types.Scene) -> str:
    """Return the text about the footprint in a scene; empty if it is outdated."""
    text = str(bpy.context.window_manager.optisense_footprint.text)
    return text if is_current(scene) or not _shown else ""


def words(result: dict[str, Any]) -> str:
    """Return the visible share of the skin in words."""
    skin, picture = 100 * result["skin"], 100 * result["picture"]
    text = f"The camera sees {skin:.0f} % of the skin"
    return text if picture > 99.5 else f"{text}; {picture:.0f} % of its pixels see skin"


def _refused(error: EngineError, scene: bpy.types.Scene) -> None:
    if error.kind in ("Replaced", "Cancelled") or scene != bpy.context.scene or not is_on(scene):
        return
    _shown.clear()
    bpy.context.window_manager.optisense_footprint.text = f"No footprint: {error.message}"
    session.redraw()


def _draw(scene: bpy.types.Scene) -> None:
    if not is_on(scene) or not is_current(scene):
        return
    import gpu

    surface = sensing_surface(scene)
    gpu.state.depth_mask_set(True)  # what is seen hides the red behind it
    _draw_faces(scene, _shown["seen"], SEEN)
    if surface is not None and surface.visible_get():
        skin = skin_triangles(surface)
        shift = UNSEEN_LIFT * np.repeat(outlines.face_normals(skin.reshape(-1, 3, 3)), 3, axis=0)
        for side in (1.0, -1.0):
            _draw_faces(scene, skin + side * shift, UNSEEN)
    border = drawing.cut(scene, _shown["border"], 2)
    drawing.draw_lines(border, BORDER, width=BORDER_WIDTH)
    gpu.state.depth_mask_set(False)


def _draw_faces(
    scene: bpy.types.Scene, corners: NDArray[np.float32], colour: tuple[float, ...]
) -> None:
    corners = drawing.cut(scene, corners, 3)
    drawing.draw_faces(corners, np.tile(np.array(colour, dtype=np.float32), (len(corners), 1)))


def skin_triangles(surface: bpy.types.Object) -> NDArray[np.float32]:
    """Return the corners of the sensing surface's triangles, (3 n, 3) mm in the world."""
    mesh = surface.data
    mesh.calc_loop_triangles()
    corners = np.empty(3 * len(mesh.loop_triangles), dtype=np.int32)
    mesh.loop_triangles.foreach_get("vertices", corners)
    return drawing.in_world(shown_vertices(mesh)[corners], world_matrix(surface))


def _leave() -> None:
    """Remove the footprint."""
    _request.leave()
    _shown.clear()
    bpy.context.window_manager.optisense_footprint.text = ""


@bpy.app.handlers.persistent
def _changed(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    if is_on(scene) and is_edited(depsgraph, *KINDS):
        _request.want()  # asked at the next tick: Blender is in the middle of an edit


@bpy.app.handlers.persistent
def _loaded(*_: Any) -> None:
    _leave()
    wanted()


PROPERTIES = {"WindowManager": {"optisense_footprint": OPTISENSE_PG_footprint}}
HOOKS = (
    (section.when_footprint_asked, wanted),
    (drawing.when_drawing, _draw),
    (session.when_ticking, _ask),
    (session.when_leaving, _leave),
    (bpy.app.handlers.depsgraph_update_post, _changed),
    (bpy.app.handlers.load_post, _loaded),
)


def unregister() -> None:
    _leave()

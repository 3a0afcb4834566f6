"""Outlines of parts, lit lamps and their beams, drawn over the objects of a 3D view."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix, Vector
from numpy.typing import NDArray

from ..core import outlines
from ..scene.collections import objects_of
from ..scene.lamps import lamp_colour, window
from ..scene.meshes import shown_vertices
from ..scene.world import world_matrix
from .section import plane

LINE = (0.62, 0.68, 0.75)
"""Colour of outlines (red, green, blue): as bright as the rims of glass."""

BEAM, WIDEST_BEAM = 3.0, 25.0
"""Largest length in mm and half angle in degrees with which a beam is drawn; larger ones would hide
the sensor.
"""

BEAM_OPACITY, OUTLINE_OPACITY = 0.3, 0.35
"""Opacities, 0 to 1, of a beam at its lamp and of an outline."""

WINDOW_OPACITY = 0.8
"""Opacity of a lit window of a lamp: parts behind it stay visible."""

MOST_FACES = 200_000
"""Number of faces above which a part has no outlines: they would take longer than a frame."""

_edges: dict[str, tuple[tuple[int, int, int], NDArray[np.int64]]] = {}
"""Numbers of vertices, edges and faces of each present part, and the edges of its outline."""

_handle: Any = None

when_drawing: list[Callable[[bpy.types.Scene], None]] = []
"""Callbacks that draw more in a 3D view."""


def outline(part: bpy.types.Object) -> NDArray[np.float32]:
    """Return the ends of the edges to draw of a part, (2 n, 3) mm in the world."""
    mesh = part.data
    size = (len(mesh.vertices), len(mesh.edges), len(mesh.polygons))
    if size[2] == 0 or size[2] > MOST_FACES:
        return np.empty((0, 3), dtype=np.float32)
    kept = _edges.get(part.name)
    if kept is None or kept[0] != size:
        for gone in [name for name in _edges if name not in bpy.data.objects]:
            del _edges[gone]
        kept = _edges[part.name] = (size, _feature_edges(mesh))
    ends = np.empty(2 * size[1], dtype=np.int32)
    mesh.edges.foreach_get("vertices", ends)
    chosen = shown_vertices(mesh)[ends.reshape(-1, 2)[kept[1]].ravel()]
    return in_world(chosen, world_matrix(part))


def _feature_edges(mesh: bpy.types.Mesh) -> NDArray[np.int64]:
    corners = np.empty(len(mesh.loops), dtype=np.int32)
    mesh.loops.foreach_get("edge_index", corners)
    starts = np.empty(len(mesh.polygons), dtype=np.int32)
    mesh.polygons.foreach_get("loop_start", starts)
    normals = np.empty(3 * len(mesh.polygons), dtype=np.float32)
    mesh.polygons.foreach_get("normal", normals)
    return outlines.feature_edges(corners, starts, normals.reshape(-1, 3), len(mesh.edges))


def in_world(points: NDArray[np.float32], matrix: Matrix) -> NDArray[np.float32]:
    """Return points of an object, (n, 3), in the world."""
    world = np.array(matrix, dtype=np.float32)
    return points @ world[:3, :3].T + world[:3, 3]


def _draw() -> None:
    scene = bpy.context.scene
    space = bpy.context.space_data
    if scene is None or not scene.optisense.is_open or not space.overlay.show_overlays:
        return
    import gpu

    gpu.state.depth_test_set("LESS_EQUAL")
    gpu.state.blend_set("ALPHA")
    try:
        for part in objects_of(scene, "PART"):
            if part.visible_get() and part.mode != "EDIT":
                draw_lines(cut(scene, outline(part), 2), (*LINE, OUTLINE_OPACITY))
        gpu.state.depth_mask_set(False)
        for each in when_drawing:
            each(scene)
        _draw_lamps(scene)
    finally:
        gpu.state.depth_mask_set(True)
        gpu.state.depth_test_set("NONE")
        gpu.state.blend_set("NONE")


def _draw_lamps(scene: bpy.types.Scene) -> None:
    """Draw lit windows and beams, all lamps of a group at once."""
    import gpu

    found = plane(scene)
    cut = None if found is None else (Vector(found[:3]), found[3])
    for group in scene.optisense.light_groups:
        lamps = [
            each
            for each in objects_of(scene, "LIGHT")
            if each.optisense.group == group.name
            and each.visible_get()
            and (cut is None or cut[0].dot(world_matrix(each).translation) + cut[1] > 0.0)
        ]
        if not lamps or group.flux <= 0.0:
            continue
        shape, size, angle = window(group)
        sides, left = outlines.beam(shape, size, min(angle, WIDEST_BEAM), BEAM)
        face = outlines.window(shape, size)
        red, green, blue, _ = lamp_colour(group)
        gpu.state.depth_test_set("NONE")  # lamps stand in housings
        places = np.concatenate([in_world(face, world_matrix(each)) for each in lamps])
        lit = np.array(
            [(red, green, blue), (red, green, blue), np.array((red, green, blue)) * 0.4 + 0.6]
        )
        colours = np.column_stack([lit, [WINDOW_OPACITY] * 3])
        draw_faces(places, np.tile(colours, (len(places) // 3, 1)))
        places = np.concatenate([in_world(sides, world_matrix(each)) for each in lamps])
        colours = np.empty((len(places), 4), dtype=np.float32)
        colours[:] = (red, green, blue, BEAM_OPACITY)
        colours[:, 3] *= np.tile(left, len(lamps))
        draw_faces(places, colours)
        gpu.state.depth_test_set("LESS_EQUAL")


def draw_lines(ends: NDArray[np.float32], colour: tuple[float, ...], *, width: float = 1.2) -> None:
    """Draw lines between pairs of points, (2 n, 3) mm, `width` pixels wide."""
    if not len(ends):
        return
    import gpu
    from gpu_extras.batch import batch_for_shader

    shader = gpu.shader.from_builtin("POLYLINE_UNIFORM_COLOR")
    batch = batch_for_shader(shader, "LINES", {"pos": ends.astype(np.float32)})
    shader.bind()
    shader.uniform_float("viewportSize", gpu.state.viewport_get()[2:])
    shader.uniform_float("lineWidth", width)
    shader.uniform_float("color", colour)
    batch.draw(shader)


def draw_faces(corners: NDArray[np.float32], colours: NDArray[np.float32]) -> None:
    """Draw unlit triangles with corners (3 n, 3) in mm and colours (3 n, 4)."""
    if not len(corners):
        return
    import gpu
    from gpu_extras.batch import batch_for_shader

    shader = gpu.shader.from_builtin("SMOOTH_COLOR")
    content = {"pos": corners.astype(np.float32), "color": colours.astype(np.float32)}
    batch = batch_for_shader(shader, "TRIS", content)
    shader.bind()
    batch.draw(shader)


def cut(scene: bpy.types.Scene, corners: NDArray[np.float32], size: int) -> NDArray[np.float32]:
    """Return the lines (`size` 2) or triangles (3) that lie entirely on the shown side of a scene's
    section plane, by their corners (`size` * m, 3).
    """
    found = plane(scene)
    if found is None or not len(corners):
        return corners
    normal, offset = np.array(found[:3]), found[3]
    kept = (corners @ normal + offset > 0.0).reshape(-1, size).all(axis=1)
    return corners.reshape(-1, size, 3)[kept].reshape(-1, 3)


@bpy.app.handlers.persistent
def _forget(*_: Any) -> None:
    _edges.clear()


HOOKS = ((bpy.app.handlers.load_post, _forget),)


def register() -> None:
    global _handle
    if not bpy.app.background:
        _handle = bpy.types.SpaceView3D.draw_handler_add(_draw, (), "WINDOW", "POST_VIEW")


def unregister() -> None:
    global _handle
    if _handle is not None:
        bpy.types.SpaceView3D.draw_handler_remove(_handle, "WINDOW")
    _handle = None
    _edges.clear()

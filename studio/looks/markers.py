"""Markers, the dots printed on the skin: their drawing in 3D views, and their operators."""

from __future__ import annotations

import json
import math
from typing import Any

import bpy
import numpy as np
from bpy.props import FloatProperty, IntProperty
from numpy.typing import NDArray

from ..engine import polls, session
from ..engine.latest_request import LatestRequest
from ..engine.layout import labelled
from ..engine.operators import ChoosingProperties
from ..scene.collections import is_edited
from . import drawing, footprint, section

KINDS = ("PART", "CAGE")

INK = (0.02, 0.02, 0.025, 0.9)
"""Colour of a drawn dot (red, green, blue, opacity): nearly black, as most inks are."""

SIDES = 20
"""Number of corners of a drawn dot: it looks round."""

LIFT = 0.03
"""Distance from the skin (mm) at which dots are drawn on both sides, to be seen."""

_shown: dict[str, Any] = {}
_request = LatestRequest()


def of_design(scene: bpy.types.Scene) -> dict[str, Any] | None:
    """Return the markers of a scene's design as in its file; None if it has none."""
    text = scene.optisense.document
    return json.loads(text).get("markers") if text else None


def is_on(scene: bpy.types.Scene | None) -> bool:
    """Return whether a scene shows markers."""
    return (
        scene is not None
        and scene.optisense.is_open
        and scene.optisense_looks.markers
        and of_design(scene) is not None
    )


def wanted() -> None:
    """Schedule a request for the markers at the next poll: something they depend on changed."""
    _request.want()
    if not is_on(bpy.context.scene):
        _shown.clear()
        session.redraw()


def _ask() -> None:
    if is_on(bpy.context.scene) and _request.is_due:
        _request.send("markers", _take, name="markers")


def _take(result: dict[str, Any], scene: bpy.types.Scene) -> None:
    if scene != bpy.context.scene:
        return
    _shown.clear()
    if result["count"]:
        points = np.load(result["files"]["points"])
        normals = np.load(result["files"]["normals"])
        _shown["corners"] = discs(points, normals, result["radius"])
        surface = footprint.sensing_surface(scene)
        _shown["of"] = None if surface is None else surface.as_pointer()
    session.redraw()


def discs(
    points: NDArray[np.float32], normals: NDArray[np.float32], radius: float
) -> NDArray[np.float32]:
    """Return the corners (3 n, 3), mm, of two-sided triangles that fill discs at points (k, 3)."""
    helper = np.where(np.abs(normals[:, :1]) < 0.9, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    one = np.cross(normals, helper)
    one /= np.maximum(np.linalg.norm(one, axis=1, keepdims=True), 1e-9)
    two = np.cross(normals, one)
    turns = np.linspace(0.0, math.tau, SIDES + 1)
    rim = radius * (np.cos(turns)[:, None, None] * one + np.sin(turns)[:, None, None] * two)
    middle = np.broadcast_to(points, (SIDES, *points.shape))
    flat = np.stack([middle, points + rim[:-1], points + rim[1:]], axis=2)
    lift = LIFT * normals[None, :, None]
    found = np.concatenate([(flat + side * lift).reshape(-1, 3) for side in (1.0, -1.0)])
    return found.astype(np.float32)


def _draw(scene: bpy.types.Scene) -> None:
    surface = footprint.sensing_surface(scene)
    if not is_on(scene) or surface is None or not surface.visible_get():
        return
    if _shown.get("of") == surface.as_pointer():
        corners = drawing.cut(scene, _shown["corners"], 3)
        drawing.draw_faces(corners, np.tile(np.float32(INK), (len(corners), 1)))


class OPTISENSE_OT_set_markers(polls.Designing, ChoosingProperties, bpy.types.Operator):
    """Print a grid of dots on the skin; they move with it, and the picture shows that"""

    bl_idname = "optisense.set_markers"
    bl_label = "Markers"
    bl_options = {"REGISTER", "UNDO"}

    columns: IntProperty(
        name="Columns",
        min=1,
        max=200,
        default=9,
        description="Number of dots along the width of the skin",
    )
    rows: IntProperty(
        name="Rows",
        min=1,
        max=200,
        default=7,
        description="Number of dots along the height of the skin",
    )
    pitch: FloatProperty(
        name="Pitch (mm)", min=0.01, max=1000.0, default=2.0, precision=3,
        description="Distance between the centres of neighbouring dots, mm",
    )  # fmt: skip
    radius: FloatProperty(
        name="Radius (mm)", min=0.001, max=1000.0, default=0.4, precision=3,
        description="Radius of a dot, mm",
    )  # fmt: skip

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        now = of_design(context.scene) or {}
        if now.get("grid"):
            (self.columns, self.rows), self.pitch = now["grid"], now["pitch"]
            self.radius = now["radius"]
        return context.window_manager.invoke_props_dialog(self)

    def draw(self, context: bpy.types.Context) -> None:
        column = labelled(self.layout)
        for name in ("columns", "rows", "pitch", "radius"):
            column.prop(self, name)

    def execute(self, context: bpy.types.Context) -> set[str]:
        now = of_design(context.scene) or {}
        now.pop("places", None)
        grid = {"grid": [self.columns, self.rows], "pitch": round(self.pitch, 4)}
        _set(context.scene, {**now, **grid, "radius": round(self.radius, 4)})
        return {"FINISHED"}


class OPTISENSE_OT_remove_markers(polls.Designing, bpy.types.Operator):
    """Leave the skin without dots"""

    bl_idname = "optisense.remove_markers"
    bl_label = "Remove Markers"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        _set(context.scene, None)
        return {"FINISHED"}


def _set(scene: bpy.types.Scene, values: dict[str, Any] | None) -> None:
    document = json.loads(scene.optisense.document)
    document.pop("markers", None)
    if values is not None:
        document["markers"] = values
    scene.optisense.document = json.dumps(document)
    wanted()


@bpy.app.handlers.persistent
def _changed(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    if not _request.is_wanted and is_on(scene) and is_edited(depsgraph, *KINDS):
        _request.want()


@bpy.app.handlers.persistent
def _again(*_: Any) -> None:
    wanted()


def _leave() -> None:
    _request.leave()
    _shown.clear()


HOOKS = (
    (section.when_markers_asked, wanted),
    (drawing.when_drawing, _draw),
    (session.when_ticking, _ask),
    (session.when_leaving, _leave),
    (bpy.app.handlers.depsgraph_update_post, _changed),
    (bpy.app.handlers.load_post, _again),
    (bpy.app.handlers.undo_post, _again),
    (bpy.app.handlers.redo_post, _again),
)


def unregister() -> None:
    _leave()

"""Section plane that cuts the sensor open in 3D views, moved by one slider."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty
from mathutils import Vector

from ..scene.collections import objects_of
from ..scene.world import world_matrix

AXES = [
    ("X", "x", "Across x"),
    ("Y", "y", "Across y"),
    ("Z", "z", "Across z"),
]

NOWHERE = (0.0, 0.0, 0.0, 1.0)
"""Clipping plane of Blender that cuts nothing off: its normal is zero, and its offset positive."""

MARGIN = 1e-3
"""Distance (mm) of the plane from the sensor at the slider's ends: it cuts nothing or all off."""


when_markers_asked: list[Callable[[], None]] = []
"""Callbacks for the markers being shown or hidden."""

when_footprint_asked: list[Callable[[], None]] = []
"""Callbacks for the camera's footprint being switched on or off."""


def _changed(values: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    show(context.scene)


def _footprint_asked(values: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    for each in when_footprint_asked:
        each()


def _markers_asked(values: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    for each in when_markers_asked:
        each()


class OPTISENSE_PG_looks(bpy.types.PropertyGroup):
    """Settings of how a sensor is drawn."""

    cut: BoolProperty(
        name="Section", description="Cut the sensor open in 3D views", update=_changed
    )
    axis: EnumProperty(
        name="Axis", items=AXES, default="Y", description="Axis that is perpendicular to the cut",
        update=_changed,
    )  # fmt: skip
    share: FloatProperty(
        name="Section", subtype="FACTOR", min=0.0, max=1.0, default=0.5, precision=2,
        description="Position of the cut: 0 shows the whole sensor, 1 removes all of it",
        update=_changed,
    )  # fmt: skip
    footprint: BoolProperty(
        name="Camera's Footprint",
        description="Outline the part of the skin that the camera sees and tint the rest red; it "
        "follows the camera, mirrors and the skin",
        update=_footprint_asked,
    )
    markers: BoolProperty(
        name="Markers", default=True, update=_markers_asked,
        description="Draw the dots that are printed on the skin",
    )  # fmt: skip


def bounds(scene: bpy.types.Scene) -> tuple[Vector, Vector] | None:
    """Return the lowest and highest x, y, z of all parts, mm; None if there are no parts."""
    corners = [
        world_matrix(each) @ Vector(corner)
        for each in objects_of(scene, "PART")
        for corner in each.bound_box
    ]
    if not corners:
        return None
    low, high = (
        Vector([pick(corner[axis] for corner in corners) for axis in range(3)])
        for pick in (min, max)
    )
    return low, high


def plane(scene: bpy.types.Scene) -> tuple[float, float, float, float] | None:
    """Return the plane (a, b, c, d) of the section; a x + b y + c z + d > 0 is shown."""
    looks = scene.optisense_looks
    found = bounds(scene) if looks.cut else None
    if found is None:
        return None
    axis = "XYZ".index(looks.axis)
    low, high = found[0][axis] - MARGIN, found[1][axis] + MARGIN
    normal = [0.0, 0.0, 0.0]
    normal[axis] = 1.0
    return normal[0], normal[1], normal[2], -(low + looks.share * (high - low))


def show(scene: bpy.types.Scene) -> None:
    """Switch the section on or off in all 3D views of a scene."""
    found = plane(scene)
    for window in bpy.context.window_manager.windows:
        if window.scene != scene:
            continue
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                view = area.spaces.active.region_3d
                if found is not None and not view.use_clip_planes:
                    _prepare(window, area)
                planes = [found or NOWHERE] + [NOWHERE] * 5
                view.clip_planes = [list(each) for each in planes]
                view.use_clip_planes = found is not None
                area.tag_redraw()


def _prepare(window: bpy.types.Window, area: bpy.types.Area) -> None:
    """Prepare a view for clipping: use Blender's clipping tool once, around the whole view.

    Without this, Blender stores the planes but cuts nothing off.
    """
    region = next(each for each in area.regions if each.type == "WINDOW")
    with bpy.context.temp_override(window=window, area=area, region=region):
        bpy.ops.view3d.clip_border(xmin=0, xmax=region.width, ymin=0, ymax=region.height)


@bpy.app.handlers.persistent
def _again(*_: Any) -> None:
    show(bpy.context.scene)


PROPERTIES = {"Scene": {"optisense_looks": OPTISENSE_PG_looks}}
HOOKS = (
    (bpy.app.handlers.load_post, _again),
    (bpy.app.handlers.undo_post, _again),
    (bpy.app.handlers.redo_post, _again),
)

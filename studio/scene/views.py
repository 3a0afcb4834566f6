"""Setup of the 3D views that show a sensor: colours, and the whole sensor in view."""

from __future__ import annotations

import bpy
from mathutils import Vector

from ..core.fitting import fitted
from .world import world_matrix

SENSOR = 72.0
"""Width in mm of the larger side of the image plane that Blender assumes behind `space.lens`."""


def show_design(scene: bpy.types.Scene) -> None:
    """Set up all 3D views of a scene: colours of the roles, and the whole sensor in view."""
    bpy.context.view_layer.update()  # new objects have no size before
    for window in bpy.context.window_manager.windows:
        if window.scene != scene:
            continue
        for area in window.screen.areas:
            if area.type != "VIEW_3D":
                continue
            space = area.spaces.active
            space.shading.color_type = "OBJECT"
            space.shading.show_backface_culling = False
            # Parts touch: outlines would flicker where two faces coincide.
            space.shading.show_object_outline = False
            space.shading.light = "STUDIO"
            space.shading.show_specular_highlight = True
            space.overlay.show_axis_x = space.overlay.show_axis_y = False
            space.overlay.show_floor = space.overlay.show_cursor = False
            space.clip_start, space.clip_end = 0.1, 10_000.0
            region = next(each for each in area.regions if each.type == "WINDOW")
            with bpy.context.temp_override(window=window, area=area, region=region):
                _view_all(area, region)


def _view_all(area: bpy.types.Area, region: bpy.types.Region) -> None:
    """Show the whole scene in the part of a view that the sidebar leaves free."""
    looks = bpy.context.preferences.view
    smooth, looks.smooth_view = looks.smooth_view, 0  # the view must not move later
    try:
        bpy.ops.view3d.view_all()
    finally:
        looks.smooth_view = smooth
    left, right = 0, region.width
    bar = next((each for each in area.regions if each.type == "UI"), None)
    overlaps = bpy.context.preferences.system.use_region_overlap
    if bar is not None and bar.width > 1 and overlaps:
        if bar.x > region.x:
            right -= bar.width
        else:
            left += bar.width
    _fit(area.spaces.active, region, (left, right))


def _fit(space: bpy.types.SpaceView3D, region: bpy.types.Region, free: tuple[float, float]) -> None:
    """Fit a perspective view to the visible objects, between two places in pixels from its left."""
    view = space.region_3d
    corners = [
        world_matrix(each) @ Vector(corner)
        for each in bpy.context.view_layer.objects
        if each.visible_get()
        for corner in each.bound_box
    ]
    if bpy.app.background or not corners or view.view_perspective != "PERSP":
        return
    size = (region.width, region.height)
    focal = max(size) * space.lens / SENSOR
    found = fitted(corners, view.view_rotation.to_matrix().transposed(), focal, size, free)
    view.view_location, view.view_distance = found.location, found.distance
    view.update()

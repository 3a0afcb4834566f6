"""3D views that show a sensor: its colours, and all of it."""

from __future__ import annotations

import bpy
from bpy_extras.view3d_utils import region_2d_to_location_3d
from mathutils import Vector


def show_design(scene: bpy.types.Scene) -> None:
    """Let every 3D view of the scene show the roles' colours and the whole sensor."""
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
            # Parts touch: outlines would be drawn wherever two faces at one place alternate.
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
    smooth, looks.smooth_view = looks.smooth_view, 0  # else it would go on moving after this
    try:
        bpy.ops.view3d.view_all()
    finally:
        looks.smooth_view = smooth
    bar = next((each for each in area.regions if each.type == "UI"), None)
    view = area.spaces.active.region_3d
    if bar is None or bar.width <= 1 or not bpy.context.preferences.system.use_region_overlap:
        return
    free = max(region.width - bar.width, 1)
    side = 1.0 if bar.x > region.x else -1.0
    view.view_distance *= max(1.0, min(region.width, region.height) / free)
    view.update()
    middle = Vector((region.width / 2, region.height / 2))
    beside = middle + Vector((side * bar.width / 2, 0.0))
    here, there = (
        region_2d_to_location_3d(region, view, each, view.view_location)
        for each in (middle, beside)
    )
    view.view_location += there - here

"""3D views that show a sensor: its colours, and all of it."""

from __future__ import annotations

import bpy


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
            space.clip_start, space.clip_end = 0.1, 10_000.0
            region = next(each for each in area.regions if each.type == "WINDOW")
            with bpy.context.temp_override(window=window, area=area, region=region):
                bpy.ops.view3d.view_all()

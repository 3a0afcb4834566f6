"""The workspace OptiSense: the 3D view beside a picture that always fits, and nothing else."""

from __future__ import annotations

import bpy

from ..engine.layout import TAB
from ..scene.views import show_design
from ..simulate import editors, picture

SHARE = 0.62
"""Share of the window's width that the 3D view takes; the picture takes the rest."""


def show(context: bpy.types.Context) -> bool:
    """Show the workspace in the first window, creating it if needed; return whether there is a
    window.
    """
    windows = context.window_manager.windows
    if not windows:
        return False
    window = windows[0]
    made = bpy.data.workspaces.get(TAB)
    if made is not None:
        window.workspace = made
        return True
    with context.temp_override(window=window):
        bpy.ops.workspace.duplicate()
    # Blender switches to the copy a moment later, after it has handled its events.
    bpy.app.timers.register(_arrange, first_interval=editors.WAIT)
    return True


def _arrange() -> float | None:
    """Leave only a 3D view and an Image Editor in the new workspace.

    Closing an area may create others: one is closed at a time, and all are looked up again.
    """
    window = bpy.context.window_manager.windows[0]
    if window.workspace.name != TAB:
        if bpy.data.workspaces.get(TAB) is not None:
            return None
        window.workspace.name = TAB
    screen = window.screen
    bench = _largest_view(screen)
    if bench is None:
        return None  # the user's own layout has no bench to begin with
    other = next((each for each in screen.areas if each != bench), None)
    if other is not None:
        with bpy.context.temp_override(window=window, screen=screen, area=other):
            bpy.ops.screen.area_close()
        return editors.SOON
    with bpy.context.temp_override(window=window, screen=screen, area=bench):
        bpy.ops.screen.area_split(direction="VERTICAL", factor=SHARE)
    bpy.app.timers.register(_fill, first_interval=editors.SOON)
    return None


def _largest_view(screen: bpy.types.Screen) -> bpy.types.Area | None:
    views = [each for each in screen.areas if each.type == "VIEW_3D"]
    return max(views, key=lambda each: each.width * each.height, default=None)


def _fill() -> None:
    """Show the picture in the right half of the workspace, and the sensor in the left one."""
    window = bpy.context.window_manager.windows[0]
    areas = sorted(window.screen.areas, key=lambda each: each.x)
    if window.workspace.name != TAB or len(areas) != 2:
        return
    bench, editor = areas
    space = bench.spaces.active
    space.show_region_ui, space.show_region_toolbar = True, False
    space.show_region_tool_header = False
    with bpy.context.temp_override(window=window, screen=window.screen, area=editor):
        editor.type = "IMAGE_EDITOR"
    shown = editor.spaces.active
    shown.image = bpy.data.images.get(picture.IMAGE)
    shown.show_region_header, shown.show_region_tool_header = False, True  # the latter is ours
    shown.show_region_toolbar = shown.show_region_ui = False
    show_design(window.scene)
    bpy.app.timers.register(_open_tab, first_interval=editors.WAIT)


def show_sidebar(context: bpy.types.Context) -> None:
    """Open the extension's tab in the sidebar of the 3D view that the mouse is over."""
    if context.area is not None and context.area.type == "VIEW_3D":
        context.area.spaces.active.show_region_ui = True
        bpy.app.timers.register(_open_tab, first_interval=editors.WAIT)


def _open_tab() -> None:
    """Open the extension's tab in the sidebar, once the sidebar has been drawn."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                bar = next((each for each in area.regions if each.type == "UI"), None)
                if bar is not None and hasattr(bar, "active_panel_category"):
                    bar.active_panel_category = TAB
                    area.tag_redraw()


class OPTISENSE_OT_workspace(bpy.types.Operator):
    """Show the workspace OptiSense: the sensor beside its picture, and nothing else"""

    bl_idname = "optisense.workspace"
    bl_label = "OptiSense Workspace"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if context.screen is None:
            cls.poll_message_set("There is no window")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        return {"FINISHED"} if show(context) else {"CANCELLED"}

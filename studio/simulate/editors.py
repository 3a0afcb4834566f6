"""Display of pictures in Image Editors."""

from __future__ import annotations

import bpy

from ..engine.layout import TAB
from . import picture

SOON = 0.05
"""Delay after which Blender has handled its events, s."""

WAIT = 0.2
"""Delay until an area that was created or changed has its size, s."""

_fitted: dict[int, tuple[int, ...]] = {}
"""Sizes in pixels of each open editor and its picture when the picture was last made to fit."""

_handle: object | None = None


def can_show(operator: type[bpy.types.Operator], context: bpy.types.Context) -> bool:
    """Check that there is a window to show a picture in."""
    if context.screen is None:
        operator.poll_message_set("There is no window")
        return False
    return True


def show(context: bpy.types.Context, image: bpy.types.Image) -> None:
    """Show a picture in the Image Editor of this window, creating one if needed."""
    areas = context.screen.areas
    editors = [each for each in areas if each.type == "IMAGE_EDITOR"]
    editor = next((each for each in editors if each.spaces.active.image == image), None)
    editor = editor or next(iter(editors), None) or _new_editor(context)
    editor.spaces.active.image = image
    name = image.name
    bpy.app.timers.register(lambda: _fit(name), first_interval=WAIT)


def _new_editor(context: bpy.types.Context) -> bpy.types.Area:
    """Turn half of the largest 3D view into an Image Editor."""
    areas = context.screen.areas
    known = set(areas)
    views = [each for each in areas if each.type == "VIEW_3D"] or list(areas)
    area = max(views, key=lambda each: each.width * each.height)
    with context.temp_override(area=area):
        bpy.ops.screen.area_split(direction="VERTICAL", factor=0.5)
    editor = next((each for each in context.screen.areas if each not in known), area)
    editor.type = "IMAGE_EDITOR"
    return editor


def _fit_soon(name: str) -> None:
    """Fit the picture a moment later, when the image has its size; empty editors show it first."""
    if not bpy.app.background:
        for window in bpy.context.window_manager.windows:
            for area in window.screen.areas:
                if area.type == "IMAGE_EDITOR" and area.spaces.active.image is None:
                    area.spaces.active.image = bpy.data.images[name]
        bpy.app.timers.register(lambda: _fit(name), first_interval=0.0)


def _fit(name: str) -> None:
    """Fit the picture into every Image Editor that shows it."""
    image = bpy.data.images.get(name)
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "IMAGE_EDITOR" and area.spaces.active.image == image:
                region = next(each for each in area.regions if each.type == "WINDOW")
                with bpy.context.temp_override(window=window, area=area, region=region):
                    bpy.ops.image.view_all(fit_view=True)


def _fit_when_resized() -> None:
    """Refit the picture if the size of it or of the editor changed, in the workspace OptiSense
    only.

    The fit is deferred to a timer, as drawing may not change the view.
    """
    context = bpy.context
    image = context.space_data.image
    if context.workspace is None or context.workspace.name != TAB or image is None:
        return
    size = (context.region.width, context.region.height, *image.size)
    if _fitted.get(context.area.as_pointer()) != size:
        areas = {area.as_pointer() for screen in bpy.data.screens for area in screen.areas}
        for gone in _fitted.keys() - areas:
            del _fitted[gone]
        _fitted[context.area.as_pointer()] = size
        name = image.name
        bpy.app.timers.register(lambda: _fit(name), first_interval=0.0)


HOOKS = ((picture.when_resized, _fit_soon),)


def register() -> None:
    global _handle
    if not bpy.app.background:
        _handle = bpy.types.SpaceImageEditor.draw_handler_add(
            _fit_when_resized, (), "WINDOW", "POST_PIXEL"
        )


def unregister() -> None:
    global _handle
    if _handle is not None:
        bpy.types.SpaceImageEditor.draw_handler_remove(_handle, "WINDOW")
    _handle = None
    _fitted.clear()

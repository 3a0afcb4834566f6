"""Display of the picture in Image Editors: channels, false colours, comparison with a pinned
picture.

The picture itself is not changed, for scripts and for saving: the display is another image.
"""

from __future__ import annotations

import blf
import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty, FloatProperty, StringProperty
from numpy.typing import NDArray

from ..core import viewing as core
from ..engine import polls, session
from ..engine.layout import TAB
from . import picture

IMAGE = "OptiSense view"

CHANNELS = [
    ("COLOUR", "RGB", "The colours of the camera"),
    ("RED", "R", "Only the red channel"),
    ("GREEN", "G", "Only the green channel"),
    ("BLUE", "B", "Only the blue channel"),
    ("MEAN", "L", "The mean of the three channels"),
]

COMPARISONS = [
    ("NONE", "Picture", "The picture by itself", "IMAGE_DATA", 0),
    ("WIPE", "Wipe", "The pinned picture on the left, this one on the right", "ARROW_LEFTRIGHT", 1),
    ("DIFFERENCE", "Difference", "What is brighter and darker than in the pinned picture",
     "IMAGE_ALPHA", 2),
]  # fmt: skip
"""Choices of the comparison with the pinned picture; the last entry of each is the number that
Blender stores in its files."""

TEXT, LINE = 12.0, 18
"""Size of the text over a picture in points, and distance of its lines in pixels."""

NARROW = 0.75
"""Width of the channel buttons and of the wipe's slider relative to the default: all controls fit
above a narrow picture.
"""

_now: NDArray[np.float32] | None = None
_pinned: NDArray[np.float32] | None = None
_handle: object | None = None


def _changed(values: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    refresh()


class OPTISENSE_PG_view(bpy.types.PropertyGroup):
    """Settings of the display; never saved."""

    channel: EnumProperty(
        name="Channel", items=CHANNELS, default="COLOUR", update=_changed,
        description="Channels of the picture that are shown", options={"SKIP_SAVE"},
    )  # fmt: skip
    false_colour: BoolProperty(
        name="False Colours", update=_changed, options={"SKIP_SAVE"},
        description="Show brightness as colours from black by red to white; a difference is blue "
        "where it is darker and red where it is brighter",
    )  # fmt: skip
    compare: EnumProperty(
        name="Compare", items=COMPARISONS, default="NONE", update=_changed,
        description="How the picture is compared with the pinned one", options={"SKIP_SAVE"},
    )  # fmt: skip
    wipe: FloatProperty(
        name="Wipe",
        subtype="FACTOR",
        min=0.0,
        max=1.0,
        default=0.5,
        precision=2,
        update=_changed,
        description="Position of the border between the pinned picture (left) and the present one "
        "(right)",
        options={"SKIP_SAVE"},
    )
    gain: FloatProperty(
        name="Gain", min=1.0, max=64.0, default=4.0, precision=0, step=100, update=_changed,
        description="Factor by which the difference is multiplied", options={"SKIP_SAVE"},
    )  # fmt: skip
    pinned: StringProperty(description="Name of the pinned picture", options={"SKIP_SAVE"})
    was_automatic: BoolProperty(
        description="Whether the exposure was automatic before a picture was pinned",
        options={"SKIP_SAVE"},
    )


def is_plain() -> bool:
    """Return whether the picture is shown unchanged."""
    values = bpy.context.window_manager.optisense_view
    compared = values.compare != "NONE" and _pinned is not None
    return values.channel == "COLOUR" and not values.false_colour and not compared


def refresh() -> None:
    """Update the displayed picture in all Image Editors that show it."""
    if _now is None:
        return
    if is_plain():
        _show_in_editors(IMAGE, picture.IMAGE)
        return
    values = bpy.context.window_manager.optisense_view
    picture.fill(
        IMAGE,
        core.viewed(
            _now,
            _pinned,
            channel=values.channel,
            false_colour=values.false_colour,
            compare=values.compare,
            wipe=values.wipe,
            gain=values.gain,
        ),
    )
    _show_in_editors(picture.IMAGE, IMAGE)


def _show_in_editors(before: str, after: str) -> None:
    shown, wanted = bpy.data.images.get(before), bpy.data.images.get(after)
    if wanted is None:
        return
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "IMAGE_EDITOR":
                space = area.spaces.active
                if shown is not None and space.image == shown:
                    space.image = wanted
                area.tag_redraw()


def _take(pixels: NDArray[np.float32]) -> None:
    """Store and display a new picture."""
    global _now
    _now = pixels
    refresh()


class OPTISENSE_OT_pin_picture(polls.Checked, bpy.types.Operator):
    """Keep this picture, to compare later ones with it; meanwhile the exposure is fixed"""

    bl_idname = "optisense.pin_picture"
    bl_label = "Pin"

    checks = (polls.requires(lambda _: _now is not None, "Simulate first"),)

    def execute(self, context: bpy.types.Context) -> set[str]:
        global _pinned
        _pinned = None if _now is None else _now.copy()
        now, values = (
            context.window_manager.optisense_picture,
            context.window_manager.optisense_view,
        )
        size = now.summary.partition(",")[0]
        values.pinned = ("draft, " if now.is_draft else "") + (size or "a picture")
        settings = context.scene.optisense_simulation
        values.was_automatic = values.was_automatic or settings.auto_exposure
        settings.auto_exposure = False  # else all would differ where only one light changes
        if values.compare == "NONE":
            values.compare = "WIPE"
        refresh()
        return {"FINISHED"}


class OPTISENSE_OT_unpin_picture(polls.Checked, bpy.types.Operator):
    """Forget the pinned picture"""

    bl_idname = "optisense.unpin_picture"
    bl_label = "Unpin"

    checks = (polls.requires(lambda _: _pinned is not None, "No picture is pinned"),)

    def execute(self, context: bpy.types.Context) -> set[str]:
        global _pinned
        _pinned = None
        values = context.window_manager.optisense_view
        values.pinned, values.compare = "", "NONE"
        if values.was_automatic:
            context.scene.optisense_simulation.auto_exposure = True
        values.was_automatic = False
        return {"FINISHED"}


def draw_header(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw the controls of the display in a row."""
    values = context.window_manager.optisense_view
    settings = context.scene.optisense_simulation
    row = layout.row(align=True)
    row.prop(settings, "auto_exposure", text="", icon="LIGHT_SUN")
    factor = row.row(align=True)
    factor.enabled = not settings.auto_exposure
    factor.prop(settings, "exposure", text="")
    row = layout.row(align=True)
    channels = row.row(align=True)
    channels.scale_x = NARROW
    channels.prop(values, "channel", expand=True)
    row.prop(values, "false_colour", text="", icon="COLOR")
    row = layout.row(align=True)
    row.operator("optisense.pin_picture", text="" if values.pinned else "Pin", icon="PINNED")
    if values.pinned:
        row.operator("optisense.unpin_picture", text="", icon="X")
        row.prop(values, "compare", expand=True, icon_only=True)
        amount = row.row(align=True)
        amount.scale_x = NARROW
        if values.compare == "WIPE":
            amount.prop(values, "wipe", text="", slider=True)
        elif values.compare == "DIFFERENCE":
            amount.prop(values, "gain", text="")


def _draw_header(header: bpy.types.Header, context: bpy.types.Context) -> None:
    if context.workspace is not None and context.workspace.name == TAB and _is_ours(context):
        draw_header(header.layout, context)


def _is_ours(context: bpy.types.Context) -> bool:
    """Return whether an Image Editor shows the picture, or is empty."""
    image = context.space_data.image
    return image is None or image.name in (IMAGE, picture.IMAGE)


def words(context: bpy.types.Context) -> list[str]:
    """Return the text over the picture, one line each."""
    now, values = context.window_manager.optisense_picture, context.window_manager.optisense_view
    if not now.shown:
        return []
    other = now.other_sensor(context.scene)
    old = f"{other[:1].upper()}{other[1:]}: " if other else ""
    lines = [f"{old}{picture.kind(now)}{now.summary}"]
    if values.pinned and values.compare == "WIPE":
        lines.append(f"On the left: the pinned picture ({values.pinned})")
    elif values.pinned and values.compare == "DIFFERENCE":
        lines.append(f"Minus the pinned picture ({values.pinned}), {values.gain:.0f} times")
    return lines


def _draw_words() -> None:
    context = bpy.context
    if not _is_ours(context) or context.space_data.image is None:
        return
    scale = context.preferences.system.ui_scale
    blf.size(0, TEXT * scale)
    blf.color(0, 0.85, 0.85, 0.85, 1.0)
    for number, line in enumerate(reversed(words(context))):
        blf.position(0, LINE * scale * 0.6, LINE * scale * (0.6 + number), 0)
        blf.draw(0, line)


@bpy.app.handlers.persistent
def _forget(*_: object) -> None:
    """Forget the pictures after another .blend file was opened."""
    global _now, _pinned
    if bpy.data.images.get(picture.IMAGE) is None:
        _now = None
    _pinned = None
    values = bpy.context.window_manager.optisense_view
    values.pinned, values.compare, values.was_automatic = "", "NONE", False


PROPERTIES = {"WindowManager": {"optisense_view": OPTISENSE_PG_view}}
HOOKS = (
    (picture.when_shown, _take),
    (bpy.app.handlers.load_post, _forget),
)


def register() -> None:
    global _handle
    bpy.types.IMAGE_HT_tool_header.prepend(_draw_header)
    if not bpy.app.background:
        _handle = bpy.types.SpaceImageEditor.draw_handler_add(
            _draw_words, (), "WINDOW", "POST_PIXEL"
        )


def unregister() -> None:
    global _handle, _now, _pinned
    bpy.types.IMAGE_HT_tool_header.remove(_draw_header)
    if _handle is not None:
        bpy.types.SpaceImageEditor.draw_handler_remove(_handle, "WINDOW")
    _handle = _now = _pinned = None
    session.redraw()

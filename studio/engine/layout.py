"""Layout helpers that all panels share."""

from __future__ import annotations

import textwrap

import blf
import bpy

from . import guide, session

TAB = "OptiSense"
CHARACTERS = 46
"""About what fits in a line of the sidebar, where that can't be measured."""

FONT_SIZE = 11.0
"""Size in points of labels in Blender's own themes."""

_told: set[str] = set()
"""Titles of the jobs whose outcome is told beside the button that began them."""

EDGES, ICON, BOX = 56.0, 21.0, 14.0
"""Pixels of the sidebar that a line of text can't have: its tabs and edges, an icon, a box."""


class SidebarPanel:
    """A panel of the extension's tab; those that need a sensor are not drawn without one."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = TAB

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.scene is not None and context.scene.optisense.is_open

    def draw_header_preset(self, context: bpy.types.Context) -> None:
        """The button at the right end of the panel's head."""
        guide.draw_buttons(self.layout, self.bl_label)


def labelled(layout: bpy.types.UILayout) -> bpy.types.UILayout:
    """A column of values with their names on the left, and no dots for keyframes."""
    column = layout.column()
    column.use_property_split = True
    column.use_property_decorate = False
    return column


def paragraph(
    layout: bpy.types.UILayout, text: str, icon: str = "NONE", *, boxed: bool = False
) -> None:
    """A text in as many lines as it needs.

    Args:
        layout: where to.
        text: without line breaks.
        icon: before the first line.
        boxed: it is in a box, which leaves less room.
    """
    column = layout.column(align=True)
    column.scale_y = 0.8
    for number, line in enumerate(lines_of(text, has_icon=icon != "NONE", boxed=boxed)):
        column.label(
            text=line, icon=icon if number == 0 else "BLANK1" if icon != "NONE" else "NONE"
        )


def lines_of(text: str, *, has_icon: bool, boxed: bool) -> list[str]:
    """A text broken where the sidebar ends, as wide as it is now."""
    region = bpy.context.region
    if bpy.app.background or region is None:
        return textwrap.wrap(text, CHARACTERS)
    scale = bpy.context.preferences.system.ui_scale
    room = region.width - scale * (EDGES + ICON * has_icon + BOX * boxed)
    blf.size(0, FONT_SIZE * scale)
    lines: list[str] = []
    for word in text.split():
        longer = f"{lines[-1]} {word}" if lines else word
        if lines and blf.dimensions(0, longer)[0] <= room:
            lines[-1] = longer
        else:
            lines += _pieces(word, room)
    return lines


def _pieces(word: str, room: float) -> list[str]:
    """A word that may be longer than a line, such as a path, cut where lines end."""
    pieces = [""]
    for letter in word:
        if pieces[-1] and blf.dimensions(0, pieces[-1] + letter)[0] > room:
            pieces.append("")
        pieces[-1] += letter
    return pieces


def show_job(layout: bpy.types.UILayout, *titles: str) -> bool:
    """The progress of the job, where it is one of these, and a button to cancel it; whether it is.

    It stands in place of the button that began the job: Blender would leave that button grey after
    the job for as long as the mouse rests on it. It is a property that can't be edited: Blender
    takes a layout's progress bar that the mouse rests on for the next label or picture, once it
    is gone, and draws that as a full bar.
    """
    now = session.state()
    if now.busy not in titles:
        return False
    row = layout.row(align=True)
    text = "Cancelling ..." if now.cancelling else now.progress or f"{now.busy} ..."
    bar = row.row(align=True)
    bar.enabled = False
    bar.prop(now, "per_cent", text=text, slider=True)
    row.operator("optisense.cancel", text="", icon="CANCEL")
    return True


def show_outcome(layout: bpy.types.UILayout, *titles: str) -> None:
    """What there is to tell of the job that was over last, where it is one of these.

    The panel Sensor tells everything else.
    """
    _told.update(titles)
    if not session.state().busy and session.state().about in titles:
        show_messages(layout)


def show_other_outcomes(layout: bpy.types.UILayout) -> None:
    """What there is to tell that no other panel tells beside the button that was pressed."""
    if session.state().about not in _told:
        show_messages(layout)


def show_messages(layout: bpy.types.UILayout) -> None:
    """What went wrong last, or what there is to tell."""
    now = session.state()
    if now.problem:
        box = layout.box()
        paragraph(box, now.problem, "ERROR", boxed=True)
        if now.hint:
            paragraph(box, now.hint, "BLANK1", boxed=True)
    elif now.note:
        paragraph(layout, now.note, "INFO")

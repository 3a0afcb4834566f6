"""Layout helpers shared by all panels."""

from __future__ import annotations

import textwrap

import blf
import bpy

from . import guide, session

TAB = "OptiSense"
CHARACTERS = 46
"""Approximate number of characters in a line of the sidebar, used if it can't be measured."""

FONT_SIZE = 11.0
"""Size of labels in Blender's own themes, points."""

_told: set[str] = set()
"""Titles of the jobs whose outcome is shown beside the button that started them."""

EDGES, ICON, BOX = 56.0, 21.0, 14.0
"""Widths in pixels that a line of text lacks: tabs and edges of the sidebar, an icon, a box."""


class SidebarPanel:
    """Base of the extension's panels; those that need a sensor are hidden without one."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = TAB
    bl_options = frozenset({"DEFAULT_CLOSED"})

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.scene is not None and context.scene.optisense.is_open

    def draw_header_preset(self, context: bpy.types.Context) -> None:
        """Draw the buttons at the right end of the panel's header."""
        guide.draw_buttons(self.layout, self.bl_label)


def labelled(layout: bpy.types.UILayout) -> bpy.types.UILayout:
    """Return a column for properties with their names on the left, without keyframe dots."""
    column = layout.column()
    column.use_property_split = True
    column.use_property_decorate = False
    return column


def paragraph(
    layout: bpy.types.UILayout, text: str, icon: str = "NONE", *, boxed: bool = False
) -> None:
    """Draw a text in as many lines as it needs.

    Args:
        text: text without line breaks.
        icon: icon before the first line.
        boxed: whether `layout` is a box, which leaves less room.
    """
    column = layout.column(align=True)
    column.scale_y = 0.8
    for number, line in enumerate(lines_of(text, has_icon=icon != "NONE", boxed=boxed)):
        column.label(
            text=line, icon=icon if number == 0 else "BLANK1" if icon != "NONE" else "NONE"
        )


def lines_of(text: str, *, has_icon: bool, boxed: bool) -> list[str]:
    """Break a text into lines of the present width of the sidebar."""
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
    """Break a word that may be longer than a line, such as a path."""
    pieces = [""]
    for letter in word:
        if pieces[-1] and blf.dimensions(0, pieces[-1] + letter)[0] > room:
            pieces.append("")
        pieces[-1] += letter
    return pieces


def show_job(layout: bpy.types.UILayout, *titles: str) -> bool:
    """Draw progress and a cancel button if the running job has one of these titles; return whether
    it has.

    They take the place of the button that started the job: Blender would leave that button grey
    after the job while the mouse rests on it. The progress bar is a read-only property: with a
    progress bar of the layout under the mouse, Blender would draw the next label or picture as a
    full bar once the bar is gone.
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
    """Draw the outcome of the last job if it has one of these titles.

    The panel Sensor shows all other outcomes.
    """
    _told.update(titles)
    if not session.state().busy and session.state().about in titles:
        show_messages(layout)


def show_other_outcomes(layout: bpy.types.UILayout) -> None:
    """Draw the last outcome unless another panel shows it beside the button that was pressed."""
    if session.state().about not in _told:
        show_messages(layout)


def show_messages(layout: bpy.types.UILayout) -> None:
    """Draw the last problem or, without one, the last note."""
    now = session.state()
    if now.problem:
        box = layout.box()
        paragraph(box, now.problem, "ERROR", boxed=True)
        if now.hint:
            paragraph(box, now.hint, "BLANK1", boxed=True)
    elif now.note:
        paragraph(layout, now.note, "INFO")


def shows_more(layout: bpy.types.UILayout, values: bpy.types.PropertyGroup) -> bool:
    """Draw the triangle that folds seldom-used options out; return whether they are shown."""
    row = layout.row()
    row.alignment = "LEFT"
    icon = "DISCLOSURE_TRI_DOWN" if values.shows_more else "DISCLOSURE_TRI_RIGHT"
    row.prop(values, "shows_more", icon=icon, emboss=False)
    return bool(values.shows_more)

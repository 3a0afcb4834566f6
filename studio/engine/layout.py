"""What all panels share."""

from __future__ import annotations

import textwrap

import bpy

from . import session

TAB = "OptiSense"
CHARACTERS = 46
"""About what fits in a line of the sidebar."""


class SidebarPanel:
    """A panel of the extension's tab; those that need a sensor are not drawn without one."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = TAB

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.scene is not None and context.scene.optisense.is_open


def paragraph(layout: bpy.types.UILayout, text: str, icon: str = "NONE") -> None:
    """A text in as many lines as it needs."""
    column = layout.column(align=True)
    column.scale_y = 0.8
    for number, line in enumerate(textwrap.wrap(text, CHARACTERS)):
        column.label(
            text=line, icon=icon if number == 0 else "BLANK1" if icon != "NONE" else "NONE"
        )


def show_job(layout: bpy.types.UILayout, *titles: str) -> bool:
    """The progress of the job, where it is one of these, and a button to cancel it; whether it is.

    It stands in place of the button that began the job: Blender would leave that button grey after
    the job for as long as the mouse rests on it.
    """
    now = session.state()
    if now.busy not in titles:
        return False
    row = layout.row(align=True)
    text = "Cancelling ..." if now.cancelling else now.progress or f"{now.busy} ..."
    row.progress(factor=now.fraction, text=text)
    row.operator("optisense.cancel", text="", icon="CANCEL")
    return True


def show_messages(layout: bpy.types.UILayout) -> None:
    """What went wrong last, or what there is to tell."""
    now = session.state()
    if now.problem:
        box = layout.box()
        paragraph(box, now.problem, "ERROR")
        if now.hint:
            paragraph(box, now.hint, "BLANK1")
    elif now.note:
        paragraph(layout, now.note, "INFO")

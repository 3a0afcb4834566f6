"""Help: shows the page of the documentation about a panel in a window of Blender."""

from __future__ import annotations

import bpy
from bpy.props import StringProperty

from ..core import guide
from .operators import refuse

NAME = "OptiSense help: "

STEPS = {
    "Sensor": ("studio", "1 "),
    "Shapes": ("studio", "2 "),
    "Materials": ("studio", "3 "),
    "Lights and Camera": ("studio", "4 "),
    "Simulate": ("studio", "5 "),
    "Evaluate": ("studio", "6 "),
    "Optimise": ("studio", "7 "),
    "Report and Export": ("studio", "8 "),
    "Calibrate": ("studio", "9 "),
    "Photographs": ("calibration", ""),
    "Cages": ("cages", ""),
    "Library": ("library", ""),
    "Simulation": ("simulation", ""),
    "Objectives": ("objectives", ""),
    "Search": ("search", ""),
    "Workshop": ("workshop", ""),
}
"""Page of each help topic, and the words with which its paragraph begins."""

MORE = {
    "Shapes": "Cages",
    "Materials": "Library",
    "Simulate": "Simulation",
    "Evaluate": "Objectives",
    "Optimise": "Search",
    "Report and Export": "Workshop",
    "Calibrate": "Photographs",
}
"""Topic with further help for each panel."""

ABOVE = 2
"""Number of lines shown above the paragraph, so that its beginning is seen as such."""


def text_of(topic: str) -> tuple[bpy.types.Text, int]:
    """Return a page as a text of Blender, and the number of the line of a topic in it.

    Raises:
        KeyError: there is no such topic.
        OSError: the page does not exist.
    """
    name, begins = STEPS[topic]
    content = guide.page(name)
    text = bpy.data.texts.get(NAME + name) or bpy.data.texts.new(NAME + name)
    text.from_string(content)
    line = guide.line_of(content, begins) if begins else 0
    text.cursor_set(line)
    return text, line


class OPTISENSE_OT_help(bpy.types.Operator):
    """Open the documentation of this panel, which comes with the extension"""

    bl_idname = "optisense.help"
    bl_label = "Help"
    bl_options = {"INTERNAL"}

    topic: StringProperty(
        name="Topic", description="Panel or page of the documentation to open", default="Sensor"
    )

    @classmethod
    def description(cls, context: bpy.types.Context, values: bpy.types.OperatorProperties) -> str:
        return f"Open the documentation: {values.topic}"

    def execute(self, context: bpy.types.Context) -> set[str]:
        try:
            text, line = text_of(self.topic)
        except KeyError:
            return refuse(self, f"There is no help on '{self.topic}'")
        except OSError as error:
            return refuse(self, f"The help can't be read: {error}")
        if bpy.app.background:
            return {"FINISHED"}
        area = _text_area(context)
        space = area.spaces.active
        space.text = text
        space.show_word_wrap, space.show_line_numbers = True, False
        space.show_syntax_highlight = False
        space.top = max(0, line - ABOVE)
        return {"FINISHED"}


def _text_area(context: bpy.types.Context) -> bpy.types.Area:
    """Return the window area that already shows help, or that of a new window."""
    windows = context.window_manager.windows
    for window in windows:
        for area in window.screen.areas:
            if area.type == "TEXT_EDITOR":
                shown = area.spaces.active.text
                if shown is not None and shown.name.startswith(NAME):
                    return area
    known = set(windows)
    bpy.ops.wm.window_new()
    window = next(each for each in context.window_manager.windows if each not in known)
    area = window.screen.areas[0]
    area.type = "TEXT_EDITOR"
    return area


def draw_buttons(layout: bpy.types.UILayout, panel: str) -> None:
    """Draw the help buttons in the header of a panel: its own topic, and the page with more."""
    row = layout.row(align=True)
    for topic, icon in ((panel, "QUESTION"), (MORE.get(panel, ""), "TEXT")):
        if topic in STEPS:
            button = row.operator("optisense.help", text="", icon=icon, emboss=False)
            button.topic = topic

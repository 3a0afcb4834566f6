"""Light ledger: where the light of each group goes, and which light reaches a chosen place."""

from __future__ import annotations

import json
from typing import Any

import bpy
from bpy.props import StringProperty

from ..core import ledger as core
from ..core.engine import EngineError
from ..engine import design_transfer, polls
from ..engine.layout import paragraph, show_job, show_outcome
from ..engine.operators import fail, start

SHARE = 0.58
"""Share of a line of the ledger that its text takes; the rest has room for `0.253 µW/mm²`."""

TITLE = "Tracing light"


class OPTISENSE_PG_ledger(bpy.types.PropertyGroup):
    """Last ledger; never saved."""

    groups: StringProperty(
        description="Light ledger of the light groups as JSON", options={"SKIP_SAVE"}
    )
    places: StringProperty(description="Light at points of the skin as JSON", options={"SKIP_SAVE"})


class OPTISENSE_OT_ledger(polls.Asking, bpy.types.Operator):
    """Trace the light of each group and list where it goes; for a selected contact, also list which
    light reaches its place"""

    bl_idname = "optisense.ledger"
    bl_label = "Where the Light Goes"

    def execute(self, context: bpy.types.Context) -> set[str]:
        try:
            design = design_transfer.design(context.scene)
        except EngineError as error:
            return fail(self, error, TITLE)
        active = context.active_object
        at = []
        if active is not None and active.optisense.kind == "CONTACT" and active.select_get():
            held = active.evaluated_get(context.evaluated_depsgraph_get()).matrix_world
            at = [[round(value, 5) for value in held.translation]]
        return start(self, TITLE, "ledger", _take, design=design, at=at)


def _take(result: dict[str, Any]) -> None:
    values = bpy.context.window_manager.optisense_ledger
    values.groups = json.dumps(result["ledger"])
    values.places = json.dumps(result["places"])


def draw(layout: bpy.types.UILayout) -> None:
    """Draw the button, and the last ledger."""
    if not show_job(layout, TITLE):
        layout.operator("optisense.ledger", icon="LIGHT")
    show_outcome(layout, TITLE)
    values = bpy.context.window_manager.optisense_ledger
    if not values.groups:
        return
    box = layout.box()
    for title, lines in core.group_rows(json.loads(values.groups)):
        paragraph(box, title, "LIGHT_POINT", boxed=True)
        column = box.column(align=True)
        column.scale_y = 0.8
        for text, share in lines:
            row = column.split(factor=SHARE, align=True)
            row.label(text=text)
            row.label(text=share)
    for place in json.loads(values.places):
        for line in core.place_text(place):
            paragraph(box, line, "PINNED", boxed=True)


PROPERTIES = {"WindowManager": {"optisense_ledger": OPTISENSE_PG_ledger}}

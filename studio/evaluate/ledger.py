"""Light ledger: where the light of each group goes, and which light reaches a chosen place."""

from __future__ import annotations

import json
from typing import Any

import bpy
from bpy.props import BoolProperty, StringProperty

from ..core import ledger as core
from ..core.engine import EngineError
from ..engine import design_transfer, polls
from ..engine.layout import paragraph, show_job, show_outcome
from ..engine.operators import fail, start
from ..scene.results import OfScene
from ..scene.subject import Subject

SHARE = 0.58
"""Share of a line of the ledger that its text takes; the rest has room for `0.253 µW/mm²`."""

TITLE = "Tracing light"


class OPTISENSE_PG_ledger(OfScene, bpy.types.PropertyGroup):
    """Last ledger; never saved."""

    is_before: BoolProperty(
        description="Whether the ledger belongs to the sensor that was open before",
        options={"SKIP_SAVE"},
    )
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
        about = Subject(context.scene)
        return start(self, TITLE, "ledger", about.taking(take), subject=about, design=design, at=at)


def take(result: dict[str, Any], scene: bpy.types.Scene) -> None:
    """Replace the ledger in the panel by that of a scene's sensor."""
    values = bpy.context.window_manager.optisense_ledger
    values.is_before, values.scene = False, scene.session_uid
    values.groups = json.dumps(result["ledger"])
    values.places = json.dumps(result["places"])


def draw(layout: bpy.types.UILayout, scene: bpy.types.Scene) -> None:
    """Draw the button, and the last ledger; that of another sensor says so."""
    if not show_job(layout, TITLE):
        layout.operator("optisense.ledger", icon="LIGHT")
    show_outcome(layout, TITLE)
    values = bpy.context.window_manager.optisense_ledger
    if not values.groups:
        return
    box = layout.box()
    other = values.other_sensor(scene)
    if other:
        box.label(text=f"Light of the {other}", icon="INFO")
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

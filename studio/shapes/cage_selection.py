"""Selection of cages in a list; in the view, clickable cages would cover lights."""

from __future__ import annotations

import bpy
from bpy.props import StringProperty

from ..engine import polls
from ..engine.operators import refuse
from ..scene.cages import show_idle
from ..scene.collections import object_of, select_only


class OPTISENSE_OT_select_cage(polls.Arranging, bpy.types.Operator):
    """Select this cage"""

    bl_idname = "optisense.select_cage"
    bl_label = "Select Cage"
    bl_options = {"REGISTER", "UNDO"}

    cage: StringProperty(name="Cage", description="Name of the cage in the design")

    def execute(self, context: bpy.types.Context) -> set[str]:
        found = object_of(context.scene, "CAGE", self.cage)
        if found is None or found.name not in context.view_layer.objects:
            return refuse(self, f"There is no cage '{self.cage}' in this view")
        found.hide_set(False)
        context.view_layer.objects.active = found
        show_idle(context.scene)
        select_only(found)
        return {"FINISHED"}

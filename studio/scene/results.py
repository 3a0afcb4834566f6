"""Results that the panels show for one of several scenes."""

from __future__ import annotations

import bpy
from bpy.props import IntProperty


class OfScene:
    """Mixin of the property groups of results, which belong to the sensor of one scene."""

    is_before: bool
    scene: IntProperty(
        description="Session id of the scene to whose sensor the result belongs",
        options={"SKIP_SAVE"},
    )

    def is_of(self, scene: bpy.types.Scene) -> bool:
        """Return whether the result belongs to the sensor of a scene, present or earlier."""
        return self.scene == scene.session_uid

    def other_sensor(self, scene: bpy.types.Scene) -> str:
        """Return which sensor the result belongs to, in words; empty for that of a scene."""
        if self.is_of(scene) and not self.is_before:
            return ""
        others = [each.name for each in bpy.data.scenes if each != scene and self.is_of(each)]
        return f"sensor of the scene '{others[0]}'" if others else "sensor that was open before"

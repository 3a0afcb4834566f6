"""Synchronisation of the list of light groups with the selected lights."""

from __future__ import annotations

import bpy

from ..scene.collections import objects_of, select_only
from ..scene.properties import when_group_chosen

_following = False


def lights_of(scene: bpy.types.Scene, group: str) -> list[bpy.types.Object]:
    """Return the lights of a group in the order of the design file."""
    return [each for each in objects_of(scene, "LIGHT") if each.optisense.group == group]


def _select(scene: bpy.types.Scene, index: int) -> None:
    """Select the lights of the group that was chosen in the list."""
    groups = scene.optisense.light_groups
    if not _following and bpy.context.mode == "OBJECT" and 0 <= index < len(groups):
        lights = lights_of(scene, groups[index].name)
        if lights:
            select_only(*lights)


@bpy.app.handlers.persistent
def _follow(scene: bpy.types.Scene, *_: object) -> None:
    """Choose the group of the light that was selected in the view."""
    global _following
    active = bpy.context.view_layer.objects.active if bpy.context.view_layer else None
    if active is None or active.optisense.kind != "LIGHT" or not active.select_get():
        return
    design = scene.optisense
    index = design.light_groups.find(active.optisense.group)
    if index < 0 or index == design.light_group_index:
        return
    _following = True
    try:
        design.light_group_index = index
    finally:
        _following = False


HOOKS = (
    (when_group_chosen, _select),
    (bpy.app.handlers.depsgraph_update_post, _follow),
)

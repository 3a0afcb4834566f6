"""Lookup of the objects that an error is about."""

from __future__ import annotations

import re

import bpy

from .collections import objects_of, select_only
from .contacts import pressing, sensing_surface
from .gather import part_names


def objects_at(
    scene: bpy.types.Scene, path: str, part: str, contact: int | None = None
) -> list[bpy.types.Object]:
    """Return the objects at a place in the design; empty if there are none.

    Args:
        path: dotted path, such as `lights.red.lights[0].position`; may be empty.
        part: name of the part in the error; may be empty.
        contact: number of the visible contact, from 0; None if the error is about none.
    """
    if contact is not None:
        return pressing(scene)[contact:][:1]
    light = re.match(r"lights\.([^.\[]+)(?:\.lights\[(\d+)\])?", path)
    if light:
        group = [e for e in objects_of(scene, "LIGHT") if e.optisense.group == light[1]]
        return group if light[2] is None else group[int(light[2]) :][:1]
    if path.partition(".")[0] == "camera":
        return objects_of(scene, "CAMERA")
    cage = re.match(r"cages\.([^.\[]+)", path)
    if cage:
        return [e for e in objects_of(scene, "CAGE") if e.optisense.key == cage[1]]
    if path.partition(".")[0] == "coating":
        surface = sensing_surface(scene)
        return [] if surface is None else [surface]
    material = re.match(r"materials\.([^.\[]+)", path)
    if material:
        return [e for e in objects_of(scene, "PART") if e.optisense.material == material[1]]
    found = part_names(scene).get(part)
    return [] if found is None else [found]


def select(found: list[bpy.types.Object]) -> list[bpy.types.Object]:
    """Select only these objects if any of them is visible, and return those that were selected.

    Objects that were hidden individually are shown again.
    """
    there = set(bpy.context.view_layer.objects)
    for each in found:
        if each in there and each.hide_get():
            each.hide_set(False)
    visible = [each for each in found if each in there and each.visible_get()]
    if visible:
        select_only(*visible)
    return visible

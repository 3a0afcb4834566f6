"""Lookup of the objects that an error is about."""

from __future__ import annotations

import re

import bpy

from .collections import objects_of, select_only
from .contacts import sensing_surface
from .subject import Subject


def objects_at(
    subject: Subject, path: str, part: str, contact: int | None = None
) -> list[bpy.types.Object]:
    """Return the objects at a place in a design that was sent; empty if there are none any more.

    Args:
        path: dotted path, such as `lights.red.lights[0].position`; may be empty.
        part: name of the part in the error; may be empty.
        contact: number of the visible contact, from 0; None if the error is about none.
    """
    scene = subject.scene
    if scene is None:
        return []
    if contact is not None:
        found = subject.contacts()[contact:][:1]
        return [each for each in found if each is not None and each.visible_get()]
    light = re.match(r"lights\.([^.\[]+)(?:\.lights\[(\d+)\])?", path)
    if light:
        group = light[1]
        return subject.lights(group) if light[2] is None else subject.light(group, int(light[2]))
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
    return subject.part(part)


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

"""Selection and visibility of objects by their names in the design, to be restored."""

from __future__ import annotations

from dataclasses import dataclass, field

import bpy

from .collections import objects_of

Name = tuple[str, str, int]
"""Identity of an object: its kind, its name or that of its group, and its number among objects with
both in common.
"""

KINDS = ("PART", "LIGHT", "CAMERA", "CAGE", "CONTACT", "REFERENCE")


@dataclass
class Looks:
    """Selection, active object and hidden objects, by their names in the design."""

    selected: set[Name] = field(default_factory=set)
    hidden: set[Name] = field(default_factory=set)
    active: Name | None = None


def looks_of(scene: bpy.types.Scene) -> Looks:
    """Return the selection and visibility of the objects of a scene's design."""
    layer, found = bpy.context.view_layer, Looks()
    for name, item in _named(scene).items():
        if item.name not in layer.objects:
            continue
        if item.select_get():
            found.selected.add(name)
        if item.hide_get():
            found.hidden.add(name)
        if item == layer.objects.active:
            found.active = name
    return found


def restore(scene: bpy.types.Scene, looks: Looks) -> None:
    """Restore selection and visibility for the objects of a scene's design."""
    layer = bpy.context.view_layer
    layer.update()  # The layer does not know new objects before the update.
    for name, item in _named(scene).items():
        if item.name not in layer.objects:
            continue
        item.hide_set(name in looks.hidden)
        item.select_set(name in looks.selected)
        if name == looks.active:
            layer.objects.active = item


def _named(scene: bpy.types.Scene) -> dict[Name, bpy.types.Object]:
    found: dict[Name, bpy.types.Object] = {}
    counts: dict[tuple[str, str], int] = {}
    for item in objects_of(scene, *KINDS):
        own = item.optisense
        key = (own.kind, own.group if own.kind == "LIGHT" else own.key)
        counts[key] = counts.get(key, -1) + 1
        found[(*key, counts[key])] = item
    return found

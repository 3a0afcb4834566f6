"""Copies of objects that were made in Blender: each becomes an object of its own."""

from __future__ import annotations

import bpy

from .cages import release
from .collections import next_order, objects_of
from .gather import part_names

NUMBERED = ("PART", "LIGHT", "CONTACT")
"""Kinds of objects of which a sensor may have several, in the order of their numbers. Copies of its
only camera are errors, and so are copies of cages, which would bend parts twice.
"""


def separate(scene: bpy.types.Scene) -> None:
    """Put copies behind all objects of their kind, and give those of parts names of their own; the
    object that is older is the original.
    """
    for kind in NUMBERED:
        known = set()
        for each in objects_of(scene, kind):
            own = each.optisense
            if own.order in known:
                own.order = next_order(scene, kind)
            known.add(own.order)
    for name, part in part_names(scene).items():
        own = part.optisense
        if own.key != name:
            own.source = own.source or own.key
            own.key = name


@bpy.app.handlers.persistent
def _came(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    if depsgraph.id_type_updated("COLLECTION"):  # objects came or went
        separate(scene)
        release(scene)


HOOKS = ((bpy.app.handlers.depsgraph_update_post, _came),)

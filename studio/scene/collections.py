"""Collections of Blender that hold the objects of a sensor design."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

import bpy

REFERENCE = "Reference"
OPTICAL_SYSTEM = "OpticalSystem"
CAGES = "Cages"
CONTACTS = "Contacts"
ALL = (REFERENCE, OPTICAL_SYSTEM, CAGES, CONTACTS)


def collection(scene: bpy.types.Scene, name: str) -> bpy.types.Collection:
    """Return the scene's collection with a name; create it if it does not exist."""
    for child in scene.collection.children_recursive:
        if child.name.split(".")[0] == name:
            return child
    made = bpy.data.collections.new(name)
    scene.collection.children.link(made)
    return made


def objects_of(scene: bpy.types.Scene, *kinds: str) -> list[bpy.types.Object]:
    """Return the scene's objects of some kinds, in the order of the design file; a copy made in
    Blender comes after its original.
    """
    found = [each for each in scene.objects if each.optisense.kind in kinds]
    return sorted(found, key=lambda each: (each.optisense.order, each.session_uid))


def is_edited(depsgraph: bpy.types.Depsgraph, *kinds: str) -> bool:
    """Return whether an update of Blender's dependency graph concerns an object of some kinds."""
    items = (update.id.original for update in depsgraph.updates)
    return any(
        isinstance(item, bpy.types.Object) and item.optisense.kind in kinds for item in items
    )


def object_of(scene: bpy.types.Scene, kind: str, key: str) -> bpy.types.Object | None:
    """Return the object of a kind that represents the part, cage or group member called `key`."""
    return next((each for each in objects_of(scene, kind) if each.optisense.key == key), None)


def select_only(*chosen: bpy.types.Object) -> None:
    """Select only the given objects, and make the last one active; objects outside the view are
    skipped.

    Cages that can't be selected by a click are selected, too.
    """
    layer = bpy.context.view_layer  # The context of a timer has no selected objects.
    for each in layer.objects:
        each.select_set(False)
    for each in chosen:
        with contextlib.suppress(RuntimeError):  # its collection is excluded from the view
            each.hide_select = False
            each.select_set(True)
            layer.objects.active = each


def next_order(scene: bpy.types.Scene, kind: str) -> int:
    """Return an order number greater than those of all objects of a kind."""
    return max((each.optisense.order for each in objects_of(scene, kind)), default=-1) + 1


def clear(scene: bpy.types.Scene, *but: str) -> None:
    """Remove the design from a scene: its objects, except some kinds, and data they alone used.

    Objects that another scene shows, too, stay there; the scene gets copies of those to keep.
    """
    _leave_shared(scene, but)
    for each in [one for one in _ours(scene) if one.optisense.kind not in but]:
        data = each.data
        if len(each.users_scene) > 1:
            for holder in (scene.collection, *scene.collection.children_recursive):
                if each.name in holder.objects:
                    holder.objects.unlink(each)
            continue
        bpy.data.objects.remove(each, do_unlink=True)
        if data is not None and data.users == 0:
            if isinstance(data, bpy.types.Mesh):
                bpy.data.meshes.remove(data)
            elif isinstance(data, bpy.types.Camera):
                bpy.data.cameras.remove(data)
            elif isinstance(data, bpy.types.Curve):
                bpy.data.curves.remove(data)


def _leave_shared(scene: bpy.types.Scene, but: tuple[str, ...]) -> None:
    """Unlink the collections of the design that a linked copy of the scene shares with it."""
    others = {
        child
        for other in bpy.data.scenes
        if other != scene
        for child in other.collection.children_recursive
    }
    if not others.intersection(scene.collection.children_recursive):
        return
    kept = [each for each in _ours(scene) if each.optisense.kind in but]
    parents = [scene.collection]
    while parents:
        parent = parents.pop()
        for child in list(parent.children):
            if child not in others:
                parents.append(child)
            elif any(each.optisense.kind != "NONE" for each in child.all_objects) or (
                child.name.split(".")[0] in ALL
            ):
                parent.children.unlink(child)
    for each in kept:
        if each.name not in scene.objects:
            copy = each.copy()
            if each.data is not None:
                copy.data = each.data.copy()
            place = CONTACTS if each.optisense.kind == "CONTACT" else REFERENCE
            collection(scene, place).objects.link(copy)


def _ours(scene: bpy.types.Scene) -> Iterator[bpy.types.Object]:
    for each in scene.objects:
        if each.optisense.kind != "NONE":
            yield each

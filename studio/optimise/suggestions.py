"""Suggestions for parameters of the selected object that a search may change."""

from __future__ import annotations

import bpy

from ..core import schema, search_parameters
from ..engine import catalogue
from ..scene.cages import cage_data
from ..scene.collections import objects_of
from ..scene.gather import part_names


def suggestions(context: bpy.types.Context) -> list[search_parameters.Suggestion]:
    """Return suggestions for parameters of the active object."""
    active = context.active_object
    own = None if active is None else active.optisense
    if own is None:
        return []
    if own.kind == "CAMERA":
        return search_parameters.for_camera(own.model, _names("camera"))
    if own.kind == "LIGHT":
        return _of_light(context.scene, active)
    if own.kind == "PART":
        return _of_part(context.scene, active)
    if own.kind == "CAGE":
        return _of_cage(active)
    return []


def _names(kind: str) -> list[str]:
    """Return the names of the library's entries of a kind; empty until the engine has answered."""
    return [row["name"] for row in catalogue.entries(kind)]


def _of_light(
    scene: bpy.types.Scene, light: bpy.types.Object
) -> list[search_parameters.Suggestion]:
    group = scene.optisense.light_groups.get(light.optisense.group)
    if group is None:
        return []
    lights = [e for e in objects_of(scene, "LIGHT") if e.optisense.group == group.name]
    models = _names("light") if group.kind_name == "library" else []
    return search_parameters.for_light(
        group.name, lights.index(light), flux=group.flux, model=group.model, models=models
    )


def _of_part(scene: bpy.types.Scene, part: bpy.types.Object) -> list[search_parameters.Suggestion]:
    own, design = part.optisense, scene.optisense
    name = next(key for key, each in part_names(scene).items() if each == part)
    caged = {key for cage in objects_of(scene, "CAGE") for key in cage_data(cage)["parts"]}
    pose = [] if name in caged else search_parameters.for_pose(name)
    if own.role == "sensing_surface":
        coating = design.coating
        made = search_parameters.for_surface(
            coating.library, _names("coating"), coating.field_values(), coating.field_rows()
        )
        return [*made, *pose]
    material = design.materials.get(own.material)
    fitting = schema.materials_of(own.role)
    choices = [row["name"] for row in catalogue.entries("material") if row.get("kind") in fitting]
    made = search_parameters.for_material(
        name,
        own.material,
        {} if material is None else material.field_values(),
        {} if material is None else material.field_rows(),
        choices,
    )
    return [*made, *pose]


def _of_cage(cage: bpy.types.Object) -> list[search_parameters.Suggestion]:
    chosen: list[int] = []
    if cage.mode == "EDIT":
        cage.update_from_editmode()
        chosen = [vertex.index for vertex in cage.data.vertices if vertex.select]
    blended = cage_data(cage).get("blend") is not None
    return search_parameters.for_cage(cage.optisense.key, chosen, blended=blended)

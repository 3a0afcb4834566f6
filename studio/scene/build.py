"""Construction of the scene of a design."""

from __future__ import annotations

import json
from typing import Any

import bpy

from ..core.mesh_file import Mesh
from .cages import add_cage
from .cameras import add_camera
from .collections import ALL, OPTICAL_SYSTEM, clear, collection, next_order
from .lamps import add_light
from .meshes import new_mesh
from .properties import USUAL_COATING

MILLIMETRE = 0.001
"""Length of the scene's unit, a millimetre, in metres."""


def build(
    scene: bpy.types.Scene,
    document: dict[str, Any],
    meshes: dict[str, Mesh],
    *,
    keep_others: bool = False,
) -> None:
    """Put a design into a scene, in place of the design in it.

    Args:
        scene: scene to fill; objects that belong to no design stay.
        document: contents of `design.yaml`.
        meshes: meshes of the parts at rest by name, mm.
        keep_others: keep the contacts, which then press on the new sensor, and the references.
    """
    clear(scene, *(["CONTACT", "REFERENCE"] if keep_others else []))
    scene.unit_settings.system = "METRIC"
    scene.unit_settings.scale_length = MILLIMETRE
    scene.unit_settings.length_unit = "MILLIMETERS"
    for name in ALL:
        collection(scene, name)
    design = scene.optisense
    design.document = json.dumps(document)
    design.title = document["name"]
    design.description = document.get("description") or ""
    _coating(design.coating, document["coating"])
    design.materials.clear()
    for name, values in document["materials"].items():
        add_material(design, name, values)
    for name, values in document["parts"].items():
        add_part(scene, name, values, meshes[name])
    design.light_groups.clear()
    for name, values in document["lights"].items():
        group = add_light_group(design, name, values)
        for pose in values["lights"]:
            add_light(scene, group, pose)
    if document.get("camera"):
        add_camera(scene, document["camera"])
    for name, values in (document.get("cages") or {}).items():
        add_cage(scene, name, values)


def _coating(coating: bpy.types.PropertyGroup, values: dict[str, Any]) -> None:
    coating.library = values.get("library") or ""
    coating.fill(values.get("kind", USUAL_COATING), values)


def set_coating(scene: bpy.types.Scene, values: dict[str, Any]) -> None:
    """Replace the coating of the sensing surface, for example by one of the library."""
    _coating(scene.optisense.coating, values)


def add_material(
    design: bpy.types.PropertyGroup, name: str, values: dict[str, Any]
) -> bpy.types.PropertyGroup:
    """Add a material, or replace the values of the one with that name."""
    material = design.materials.get(name) or design.materials.add()
    material.name = name
    material.fill(values["kind"], values)
    return material


def add_part(
    scene: bpy.types.Scene, key: str, values: dict[str, Any], mesh: Mesh
) -> bpy.types.Object:
    """Add an object for a part."""
    part = bpy.data.objects.new(key, new_mesh(key, mesh))
    own = part.optisense
    own.order = next_order(scene, "PART")
    own.kind = "PART"
    own.key = key
    own.material = values.get("material") or ""
    own.priority = values.get("priority", 0)
    own.mesh_file = values["mesh"]
    collection(scene, OPTICAL_SYSTEM).objects.link(part)
    own.role = values["role"]  # its update holds the contacts on a new sensing surface
    return part


def add_light_group(
    design: bpy.types.PropertyGroup, name: str, values: dict[str, Any]
) -> bpy.types.PropertyGroup:
    """Add a light group without lights."""
    group = design.light_groups.add()
    group.name = name
    group.model = values["model"]
    group.colour = values["colour"]
    group.flux = values["flux"]
    emitter = values.get("emitter")
    if emitter:
        group.fill(emitter["kind"], emitter)
    return group

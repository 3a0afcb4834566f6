"""Conversion of a scene to its design; unchanged numbers stay as they were read."""

from __future__ import annotations

import json
import re
from pathlib import PurePosixPath
from typing import Any

import bpy

from ..core import provenance
from ..core.errors import SceneError
from ..core.mesh_file import Mesh
from ..core.numbers import kept, kept_list
from .cages import cage_values
from .cameras import camera_values
from .collections import objects_of
from .fields import NOT_FIELDS
from .lamps import light_pose
from .meshes import part_mesh
from .properties import USUAL_COATING

HAVE_FACES = ("elastomer", "support")
"""Roles of parts whose faces can be frosted or painted."""


def gather(scene: bpy.types.Scene) -> tuple[dict[str, Any], dict[str, Mesh]]:
    """Return the design of a scene: the contents of `design.yaml`, and the meshes of the parts at
    rest by name.

    Raises:
        SceneError: the scene holds no design, or one that can't be written.
    """
    document = gather_document(scene)
    caged = caged_parts(document)
    parts = part_names(scene)
    return document, {name: part_mesh(part, caged=name in caged) for name, part in parts.items()}


def caged_parts(document: dict[str, Any]) -> set[str]:
    """Return the names of the parts that are in cages."""
    return {name for cage in document["cages"].values() for name in cage["parts"]}


def gather_document(scene: bpy.types.Scene) -> dict[str, Any]:
    """Return the contents of `design.yaml` for a scene, without the meshes of the parts.

    Raises:
        SceneError: the scene holds no design, or one that can't be written.
    """
    design = scene.optisense
    if not design.is_open:
        raise SceneError("there is no sensor in this scene; make or open one")
    document: dict[str, Any] = json.loads(design.document)
    before = json.loads(design.document)
    bpy.context.view_layer.update()
    document["name"] = design.title
    document["description"] = design.description
    document["coating"] = _coating(design.coating, before["coating"])
    document["materials"] = {
        each.name: material_values(each, before["materials"].get(each.name, {}))
        for each in design.materials
    }
    cages = _cages(scene)
    parts = part_names(scene)
    for cage in cages.values():
        cage["parts"] = [name for name in cage["parts"] if name in parts]
    document["cages"] = {name: cage for name, cage in cages.items() if cage["parts"]}
    document["parts"] = {name: _part(name, part, before["parts"]) for name, part in parts.items()}
    _own_files(document["parts"], parts)
    if not parts:
        raise SceneError("the sensor has no part; add CAD files in Shapes", "parts")
    document["lights"] = _lights(scene, before["lights"])
    if not document["lights"]:
        raise SceneError("the sensor has no light; add one in Lights and Camera", "lights")
    camera = camera_values(scene)
    if camera is None:
        raise SceneError("the sensor has no camera; add one in Lights and Camera", "camera")
    document["camera"] = camera
    if "provenance" in before:
        document["provenance"] = provenance.updated(before, document)
    return document


def _cages(scene: bpy.types.Scene) -> dict[str, Any]:
    """Return the cages; copies made in Blender are refused, as they would bend parts twice."""
    cages: dict[str, Any] = {}
    for each in objects_of(scene, "CAGE"):
        key = each.optisense.key
        if key in cages:
            raise SceneError(f"two cages are called '{key}'; delete one of them", f"cages.{key}")
        cages[key] = cage_values(each)
    return cages


def _own_files(values: dict[str, Any], parts: dict[str, bpy.types.Object]) -> None:
    """Give parts whose meshes are different objects different files."""
    owners: dict[str, str] = {}
    for name in parts:
        file = values[name]["mesh"]
        file = str(PurePosixPath(file).with_suffix(".obj"))
        if owners.setdefault(file.casefold(), name) != name:
            file = f"meshes/{name}.obj"
            owners[file.casefold()] = name
        values[name]["mesh"] = file


def part_names(scene: bpy.types.Scene) -> dict[str, bpy.types.Object]:
    """Return the parts by their names in the design; a copy made in Blender gets a name that no
    part has.
    """
    parts = objects_of(scene, "PART")
    taken = {part.optisense.key for part in parts}
    found: dict[str, bpy.types.Object] = {}
    for part in parts:
        name = part.optisense.key
        if not name or name in found:
            name = free_name(part.name, taken | found.keys())
        found[name] = part
    return found


def free_name(wanted: str, taken: Any, instead: str = "part") -> str:
    """Return a name that the design file allows and that is not taken.

    Args:
        wanted: desired name, of any characters.
        taken: names in use, any container that supports `in`.
        instead: name to use if no character of `wanted` is allowed.
    """
    base = re.sub(r"[^A-Za-z0-9_-]+", "-", wanted).strip("-_")[:58] or instead
    name, number = base, 2
    while name in taken:
        name, number = f"{base}-{number}", number + 1
    return name


def _coating(coating: bpy.types.PropertyGroup, before: dict[str, Any]) -> dict[str, Any]:
    values: dict[str, Any] = {"library": coating.library} if coating.library else {}
    if coating.kind_name != USUAL_COATING:
        values["kind"] = coating.kind_name
    found = coating.gathered({"kind": USUAL_COATING, **before})
    return values | {name: each for name, each in found.items() if name not in NOT_FIELDS}


def coating_values(scene: bpy.types.Scene) -> dict[str, Any]:
    """Return the coating of a scene's design as for the design file."""
    before = json.loads(scene.optisense.document)["coating"]
    return _coating(scene.optisense.coating, before)


def material_values(
    material: bpy.types.PropertyGroup, before: dict[str, Any] | None = None
) -> dict[str, Any]:
    """Return a material as for the design file."""
    return {"kind": material.kind_name, **material.gathered(before or {})}


def _part(name: str, part: bpy.types.Object, before: dict[str, Any]) -> dict[str, Any]:
    """Return a part; its thickness, and frosted and painted faces, are as in the design file."""
    own = part.optisense
    values: dict[str, Any] = {"role": own.role, "mesh": own.mesh_file}
    if name != own.key or not own.mesh_file:
        values["mesh"] = f"meshes/{name}.obj"
    if own.material and own.role != "sensing_surface":
        values["material"] = own.material
    values["priority"] = own.priority
    known = before.get(own.source or own.key, {})
    if known.get("thickness") is not None:
        values["thickness"] = known["thickness"]
    faces = known.get("faces")
    if faces is not None and own.role in HAVE_FACES:
        values["faces"] = faces
    return values


def _lights(scene: bpy.types.Scene, before: dict[str, Any]) -> dict[str, Any]:
    lights = objects_of(scene, "LIGHT")
    groups: dict[str, Any] = {}
    for light in lights:
        name = light.optisense.group
        if name not in scene.optisense.light_groups:
            raise SceneError(
                f"light '{light.name}' is of a group '{name}' that this sensor does not have; use "
                "Move to Group",
                f"lights.{name}",
            )
    for group in scene.optisense.light_groups:
        members = [each for each in lights if each.optisense.group == group.name]
        if not members:
            continue
        poses = [_pose(each, number) for number, each in enumerate(members)]
        was = before.get(group.name, {})
        values: dict[str, Any] = {
            "model": group.model,
            "colour": kept_list(was.get("colour"), group.colour),
            "flux": kept(was.get("flux"), group.flux),
        }
        emitter = emitter_values(group, was.get("emitter"))
        if emitter is not None:
            values["emitter"] = emitter
        if was.get("spectrum") is not None:
            values["spectrum"] = was["spectrum"]
        groups[group.name] = {**values, "lights": poses}
    return groups


def _pose(light: bpy.types.Object, number: int) -> dict[str, Any]:
    """Return the pose of a light with a given number in its group."""
    try:
        return light_pose(light)
    except ValueError as error:
        path = f"lights.{light.optisense.group}.lights[{number}]"
        raise SceneError(f"light '{light.name}' {error}", path) from error


def emitter_values(
    group: bpy.types.PropertyGroup, was: dict[str, Any] | None = None
) -> dict[str, Any] | None:
    """Return a group's own emitter as for the design file; None if it uses the library's."""
    if group.kind_name == "library":
        return None
    return {"kind": group.kind_name, **group.gathered(was or {})}

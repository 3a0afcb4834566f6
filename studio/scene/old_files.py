"""Conversion of Blender files of older versions, in which lamps and materials had fixed properties.

Blender keeps such values in the file, as numbers and texts without a description.
"""

from __future__ import annotations

import json
from typing import Any

import bpy

EMITTERS = ("library", "area", "ies", "spot")
MATERIALS = ("dielectric", "conductor", "diffuse", "absorber")
"""Kinds of those versions, in the order of their numbers in the file."""

FIELDS: dict[str, dict[str, Any]] = {
    "area": {"shape": 0, "size": [2.0, 2.0]},
    "ies": {"file": ""},
    "spot": {"beam": 30.0, "cutoff": 45.0},
    "dielectric": {"ior": 1.5, "roughness": 0.0, "dispersion": [1.5] * 3},
    "conductor": {"eta": [1.0] * 3, "k": [0.0] * 3, "roughness": 0.0},
    "diffuse": {"reflectance": [0.5] * 3},
    "absorber": {},
    "flake": {"reflectance": [0.5] * 3, "eta": [1.0] * 3, "k": [0.0] * 3, "specularity": 0.0},
}
"""Properties of those versions, with the values of properties that were never changed."""

SHAPES = ("disc", "rectangle")


def bring_up_to_date(scene: bpy.types.Scene) -> None:
    """Convert the fixed properties of a scene's design to fields of its kinds."""
    design = scene.optisense
    if not design.is_open or design.coating.fields:
        return
    document = json.loads(design.document)
    if "kind" not in document["coating"]:
        design.coating.fill("flake", _old(design.coating, "flake"))
    for material in design.materials:
        kind = MATERIALS[material.get("kind", 0)]
        values = _old(material, kind)
        if not material.get("has_dispersion", False):
            values.pop("dispersion", None)
        material.fill(kind, values)
    for group in design.light_groups:
        kind = EMITTERS[group.get("emitter", 0)]
        values = _old(group, kind) if kind != "library" else {}
        if "shape" in values:
            values["shape"] = SHAPES[values["shape"]]
        group.fill(kind, values)


def _old(owner: bpy.types.PropertyGroup, kind: str) -> dict[str, Any]:
    found = {}
    for name, usual in FIELDS[kind].items():
        value = owner.get(name, usual)
        found[name] = list(value) if isinstance(usual, list) else value
    return found


@bpy.app.handlers.persistent
def _loaded(*_: Any) -> None:
    for scene in bpy.data.scenes:
        bring_up_to_date(scene)


HOOKS = ((bpy.app.handlers.load_post, _loaded),)

"""Operators that read meshes, and assign their use."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import numpy as np
from bpy.props import EnumProperty, FloatProperty

from ..core.mesh_file import Mesh
from ..engine import polls, session
from ..engine.operators import ChoosingProperties, refuse, start
from ..scene import kinds
from ..scene.build import add_material, add_part
from ..scene.collections import REFERENCE, collection, select_only
from ..scene.contacts import add_contact, sensing_surface, tree_of
from ..scene.gather import free_name, part_names
from ..scene.meshes import new_mesh, part_mesh
from ..scene.subject import scene_of
from ..sensor.cad import ChoosingFiles

READING = "Reading the mesh"
"""Title under which messages are shown beside the button that was pressed."""

PLACES = ("camera", "light")
"""References at which lights and the camera are placed; the other references become parts."""

FIRST_MATERIAL: dict[str, tuple[str, dict[str, Any]]] = {
    "elastomer": ("silicone", {"kind": "dielectric", "ior": 1.41, "roughness": 0.0}),
    "support": ("acrylic", {"kind": "dielectric", "ior": 1.491, "roughness": 0.0}),
    "interface": ("acrylic", {"kind": "dielectric", "ior": 1.491, "roughness": 0.0}),
    "mirror": (
        "mirror-aluminium",
        {
            "kind": "conductor",
            "eta": [1.43, 0.922, 0.686],
            "k": [7.508, 6.373, 5.635],
            "roughness": 0.0,
        },
    ),
}
"""Material of a new part by role, until the user chooses one: silicone (1.41), PMMA (1.491), and
aluminium (the index of the diffuse-grey coating's flake); a blocker absorbs.
"""


class OPTISENSE_OT_add_mesh(polls.Replacing, ChoosingFiles, bpy.types.Operator):
    """Read the selected CAD files (STEP, STL, OBJ, PLY) into the collection Reference"""

    bl_idname = "optisense.add_mesh"
    bl_label = "Add CAD Files"
    bl_options = {"REGISTER"}

    scale: FloatProperty(
        name="Scale",
        description="Factor from the units of the file to mm: 1000 for metres, 25.4 for inches",
        min=1e-6,
        max=1e6,
        default=1.0,
    )

    def execute(self, context: bpy.types.Context) -> set[str]:
        if not (self.filepath.strip() or self.directory.strip()):
            return refuse(self, "Name a file first")
        paths, number, scale = self.paths(), context.scene.session_uid, self.scale

        def read(result: dict[str, Any]) -> None:
            scene = scene_of(number)
            if scene is not None:
                made = [
                    _bring(scene, each, 1.0 if each["own_units"] else scale)
                    for each in result["bodies"]
                ]
                select_only(*made)
                session.push_undo(f"Add {', '.join(Path(path).name for path in paths)}")

        # A large file takes a while.
        return start(self, READING, "cad", read, files=paths, units="mm", name="meshes")


def _bring(scene: bpy.types.Scene, body: dict[str, Any], scale: float) -> bpy.types.Object:
    """Put a body that the engine has read into the collection Reference."""
    files, name = body["mesh"], body["name"]
    vertices = np.load(files["vertices"]).astype(np.float64) * scale
    mesh = Mesh(vertices, np.load(files["faces"]).astype(np.int32))
    item = bpy.data.objects.new(name, new_mesh(name, mesh))
    item.optisense.kind = "REFERENCE"
    use = {"lights": "light", "nothing": "blocker"}.get(body["use"], body["use"])
    item.optisense.reference = use
    item.color = (0.6, 0.6, 0.6, 0.5)
    collection(scene, REFERENCE).objects.link(item)
    return item


class OPTISENSE_OT_set_reference(polls.Checked, ChoosingProperties, bpy.types.Operator):
    """Set the use of the selected meshes; all but camera and light references become parts"""

    bl_idname = "optisense.set_reference"
    bl_label = "Set as Reference"
    bl_options = {"REGISTER", "UNDO"}

    reference: EnumProperty(
        name="Reference", items=kinds.REFERENCES, description="Use of the selected meshes"
    )

    checks = (
        polls.has_design,
        polls.in_object_mode,
        polls.requires(
            lambda c: _meshes(c), "Select a mesh first that is no part of the sensor yet"
        ),
    )

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        self.reference = _meshes(context)[0].optisense.reference  # as its name was understood
        return context.window_manager.invoke_props_dialog(self)

    def execute(self, context: bpy.types.Context) -> set[str]:
        scene = context.scene
        items = _meshes(context)
        empty = [each.name for each in items if not each.data.polygons]
        if empty and self.reference not in PLACES:
            return refuse(self, f"There is no face in {', '.join(empty)}")
        made = []
        for item in items:
            _into(scene, item, REFERENCE)
            item.optisense.kind = "REFERENCE"
            item.optisense.reference = self.reference
            if self.reference == "indenter":
                _press(self, scene, item)
            elif self.reference not in PLACES:
                made.append(make_part(scene, item, self.reference))
                item.hide_set(True)
        if made:
            select_only(*made)
        return {"FINISHED"}


def _meshes(context: bpy.types.Context) -> list[bpy.types.Object]:
    """Return the selected meshes that are not part of the sensor."""
    found = polls.picked(context, "NONE", "REFERENCE")
    return [each for each in found if each.type == "MESH"]


def _into(scene: bpy.types.Scene, item: bpy.types.Object, name: str) -> None:
    target = collection(scene, name)
    for each in list(item.users_collection):
        if each != target:
            each.objects.unlink(item)
    if item.name not in target.objects:
        target.objects.link(item)


def make_part(scene: bpy.types.Scene, item: bpy.types.Object, role: str) -> bpy.types.Object:
    """Add a part of the sensor with the shape of a reference and the usual material of its role."""
    design = scene.optisense
    key = free_name(item.name, part_names(scene))
    values: dict[str, Any] = {"role": role, "mesh": f"meshes/{key}.obj"}
    if role in FIRST_MATERIAL:
        name, material = FIRST_MATERIAL[role]
        if name not in design.materials:
            add_material(design, name, material)
        values["material"] = name
    return add_part(scene, key, values, part_mesh(item, caged=False))


def _press(operator: bpy.types.Operator, scene: bpy.types.Scene, item: bpy.types.Object) -> None:
    """Add a contact with the present shape of a mesh; it is pressed in along the mesh's z axis."""
    surface = sensing_surface(scene)
    if surface is None:
        operator.report({"WARNING"}, "There is no sensing surface to press on")
        return
    point, normal, *_ = tree_of(surface).find_nearest((0.0, 0.0, 0.0))
    if point is not None:
        contact = add_contact(scene, tuple(point), tuple(-normal))
        contact.optisense.shape = new_mesh(item.name, part_mesh(item, caged=False))
        contact.optisense.indenter = "mesh"


class OPTISENSE_OT_remove_part(polls.Checked, bpy.types.Operator):
    """Take the selected parts out of the sensor; their references stay"""

    bl_idname = "optisense.remove_part"
    bl_label = "Remove from Sensor"
    bl_options = {"REGISTER", "UNDO"}

    checks = (polls.in_object_mode, polls.selecting("PART", what="a part"))

    def execute(self, context: bpy.types.Context) -> set[str]:
        for each in polls.picked(context, "PART"):
            bpy.data.objects.remove(each)
        return {"FINISHED"}


class OPTISENSE_OT_flip(polls.Checked, bpy.types.Operator):
    """Turn the selected surfaces around: a sensing surface must face into the sensor"""

    bl_idname = "optisense.flip"
    bl_label = "Flip Normals"
    bl_options = {"REGISTER", "UNDO"}

    checks = (polls.in_object_mode, polls.selecting("PART", "REFERENCE", what="a part"))

    def execute(self, context: bpy.types.Context) -> set[str]:
        for each in polls.picked(context, "PART", "REFERENCE"):
            if each.type == "MESH":
                each.data.flip_normals()
                each.data.update()
        return {"FINISHED"}

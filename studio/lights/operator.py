"""Add lights and the camera, and choose their models from the library."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from bpy.props import (
    BoolProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    StringProperty,
)
from mathutils import Vector

from ..core.engine import EngineError
from ..core.pose import unit
from ..core.rows import row_on_face
from ..engine import catalogue, polls, session
from ..engine.layout import labelled
from ..engine.operators import ChoosingProperties, refuse
from ..scene.build import add_light_group
from ..scene.cameras import add_camera, imaging
from ..scene.collections import objects_of, select_only
from ..scene.gather import free_name
from ..scene.lamps import add_light, lamp_colour, redraw, window
from ..scene.world import world_matrix
from .windows import ask_for_windows


def _light_models(operator: Any, context: bpy.types.Context | None) -> catalogue.Items:
    return catalogue.items("light")


def _camera_models(operator: Any, context: bpy.types.Context | None) -> catalogue.Items:
    return catalogue.items("camera")


def _groups(operator: Any, context: bpy.types.Context | None) -> catalogue.Items:
    global _group_items
    scene = bpy.context.scene if context is None else context.scene
    names = [group.name for group in scene.optisense.light_groups]
    _group_items = [("NEW", "A new group", "")] + [(name, name, "") for name in names]
    return _group_items


_group_items: catalogue.Items = []

USUAL_LAMP = "smd-3528"
"""Lamp with which a new group begins: a common, small LED."""

USUAL_PITCH, GAP = 4.0, 0.5
"""Distances in mm: pitch of lamps of unknown size, and gap between lamps of known size; placement
machines need less.
"""

WAYS = {
    "PLUS_X": (1.0, 0.0, 0.0),
    "MINUS_X": (-1.0, 0.0, 0.0),
    "PLUS_Y": (0.0, 1.0, 0.0),
    "MINUS_Y": (0.0, -1.0, 0.0),
    "PLUS_Z": (0.0, 0.0, 1.0),
    "MINUS_Z": (0.0, 0.0, -1.0),
}
"""Unit vectors of the axes, by the names of the choices."""

AIMS = [
    ("SURFACE", "Sensing surface", "At the middle of the sensing surface"),
    *(
        (name, f"{'+' if name[0] == 'P' else '-'}{name[-1].lower()}", "Along this axis")
        for name in WAYS
    ),
]
"""Directions that new lights can be aimed in."""

SOLID = 1e-3
"""Share of the total area below which the sum of the faces' area vectors counts as zero: then the
surface is closed, and has no facing direction.
"""


class OPTISENSE_OT_add_light(polls.Arranging, ChoosingProperties, bpy.types.Operator):
    """Add a row of lights on the selected light reference, or one at the 3D cursor"""

    bl_idname = "optisense.add_light"
    bl_label = "Add Light"
    bl_options = {"REGISTER", "UNDO"}

    model: EnumProperty(
        name="Model", items=_light_models, description="Lamp of the library for the new group"
    )
    group: EnumProperty(
        name="Group", items=_groups,
        description="Group of the new lights; all lights of a group have the same model, colour "
        "and flux",
    )  # fmt: skip
    name: StringProperty(
        name="Name of a new group", default="white",
        description="Letters, digits, - and _; a number is appended if a group already has this "
        "name",
    )  # fmt: skip
    colour: FloatVectorProperty(
        name="Colour of a new group", size=3, min=0.0, max=1.0, subtype="COLOR",
        default=(1.0,) * 3,
        description="Shares of the flux in red, green and blue; only their ratios matter",
    )  # fmt: skip
    flux: FloatProperty(
        name="Flux of a new group (mW)", min=0.0, max=1e6, default=2.0,
        description="Radiant flux of each light, mW",
    )  # fmt: skip
    count: IntProperty(
        name="Count", min=1, max=1000, default=1, description="Number of lights in the row"
    )
    pitch: FloatProperty(
        name="Pitch (mm)", description="Distance between the centres of neighbouring lights, mm; "
        f"0 leaves a gap of {GAP:g} mm between the lamps",
        min=0.0, default=0.0,
    )  # fmt: skip
    place: FloatVectorProperty(
        name="Place (mm)", size=3, precision=3,
        description="Middle of the row, mm; used if no light reference is selected",
    )  # fmt: skip
    aim: EnumProperty(
        name="Aim", items=AIMS, default="SURFACE",
        description="Direction of the lights; used if no light reference is selected",
    )  # fmt: skip

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        models = [name for name, _, _ in _light_models(self, context)]
        if not self.properties.is_property_set("model") and USUAL_LAMP in models:
            self.model = USUAL_LAMP
        self.place = context.scene.cursor.location
        return context.window_manager.invoke_props_dialog(self, width=360)

    def draw(self, context: bpy.types.Context) -> None:
        column = labelled(self.layout)
        column.prop(self, "group")
        group = context.scene.optisense.light_groups.get(self.group)
        if group is None:
            for name in ("name", "model", "colour", "flux"):
                column.prop(self, name)
        else:
            column.label(text=f"{group.model}, {group.flux:g} mW, as the others of the group")
        column.prop(self, "count")
        column.prop(self, "pitch")
        references = _references(context, "light")
        if references:
            names = ", ".join(each.name for each in references)
            column.label(text=f"On the reference {names}", icon="PINNED")
        else:
            column.prop(self, "place")
            column.prop(self, "aim")

    def execute(self, context: bpy.types.Context) -> set[str]:
        scene = context.scene
        design = scene.optisense
        pitch = self.pitch or self._fitting_pitch(context)
        poses = self._poses(context, pitch)
        if not poses:
            return refuse(self, "The light reference has no vertices; select another mesh")
        if self.group in ("NEW", ""):
            if self.model in ("NONE", ""):
                return refuse(self, "The library is not loaded yet; try again in a moment")
            if max(self.colour) <= 0.0:
                return refuse(self, "A colour needs at least one channel above 0")
            name = free_name(self.name, design.light_groups, "light")
            values = {"model": self.model, "colour": self.colour, "flux": self.flux}
            group = add_light_group(design, name, values)
        else:
            group = design.light_groups[self.group]
        select_only(*(add_light(scene, group, pose) for pose in poses))
        ask_for_windows(scene)
        return {"FINISHED"}

    def _fitting_pitch(self, context: bpy.types.Context) -> float:
        """Return the pitch in mm: the larger side of the lamp's window, and a gap."""
        group = context.scene.optisense.light_groups.get(self.group)
        if self.count == 1:
            return USUAL_PITCH
        if group is not None:
            return max(window(group)[1]) + GAP
        try:
            found = session.ask_and_wait("lamp", entry=self.model)["window"]["size"]
        except EngineError:
            return USUAL_PITCH
        return max(found or (0.0,)) + GAP

    def _poses(self, context: bpy.types.Context, pitch: float) -> list[dict[str, Any]]:
        middle = _middle(context.scene)
        references = _references(context, "light")
        poses = []
        for reference in references:
            corners = np.array([world_matrix(reference) @ v.co for v in reference.data.vertices])
            if not len(corners):
                continue
            normal = _normal(reference, corners, middle)
            poses += row_on_face(corners, normal, np.array(middle), self.count, pitch)
        if not references:
            given = self.properties.is_property_set("place")
            start = Vector(self.place) if given else context.scene.cursor.location
            way = middle - start if self.aim == "SURFACE" else Vector(WAYS[self.aim])
            way = way.normalized() if way.length > 1e-6 else Vector((0.0, 0.0, 1.0))
            across = way.orthogonal().normalized()
            for number in range(self.count):
                shift = (number - (self.count - 1) / 2) * pitch
                place = start + across * shift
                position = [round(value, 4) for value in place]
                poses.append({"position": position, "direction": unit(way)})
        return poses


def _references(context: bpy.types.Context, what: str) -> list[bpy.types.Object]:
    """Return the selected reference objects for lights or the camera."""
    found = polls.picked(context, "REFERENCE")
    return [each for each in found if each.optisense.reference == what]


def _middle(scene: bpy.types.Scene) -> Vector:
    """Return the middle of the sensing surface, or the origin if there is none."""
    from ..scene.contacts import sensing_surface

    surface = sensing_surface(scene)
    if surface is None:
        return Vector()
    return world_matrix(surface) @ (sum((Vector(c) for c in surface.bound_box), Vector()) / 8.0)


def _normal(reference: bpy.types.Object, corners: np.ndarray, target: Vector) -> np.ndarray:
    """Return the area-weighted mean normal of a surface; of a closed one, the way to `target`."""
    faces = reference.data.polygons
    total = sum((face.normal * face.area for face in faces), Vector())
    if total.length > SOLID * sum(face.area for face in faces):
        return np.array(world_matrix(reference).to_3x3() @ total)
    way = np.array(target) - (corners.min(axis=0) + corners.max(axis=0)) / 2.0
    return way if np.linalg.norm(way) > 1e-9 else np.array((0.0, 0.0, 1.0))


class OPTISENSE_OT_add_camera(polls.Arranging, ChoosingProperties, bpy.types.Operator):
    """Replace the camera by one of the library, at the selected camera reference or the 3D
    cursor"""

    bl_idname = "optisense.add_camera"
    bl_label = "Add Camera"
    bl_options = {"REGISTER", "UNDO"}

    model: EnumProperty(
        name="Model", items=_camera_models,
        description="Camera of the library; its picture is first made at most 320 pixels wide",
    )  # fmt: skip
    imaging: BoolProperty(
        name="With Noise and Colours", default=False,
        description="Copy the library's data on lens, image sensor and image processing, "
        "such as noise, shading, colour matrix and tone curve; otherwise the camera is ideal",
    )  # fmt: skip

    def execute(self, context: bpy.types.Context) -> set[str]:
        scene = context.scene
        try:
            entry = session.ask_and_wait("entry", kind="camera", entry=self.model)["entry"]
        except EngineError as error:
            return refuse(self, error.text())
        references = _references(context, "camera")
        place = scene.cursor.location.copy()
        if references:
            box = (Vector(corner) for corner in references[0].bound_box)
            place = world_matrix(references[0]) @ (sum(box, Vector()) / 8.0)
        way = _middle(scene) - place
        if way.length < 1e-6:
            way = Vector((0.0, 0.0, 1.0))
        way.normalize()
        up = (0.0, 1.0, 0.0) if abs(way.y) < 0.9 else (1.0, 0.0, 0.0)
        width, height = entry["value"]["resolution"]
        scale = min(1.0, 320 / width)
        for each in objects_of(scene, "CAMERA"):
            bpy.data.objects.remove(each)
        camera = add_camera(
            scene,
            {
                "model": self.model,
                "projection": entry["value"].get("projection", "perspective"),
                "fov": entry["value"]["fov"],
                "resolution": [round(width * scale), round(height * scale)],
                "position": [round(value, 4) for value in place],
                "direction": unit(way),
                "up": list(up),
                **(imaging(entry["value"]) if self.imaging else {}),
            },
        )
        select_only(camera)
        return {"FINISHED"}


class OPTISENSE_OT_set_model(polls.Designing, bpy.types.Operator):
    """Use another lamp of the library for this group"""

    bl_idname = "optisense.set_model"
    bl_label = "Choose Lamp"
    bl_options = {"REGISTER", "UNDO"}
    bl_property = "model"

    model: EnumProperty(
        name="Model", items=_light_models, description="Lamp of the library for this group"
    )
    group: StringProperty(name="Group", description="Light group whose lamps are replaced")

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        context.window_manager.invoke_search_popup(self)
        return {"RUNNING_MODAL"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        group = context.scene.optisense.light_groups.get(self.group)
        if group is None or self.model in ("NONE", ""):
            return {"CANCELLED"}
        group.model = self.model
        group.drawn = ""
        group.change_kind("library")
        ask_for_windows(context.scene)
        return {"FINISHED"}


class OPTISENSE_OT_set_group(polls.Checked, ChoosingProperties, bpy.types.Operator):
    """Move the selected lights to another group"""

    bl_idname = "optisense.set_group"
    bl_label = "Move to Group"
    bl_options = {"REGISTER", "UNDO"}

    group: EnumProperty(
        name="Group",
        items=_groups,
        description="Group to move the lights to; a new group copies the group of the first light",
    )
    name: StringProperty(
        name="Name of a new group", default="white", description="Letters, digits, - and _"
    )

    checks = (polls.has_design, polls.selecting("LIGHT", what="lights"))

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Preselect a group that the selected lights are not all in."""
        names = [group.name for group in context.scene.optisense.light_groups]
        now = {each.optisense.group for each in polls.picked(context, "LIGHT")}
        others = [name for name in names if {name} != now]
        self.group = others[0] if others else "NEW"
        return context.window_manager.invoke_props_dialog(self)

    def draw(self, context: bpy.types.Context) -> None:
        column = labelled(self.layout)
        now = sorted({each.optisense.group for each in polls.picked(context, "LIGHT")})
        count = len(polls.picked(context, "LIGHT"))
        column.label(text=f"{count} light{'s' * (count != 1)} of {', '.join(now)}")
        column.prop(self, "group")
        if self.group in ("NEW", ""):
            column.prop(self, "name")

    def execute(self, context: bpy.types.Context) -> set[str]:
        design = context.scene.optisense
        lights = polls.picked(context, "LIGHT")
        if self.group in ("NEW", ""):
            old = design.light_groups.get(lights[0].optisense.group)
            values = {"model": USUAL_LAMP, "colour": (1.0, 1.0, 1.0), "flux": 2.0}
            if old is not None:
                values = {"model": old.model, "colour": old.colour[:], "flux": old.flux}
            group = add_light_group(
                design, free_name(self.name, design.light_groups, "light"), values
            )
        else:
            group = design.light_groups[self.group]
        for light in lights:
            light.optisense.group = group.name
            light.color = lamp_colour(group)
        redraw(context.scene, group)
        ask_for_windows(context.scene)
        return {"FINISHED"}


class OPTISENSE_OT_look_through(polls.Checked, bpy.types.Operator):
    """See the sensor through its own camera, as a pinhole in air"""

    bl_idname = "optisense.look_through"
    bl_label = "Look Through Camera"

    checks = (polls.in_3d_view, polls.has_design)

    def execute(self, context: bpy.types.Context) -> set[str]:
        cameras = objects_of(context.scene, "CAMERA")
        if not cameras:
            return refuse(self, "The sensor has no camera")
        context.scene.camera = cameras[0]
        context.space_data.region_3d.view_perspective = "CAMERA"
        return {"FINISHED"}

"""Operators that place contacts, simulate, and show the picture."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.props import BoolProperty
from bpy_extras import view3d_utils
from mathutils import Vector

from ..core.engine import EngineError
from ..engine import polls, session
from ..engine.operators import Starting, fail, refuse, start, start_with_design
from ..scene.collections import objects_of, select_only
from ..scene.contacts import add_contact, sensing_surface, tree_of
from ..scene.subject import Subject
from ..scene.world import world_matrix
from . import editors, picture, requests, viewing

SHAPE = (
    "radius", "length", "size", "file", "shape", "scale", "depth", "rotation", "indenter",
    "press_by", "force", "twist",
)  # fmt: skip
"""Properties of a contact that do not depend on its place."""


class OPTISENSE_OT_simulate(polls.Asking, Starting, bpy.types.Operator):
    """Make the picture that the sensor's camera would take"""

    bl_idname = "optisense.simulate"
    bl_label = "Simulate"

    wait: BoolProperty(
        name="Wait",
        description="Return only when the picture is ready; for scripts",
        default=True,
        options={"HIDDEN", "SKIP_SAVE"},
    )

    def start(self, context: bpy.types.Context, *, wait: bool) -> set[str]:
        try:
            fields = requests.fields(context.scene)
        except EngineError as error:
            return fail(self, error, "Simulating")
        subject = Subject(context.scene)

        def taken(result: dict[str, Any]) -> None:
            requests.take(result, subject, draft=False)

        return start(self, "Simulating", "simulate", taken, subject=subject, wait=wait, **fields)


class OPTISENSE_OT_show_picture(polls.Checked, bpy.types.Operator):
    """Show the picture in an Image Editor"""

    bl_idname = "optisense.show_picture"
    bl_label = "Open in Image Editor"

    checks = (
        polls.requires(lambda c: bpy.data.images.get(picture.IMAGE), "Simulate first"),
        editors.can_show,
    )

    def execute(self, context: bpy.types.Context) -> set[str]:
        editors.show(context, bpy.data.images[picture.IMAGE])
        viewing.refresh()
        return {"FINISHED"}


class OPTISENSE_OT_add_contact(polls.Arranging, bpy.types.Operator):
    """Press a ball on the middle of the sensing surface"""

    bl_idname = "optisense.add_contact"
    bl_label = "Add in the Middle"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        surface = sensing_surface(context.scene)
        if surface is None:
            return refuse(
                self, "There is no sensing surface; make one under Shapes (Make Sensing Surface)"
            )
        middle = sum((Vector(corner) for corner in surface.bound_box), Vector()) / 8.0
        point, normal, *_ = tree_of(surface).find_nearest(world_matrix(surface) @ middle)
        if point is None:
            return refuse(self, "The sensing surface has no faces; remove it and make another")
        _add(context, point, normal)
        return {"FINISHED"}


class OPTISENSE_OT_place_contact(polls.Checked, bpy.types.Operator):
    """Click on the sensing surface to press a ball there; Esc or right click ends"""

    bl_idname = "optisense.place_contact"
    bl_label = "Click to Place"
    bl_options = {"REGISTER", "UNDO"}

    checks = (polls.has_design, polls.in_object_mode, polls.in_3d_view)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        context.window_manager.modal_handler_add(self)
        context.window.cursor_modal_set("CROSSHAIR")
        context.workspace.status_text_set("Click on the sensing surface; Esc ends")
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if event.type in ("ESC", "RIGHTMOUSE"):
            return self._end(context, {"CANCELLED"})
        if event.type == "LEFTMOUSE" and event.value == "PRESS":
            if self._pick(context, event):
                return self._end(context, {"FINISHED"})
            return {"RUNNING_MODAL"}
        return {"PASS_THROUGH"}

    def _end(self, context: bpy.types.Context, result: set[str]) -> set[str]:
        context.window.cursor_modal_restore()
        context.workspace.status_text_set(None)
        return result

    def _pick(self, context: bpy.types.Context, event: bpy.types.Event) -> bool:
        region = next(each for each in context.area.regions if each.type == "WINDOW")
        place = (event.mouse_x - region.x, event.mouse_y - region.y)
        view = context.area.spaces.active.region_3d
        start = view3d_utils.region_2d_to_origin_3d(region, view, place)
        way = view3d_utils.region_2d_to_vector_3d(region, view, place)
        return press_along(context, start, way)


def press_along(context: bpy.types.Context, start: Vector, way: Vector) -> bool:
    """Add a contact where a ray meets the sensing surface; return whether it does."""
    surface = sensing_surface(context.scene)
    if surface is None:
        return False
    point, normal, *_ = tree_of(surface).ray_cast(start, way)
    if point is None:
        return False
    _add(context, point, normal)
    return True


def _add(context: bpy.types.Context, point: Vector, normal: Vector) -> None:
    select_only(add_contact(context.scene, tuple(point), tuple(-normal)))


class OPTISENSE_OT_nine_contacts(polls.Checked, bpy.types.Operator):
    """Press nine indenters, spread over the camera's view: copies of the active contact, or
    balls"""

    bl_idname = "optisense.nine_contacts"
    bl_label = "Nine Places"

    checks = (*polls.ASKING, polls.in_object_mode)

    def execute(self, context: bpy.types.Context) -> set[str]:
        subject, like = Subject(context.scene), self._like(context)

        def placed(result: dict[str, Any], scene: bpy.types.Scene) -> None:
            surface = sensing_surface(scene)
            if surface is None:
                return
            tree = tree_of(surface)
            points = [each["point"] for each in result["contacts"]]
            outward = [tuple(-tree.find_nearest(point)[1]) for point in points]
            for each in objects_of(scene, "CONTACT"):
                bpy.data.objects.remove(each)
            for place in zip(points, outward, strict=True):
                contact = add_contact(scene, *place)
                for field, value in like.items():
                    setattr(contact.optisense, field, value)
            session.push_undo("Nine contacts")
            session.redraw()

        # Any shape is placed at the same points, and the mesh of a ball is always known.
        ball = {"kind": "sphere", "radius": 1.5}
        return start_with_design(
            self,
            context,
            "Finding nine places",
            "nine_places",
            subject.taking(placed),
            subject=subject,
            indenter=ball,
            depth=0.3,
        )

    def _like(self, context: bpy.types.Context) -> dict[str, Any]:
        """Return the properties of the nine contacts: those of the active contact, or of a ball."""
        active = context.active_object
        if active is None or active.optisense.kind != "CONTACT":
            return {"depth": 0.3}
        values = active.optisense
        found = {field: getattr(values, field) for field in SHAPE}
        return found | {"tilt": tuple(values.tilt), "shift": tuple(values.shift)}


class OPTISENSE_OT_clear_contacts(polls.Checked, bpy.types.Operator):
    """Remove all contacts"""

    bl_idname = "optisense.clear_contacts"
    bl_label = "Remove All"
    bl_options = {"REGISTER", "UNDO"}

    checks = (polls.requires(lambda c: objects_of(c.scene, "CONTACT"), "There are no contacts"),)

    def execute(self, context: bpy.types.Context) -> set[str]:
        for each in objects_of(context.scene, "CONTACT"):
            bpy.data.objects.remove(each)
        return {"FINISHED"}

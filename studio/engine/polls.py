"""Conditions under which buttons are enabled, and the reason shown if they are not."""

from __future__ import annotations

from collections.abc import Callable

import bpy

from . import session

Check = Callable[[type[bpy.types.Operator], bpy.types.Context], bool]
"""Check whether an operator can be used; sets the operator's poll message if it can't."""


def has_design(operator: type[bpy.types.Operator], context: bpy.types.Context) -> bool:
    """Check that the scene holds a sensor."""
    if context.scene is None or not context.scene.optisense.is_open:
        operator.poll_message_set("There is no sensor yet: make or open one under Sensor")
        return False
    return True


def is_idle(operator: type[bpy.types.Operator], context: bpy.types.Context) -> bool:
    """Check that the engine has no long job."""
    if session.is_busy():
        operator.poll_message_set("The engine is busy; wait or cancel")
        return False
    return True


def in_object_mode(operator: type[bpy.types.Operator], context: bpy.types.Context) -> bool:
    """Check that Blender is in object mode."""
    if context.mode != "OBJECT":
        operator.poll_message_set("Leave edit mode first (Tab)")
        return False
    return True


def in_3d_view(operator: type[bpy.types.Operator], context: bpy.types.Context) -> bool:
    """Check that the button is in a 3D view."""
    if context.area is None or context.area.type != "VIEW_3D":
        operator.poll_message_set("Use it in a 3D view")
        return False
    return True


def requires(is_there: Callable[[bpy.types.Context], object], text: str) -> Check:
    """Return a check that something exists; `text` is shown if it does not."""

    def check(operator: type[bpy.types.Operator], context: bpy.types.Context) -> bool:
        found = bool(is_there(context))
        if not found:
            operator.poll_message_set(text)
        return found

    return check


def selecting(*kinds: str, what: str) -> Check:
    """Return a check that an object of some kinds is selected."""
    return requires(lambda context: picked(context, *kinds), f"Select {what} first")


def picked(context: bpy.types.Context, *kinds: str) -> list[bpy.types.Object]:
    """Return the selected objects of some kinds."""
    return [each for each in context.selected_objects if each.optisense.kind in kinds]


ASKING = (has_design, is_idle)


class Checked:
    """Base of operators that are disabled until all of their `checks` hold."""

    checks: tuple[Check, ...] = ()

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return all(check(cls, context) for check in cls.checks)


class Designing(Checked):
    """Base of operators that need a sensor in the scene."""

    checks = (has_design,)


class Arranging(Checked):
    """Base of operators that change the objects of a sensor."""

    checks = (has_design, in_object_mode)


class Asking(Checked):
    """Base of operators that ask the engine about the scene's sensor."""

    checks = ASKING


class Replacing(Checked):
    """Base of operators that import what the engine reads."""

    checks = (is_idle, in_object_mode)

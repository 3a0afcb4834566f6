"""Why a button is grey."""

from __future__ import annotations

import bpy

from . import session


def has_design(operator: type[bpy.types.Operator], context: bpy.types.Context) -> bool:
    """There is a sensor in the scene."""
    if context.scene is None or not context.scene.optisense.is_open:
        operator.poll_message_set("There is no sensor yet: make or open one under Sensor")
        return False
    return True


def is_idle(operator: type[bpy.types.Operator], context: bpy.types.Context) -> bool:
    """The engine has nothing long to do."""
    if session.is_busy():
        operator.poll_message_set("The engine is busy; wait or cancel")
        return False
    return True


def may_ask(operator: type[bpy.types.Operator], context: bpy.types.Context) -> bool:
    """There is a sensor, and the engine has nothing long to do."""
    return has_design(operator, context) and is_idle(operator, context)


def in_object_mode(operator: type[bpy.types.Operator], context: bpy.types.Context) -> bool:
    """Nothing is being edited."""
    if context.mode != "OBJECT":
        operator.poll_message_set("Leave edit mode first (Tab)")
        return False
    return True


def selected(
    operator: type[bpy.types.Operator], context: bpy.types.Context, *kinds: str, what: str
) -> list[bpy.types.Object]:
    """The selected objects of some kinds; says what to select where there are none."""
    found = [each for each in context.selected_objects if each.optisense.kind in kinds]
    if not found:
        operator.poll_message_set(f"Select {what} first")
    return found


def needs(operator: type[bpy.types.Operator], is_there: object, text: str) -> bool:
    """Whether something is there; where it is not, the button says what to do."""
    if not is_there:
        operator.poll_message_set(text)
    return bool(is_there)


class Designing:
    """Operators that need a sensor in the scene."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return has_design(cls, context)


class Arranging:
    """Operators that change the objects of a sensor."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return has_design(cls, context) and in_object_mode(cls, context)


class Asking:
    """Operators that ask the engine about the scene's sensor."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return may_ask(cls, context)


class Replacing:
    """Operators that bring in what the engine reads."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return is_idle(cls, context) and in_object_mode(cls, context)

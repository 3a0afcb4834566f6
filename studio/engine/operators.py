"""Results of operators: errors that the user sees, and requests to the engine."""

from __future__ import annotations

from typing import Any

import bpy

from ..core.engine import EngineError
from . import design_transfer, session


def refuse(operator: bpy.types.Operator, text: str) -> set[str]:
    """Report an error in a window of Blender; return the result of an operator that did nothing.

    The panels do not keep showing the error before.
    """
    if not session.is_busy():
        session.clear_problem()
    operator.report({"ERROR"}, text)
    return {"CANCELLED"}


def fail(operator: bpy.types.Operator, error: EngineError, title: str = "") -> set[str]:
    """Refuse like `refuse`, with the error on the panel that shows the job `title`."""
    session.state().about = title
    session.say(error)
    return report_error(operator, error.text())


def report_error(operator: bpy.types.Operator, text: str) -> set[str]:
    """Refuse like `refuse`, for errors that a panel shows: Blender opens no window for them."""
    operator.report({"ERROR" if bpy.app.background else "WARNING"}, text)
    return {"CANCELLED"}


def start(
    operator: bpy.types.Operator,
    title: str,
    what: str,
    on_result: session.Answer,
    *,
    wait: bool | None = None,
    **fields: Any,
) -> set[str]:
    """Start a long job (see `session.start_job`), and report it if it can't be started.

    Args:
        wait: block until the job is over; by default only in background mode.
    """
    wait = bpy.app.background if wait is None else wait
    if session.start_job(title, what, on_result, wait=wait, **fields):
        return {"FINISHED"}
    now = session.state()
    return report_error(operator, ". ".join(text for text in (now.problem, now.hint) if text))


def start_with_design(
    operator: bpy.types.Operator, context: bpy.types.Context, *args: Any, **fields: Any
) -> set[str]:
    """Start like `start`, with the scene's design among the fields of the request."""
    try:
        design = design_transfer.design(context.scene)
    except EngineError as error:
        return fail(operator, error, args[0])
    return start(operator, *args, design=design, **fields)


class Starting:
    """Base of operators that call `start`: without waiting on a click, waiting in scripts."""

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        return self.start(context, wait=False)

    def execute(self, context: bpy.types.Context) -> set[str]:
        return self.start(context, wait=getattr(self, "wait", True))


class ChoosingFile:
    """Base of operators that ask for a file or a folder first."""

    def suggested(self, context: bpy.types.Context) -> str:
        """Return the path with which the file selector opens."""
        return self.filepath

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        self.filepath = self.suggested(context)
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}


class ChoosingProperties:
    """Base of operators that show their properties in a dialog first."""

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        return context.window_manager.invoke_props_dialog(self)

"""The running engine, the long job that it works on, and the state that the panels show."""

from __future__ import annotations

import shutil
import tempfile
import traceback
from collections.abc import Callable
from typing import Any

import bpy
from bpy.props import BoolProperty, FloatProperty, StringProperty

from ..core.engine import Answer, Engine, EngineError, Request
from ..core.numbers import duration
from ..scene.objects_at import objects_at, select
from ..scene.subject import Subject
from .preferences import HOW_TO_GET, engine_command, when_changed

TICK, BRISK = 0.05, 0.01
"""Interval between two polls of the engine, s: normally, and while an answer is pending."""

PATIENCE = 20.0
"""Longest time that Blender waits for requests that are normally answered at once, s."""

LEAST_LEFT = 3.0
"""Remaining time of a job from which it is shown, s; shorter ones would only flicker."""

_engine: Engine | None = None
_folder: str | None = None
_job: Request | None = None
_job_goes_on = False
_about: list[str] = []
"""Names of the objects that the shown problem is about."""

when_ticking: list[Callable[[], None]] = []
"""Callbacks for each poll, about twenty times a second while the engine runs."""

when_started: list[Callable[[Engine], None]] = []
"""Callbacks for each engine that is started."""

when_leaving: list[Callable[[], None]] = []
"""Callbacks for the moment before another .blend file is opened."""


class OPTISENSE_PG_session(bpy.types.PropertyGroup):
    """State of the engine and its job, as the panels show it; never saved."""

    busy: StringProperty(description="Title of the running job", options={"SKIP_SAVE"})
    about: StringProperty(
        description="Title of the job that the messages belong to", options={"SKIP_SAVE"}
    )
    fraction: FloatProperty(options={"SKIP_SAVE"})
    per_cent: FloatProperty(
        name="Progress",
        description="Share of the running job that is done",
        subtype="PERCENTAGE",
        min=0.0,
        max=100.0,
        precision=0,
        get=lambda self: 100.0 * self.fraction,
        options={"SKIP_SAVE"},
    )
    progress: StringProperty(options={"SKIP_SAVE"})
    left: StringProperty(description="Time that is left of the job", options={"SKIP_SAVE"})
    cancelling: BoolProperty(options={"SKIP_SAVE"})
    problem: StringProperty(options={"SKIP_SAVE"})
    hint: StringProperty(options={"SKIP_SAVE"})
    note: StringProperty(options={"SKIP_SAVE"})
    written: StringProperty(
        description="Page or folder that was written last", options={"SKIP_SAVE"}
    )


def state() -> OPTISENSE_PG_session:
    """Return the state that the panels show."""
    return bpy.context.window_manager.optisense


def engine() -> Engine:
    """Return the running engine; start one if none runs.

    Raises:
        EngineError: no engine is known, or it can't be started.
    """
    global _engine, _folder
    if _engine is not None and _engine.alive:
        return _engine
    if _engine is not None:
        _engine.abandon()
    command = engine_command()
    if not command:
        error = {"kind": "EngineGone", "message": "no engine was found", "hint": HOW_TO_GET}
        raise EngineError(error)
    if _folder is None:
        _folder = tempfile.mkdtemp(prefix="optisense-")
    _engine = Engine(command, _folder)
    for each in when_started:
        each(_engine)
    if not bpy.app.timers.is_registered(_tick):
        bpy.app.timers.register(_tick, first_interval=TICK, persistent=True)
    return _engine


def restart() -> None:
    """End the engine, and start it again with the command of the preferences; errors are shown."""
    global _engine
    if _engine is not None:
        if not _engine.alive:
            _engine.abandon()  # reports the end to pending requests
        _engine.stop()
        _engine = None
    clear_problem()
    if not bpy.app.background:
        try:
            engine()
        except EngineError as error:
            say(error)
    redraw()


def folder() -> str:
    """Return the folder of the engine's pictures and of designs on their way to the engine."""
    return engine().folder


def running() -> Engine | None:
    """Return the running engine; None if none runs."""
    return _engine if _engine is not None and _engine.alive else None


def ask(
    what: str, on_result: Answer, on_error: Callable[[EngineError], None], **fields: Any
) -> Request | None:
    """Send a short request; return None if there is no engine, which `on_error` is told."""
    try:
        return engine().send(what, on_result=on_result, on_error=on_error, **fields)
    except EngineError as error:
        on_error(error)
        return None


def ask_and_wait(what: str, **fields: Any) -> dict[str, Any]:
    """Send a request that is answered at once, such as for a list of the library, and return the
    answer.

    Raises:
        EngineError: the engine answered with an error or not in time, or there is no engine.
    """
    answers: list[Any] = []
    running = engine()
    request = running.send(what, on_result=answers.append, on_error=answers.append, **fields)
    try:
        running.wait(request, timeout=PATIENCE)
    except TimeoutError:
        request.ignore()
        raise EngineError(
            {
                "kind": "EngineBusy",
                "message": f"the engine has not answered '{what}' for {PATIENCE:g} seconds",
                "hint": "Try again in a moment",
            }
        ) from None
    if isinstance(answers[0], EngineError):
        raise answers[0]
    return answers[0]


def start_job(
    title: str,
    what: str,
    on_result: Answer,
    *,
    on_event: Answer | None = None,
    subject: Subject | None = None,
    wait: bool,
    **fields: Any,
) -> bool:
    """Start the long job that the panels show; return whether it ended well, or still runs.

    Args:
        title: name of the job in the progress bar.
        on_result: called with the result after the job has ended.
        on_event: called with the job's events, except progress.
        subject: sensor that errors are about; None for that of the present scene as it is.
        wait: block until the job is over, for scripts.
    """
    global _job, _job_goes_on
    _job_goes_on = bool(fields.get("go_on"))
    clear_problem()
    now = state()
    now.note = now.progress = now.left = ""
    now.fraction = 0.0
    now.cancelling = False
    now.about = title
    subject = subject or Subject(bpy.context.scene)

    def result(answer: dict[str, Any]) -> None:
        _over()
        on_result(answer)

    def failed(error: EngineError) -> None:
        _failed(error, subject)

    def event(message: dict[str, Any]) -> None:
        if message.get("event") == "progress":
            now = state()
            fraction = message.get("fraction")
            if fraction is None and message.get("total"):
                fraction = message.get("done", 0) / message["total"]
            now.fraction = fraction or 0.0
            now.progress = message.get("text") or ""
            left = message.get("seconds_left") or 0.0
            now.left = f"{duration(left)} left" if left >= LEAST_LEFT else ""
        elif on_event is not None:
            on_event(message)

    try:
        now.busy = title
        at_work = engine()
        begun = _job = at_work.send(
            what, on_result=result, on_error=failed, on_event=event, **fields
        )
    except EngineError as error:
        failed(error)
        return False
    if wait:
        at_work.wait(begun)
        return not state().problem
    redraw()
    return True


def cancel_job() -> None:
    """Cancel the long job."""
    if _job is not None and _engine is not None:
        state().cancelling = True
        _engine.cancel(_job)


@bpy.app.handlers.persistent
def _loading(*_: Any) -> None:
    """Drop pending answers before another .blend file is opened: their scene goes away."""
    if _job is not None:
        _job.ignore()
        if _engine is not None and not _job_goes_on:
            _engine.cancel(_job)
        _over()
    for each in when_leaving:
        each()


def is_busy() -> bool:
    """Return whether a long job is running."""
    return _job is not None and not _job.done


def clear_problem() -> None:
    """Remove the error from the panels."""
    _about.clear()
    now = state()
    now.problem = now.hint = ""


def say(error: EngineError, subject: Subject | None = None) -> None:
    """Show an error in the panels, and select the object that it is about.

    Args:
        subject: sensor that the error is about; None for that of the present scene as it is.
    """
    now = state()
    _about.clear()
    texts = [error.where, f"{error.hint[:1].upper()}{error.hint[1:]}" if error.hint else ""]
    here = bpy.context.scene
    is_placed = error.part or error.path or error.contact is not None
    if is_placed and (subject is None or subject.scene == here):
        found = objects_at(
            subject or Subject(here), error.path or "", error.part or "", error.contact
        )
        chosen = select(found)
        if found:
            _about.extend(each.name for each in found)
            names = ", ".join(each.name for each in chosen or found)
            texts.append(f"Selected: {names}" if chosen else f"Hidden with its collection: {names}")
    now.problem = f"{error.message[:1].upper()}{error.message[1:]}"
    now.hint = ". ".join(text for text in texts if text)
    redraw()


def redraw() -> None:
    """Redraw the panels and pictures."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in ("VIEW_3D", "IMAGE_EDITOR"):
                area.tag_redraw()


def push_undo(message: str) -> None:
    """Add an undo step for the changes of a finished job."""
    windows = bpy.context.window_manager.windows
    if windows:
        with bpy.context.temp_override(window=windows[0]):
            bpy.ops.ed.undo_push(message=message)
    elif bpy.ops.ed.undo_push.poll():
        bpy.ops.ed.undo_push(message=message)


def stop() -> None:
    """End the engine and remove its folder."""
    global _engine, _folder, _job
    if _engine is not None:
        _engine.stop()
    if _folder is not None:
        shutil.rmtree(_folder, ignore_errors=True)
    _engine = _folder = _job = None


def _over() -> None:
    global _job
    _job = None
    now = state()
    now.busy = now.progress = now.left = ""
    now.cancelling = False


def _failed(error: EngineError, subject: Subject) -> None:
    _over()
    if error.kind == "Cancelled":
        state().note = "Cancelled"
        redraw()
    else:
        say(error, subject)


def _tick() -> float | None:
    if _engine is None:
        return None
    try:
        if _engine.poll():
            redraw()
        for each in when_ticking:
            each()
    except Exception as error:  # Blender would never call a timer again that raised
        traceback.print_exc()
        state().problem = f"Unexpected {type(error).__name__}: {error}"
        state().hint = "This is a defect of the extension; the console shows where it is"
    if _engine.ended:
        if _engine.end is not None and not state().problem:
            say(_engine.end)  # No request was pending whose error would have told it.
        return None
    return BRISK if _engine.waiting else TICK


@bpy.app.handlers.persistent
def _undone(*_: Any) -> None:
    """Clear the last problem after undo or redo: the scene is another one now."""
    clear_problem()


@bpy.app.handlers.persistent
def _changed(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Clear the problem of objects that were removed."""
    came_or_went = bool(_about) and depsgraph.id_type_updated("COLLECTION")
    if came_or_went and not all(name in scene.objects for name in _about):
        clear_problem()
        redraw()


PROPERTIES = {"WindowManager": {"optisense": OPTISENSE_PG_session}}


def _another_engine_is_named() -> None:
    """Restart the engine after its command was changed, unless a job is running."""
    if not is_busy():
        restart()


HOOKS = (
    (when_changed, _another_engine_is_named),
    (bpy.app.handlers.load_pre, _loading),
    (bpy.app.handlers.depsgraph_update_post, _changed),
    (bpy.app.handlers.undo_post, _undone),
    (bpy.app.handlers.redo_post, _undone),
)


def unregister() -> None:
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
    stop()

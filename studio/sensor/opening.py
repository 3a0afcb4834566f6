"""The scene of a design folder that the engine wrote."""

from __future__ import annotations

import uuid
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy

from ..core import mesh_file
from ..engine import handing, session
from ..lights.windows import ask_for_windows
from ..scene.build import build
from ..scene.remembering import looks_of, restore
from ..scene.startup import clear_startup
from ..scene.views import show_design
from .warming import warm_up

when_opened: list[Callable[[bpy.types.Scene], None]] = []
"""Called when a built-in sensor or the user's folder is open."""


def new_stage() -> Path:
    """A folder of the engine's, not there yet, for a design on its way.

    Raises:
        EngineError: there is no engine.
    """
    return Path(session.folder()) / f"stage-{uuid.uuid4().hex[:8]}"


def open_source(scene: bpy.types.Scene, source: str, folder: str, *, wait: bool) -> bool:
    """Open a built-in sensor or the user's folder, as the job that the panels show.

    Args:
        scene: where to.
        source: as the engine names designs.
        folder: the user's folder; empty for a built-in sensor, which is not saved yet.
        wait: until it is there.

    Raises:
        EngineError: there is no engine.
    """
    name, stage = scene.name, new_stage()

    def written(_: dict[str, Any]) -> None:
        scene = bpy.data.scenes.get(name)
        if scene is not None:
            open_stage(scene, stage, wait=wait, folder=folder, then=tell)

    def tell(scene: bpy.types.Scene) -> None:
        for each in when_opened:
            each(scene)

    # Written out first: the engine reads what users have, and writes what this reads.
    done = session.start_job(
        "Opening the sensor", "save", written, wait=wait, design=source, to=str(stage)
    )
    return done and not session.state().problem


def open_stage(
    scene: bpy.types.Scene,
    stage: Path,
    *,
    wait: bool,
    folder: str = "",
    keep_others: bool = False,
    then: Callable[[bpy.types.Scene], None] | None = None,
) -> bool:
    """Open what the engine wrote into a stage, as the job that the panels show.

    Args:
        scene: where to.
        stage: the folder.
        wait: until it is there.
        folder: the user's own folder of it; empty where it is not saved.
        keep_others: the contacts and references of the sensor before stay, and so do the view and
            what is selected and hidden.
        then: called when it is open.
    """
    name = scene.name

    def opened(result: dict[str, Any]) -> None:
        scene = bpy.data.scenes.get(name)
        if scene is None:
            return
        document = handing.without_nulls(result["data"])
        parts = document["parts"].items()
        clear_startup(scene)
        picture_is_old()
        meshes = {key: mesh_file.read(stage / part["mesh"]) for key, part in parts}
        before = looks_of(scene) if keep_others else None
        build(scene, document, meshes, keep_others=keep_others)
        scene.optisense.folder = folder or str(stage)
        scene.optisense.is_saved = bool(folder)
        if before is None:
            show_design(scene)
        else:
            restore(scene, before)
        ask_for_windows(scene)
        if not bpy.app.background:  # scripts say themselves what they want
            warm_up(scene)
        warnings = result.get("warnings") or []
        session.state().note = "; ".join(each.get("message", "") for each in warnings)
        if then is not None:
            then(scene)
        session.push_undo(f"Open {document['name']}")
        session.redraw()

    return session.start_job(
        "Opening the sensor", "open", opened, wait=wait, design=str(stage), name="opened"
    )


def open_empty(scene: bpy.types.Scene, document: dict[str, Any]) -> None:
    """Show a sensor that has no parts yet in place of the one before; references stay."""
    clear_startup(scene)
    picture_is_old()
    build(scene, document, {}, keep_others=True)
    scene.optisense.folder = str(new_stage())
    scene.optisense.is_saved = False
    session.push_undo("New sensor")
    session.redraw()


def picture_is_old() -> None:
    """What is shown is no picture of the sensor that opens, whose lights do not relight it.

    The scores are not of that sensor either.
    """
    now = bpy.context.window_manager.optisense_picture
    now.image = ""
    now.is_before = now.shown
    evaluation = bpy.context.window_manager.optisense_evaluation
    evaluation.is_before = True
    evaluation.rays = ""  # they go with the sensor that they were drawn in

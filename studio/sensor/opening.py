"""Opening of design folders that the engine wrote."""

from __future__ import annotations

import uuid
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy

from ..core import mesh_file
from ..engine import design_transfer, session
from ..lights.windows import ask_for_windows
from ..scene.build import build
from ..scene.selection_state import looks_of, restore
from ..scene.startup import clear_startup
from ..scene.subject import scene_of
from ..scene.views import show_design
from .warming import warm_up

when_opened: list[Callable[[bpy.types.Scene, str | None], None]] = []
"""Callbacks for a sensor being opened (a built-in one, a folder of the user, or CAD files), and the
file of the engine's draft of it, which only built-in sensors have."""

digests: dict[str, str] = {}
"""Digest of each design folder as it was last opened or saved in this Blender, by which the engine
notices that another program has changed it. Undo does not bring older ones back."""

folders: dict[tuple[int, str], str] = {}
"""Folder in which a sensor was last saved in this Blender, by its scene's session id and its
`opening`. Undo does not bring older ones back, which the next save would write over; undo of the
opening of another sensor brings back the folder of the sensor before."""


def saved_in(scene: bpy.types.Scene, folder: str) -> None:
    """Make a folder that of the scene's sensor, also after undo."""
    folders[scene.session_uid, scene.optisense.opening] = folder
    _keep_folders()


@bpy.app.handlers.persistent
def _keep_folders(*_: Any) -> None:
    for scene in bpy.data.scenes:
        design = scene.optisense
        folder = folders.get((scene.session_uid, design.opening))
        if folder is not None:
            design.folder, design.is_saved = folder, True


def tell_opened(scene: bpy.types.Scene, draft: str | None) -> None:
    """Call these callbacks."""
    for each in when_opened:
        each(scene, draft)


def new_stage() -> Path:
    """Return a folder that does not exist yet, inside the engine's folder, for a design in
    transfer.

    Raises:
        EngineError: there is no engine.
    """
    return Path(session.folder()) / f"stage-{uuid.uuid4().hex[:8]}"


def open_source(scene: bpy.types.Scene, source: str, folder: str, *, wait: bool) -> bool:
    """Open a built-in sensor or a folder of the user as the job that the panels show; return
    whether it ended well, or still runs.

    Args:
        source: design in the engine's notation, such as `builtin:gelsight-mini`.
        folder: folder of the user; empty for a built-in sensor, which is not saved yet.
        wait: block until the sensor is open.

    Raises:
        EngineError: there is no engine.
    """
    number, stage = scene.session_uid, new_stage()

    def written(result: dict[str, Any]) -> None:
        scene = scene_of(number)
        if scene is not None:
            if folder and result.get("source_digest"):
                digests[folder] = result["source_digest"]
            open_stage(scene, stage, wait=wait, folder=folder, then=tell_opened)

    # The engine reads all formats that users have, and writes the one that the extension reads.
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
    then: Callable[[bpy.types.Scene, str | None], None] | None = None,
) -> bool:
    """Open the design that the engine wrote into a folder, as the job that the panels show; return
    whether it ended well, or still runs.

    Args:
        stage: folder that the engine wrote.
        wait: block until the sensor is open.
        folder: the user's own folder of the design; empty if it is not saved.
        keep_others: keep the contacts and references, the view, and the selection and visibility;
            the sensor counts as the same one, with other values.
        then: called with the scene and the engine's draft when the sensor is open.
    """
    number = scene.session_uid

    def opened(result: dict[str, Any]) -> None:
        scene = scene_of(number)
        if scene is None:
            return
        document = design_transfer.without_nulls(result["data"])
        parts = document["parts"].items()
        clear_startup(scene)
        picture_is_old(scene)
        meshes = {key: mesh_file.read(stage / part["mesh"]) for key, part in parts}
        before = looks_of(scene) if keep_others else None
        build(scene, document, meshes, keep_others=keep_others)
        if not keep_others:
            scene.optisense.opening = uuid.uuid4().hex
        scene.optisense.folder = folder or str(stage)
        scene.optisense.is_saved = bool(folder)
        if before is None:
            show_design(scene)
        else:
            restore(scene, before)
        ask_for_windows(scene)
        if not bpy.app.background:  # scripts ask for what they need
            warm_up(scene)
        warnings = result.get("warnings") or []
        session.state().note = "; ".join(each.get("message", "") for each in warnings)
        if then is not None:
            then(scene, result.get("draft"))
        session.push_undo(f"Open {document['name']}")
        session.redraw()

    return session.start_job(
        "Opening the sensor", "open", opened, wait=wait, design=str(stage), name="opened"
    )


def open_empty(scene: bpy.types.Scene, document: dict[str, Any]) -> None:
    """Replace the sensor by one without parts; references stay."""
    clear_startup(scene)
    picture_is_old(scene)
    build(scene, document, {}, keep_others=True)
    scene.optisense.opening = uuid.uuid4().hex
    scene.optisense.folder = str(new_stage())
    scene.optisense.is_saved = False
    session.push_undo("New sensor")
    session.redraw()


def picture_is_old(scene: bpy.types.Scene | None) -> None:
    """Mark picture, scores and light ledger of a scene as those of the sensor before; its picture
    can't be relit any more.

    Args:
        scene: scene that gets another sensor; results of other scenes stay as they are. None if all
            scenes are others now.
    """
    now = bpy.context.window_manager.optisense_picture
    if scene is None or now.is_of(scene):
        now.image = ""
        now.is_before = now.shown
    evaluation = bpy.context.window_manager.optisense_evaluation
    for each in (evaluation, bpy.context.window_manager.optisense_ledger):
        if scene is None or each.is_of(scene):
            each.is_before = True
    evaluation.rays = ""  # they go with the sensor that they were drawn in


HOOKS = (
    (bpy.app.handlers.undo_post, _keep_folders),
    (bpy.app.handlers.redo_post, _keep_folders),
)

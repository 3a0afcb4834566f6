"""Recovery of a study that had not ended when Blender was closed, when its sensor is reopened."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy

from ..core.engine import EngineError
from ..engine import session
from ..scene.paths import absolute
from ..scene.subject import scene_of
from ..sensor import opening
from . import search_progress

NOT_OVER = (None, "", "interrupted")
"""Reasons for the end of a study that can continue: it was stopped, or nothing recorded its end."""


def study_of(scene: bpy.types.Scene) -> str:
    """Return the folder of the scene's study as an absolute path; empty if the scene names none."""
    text = scene.optisense_search.study
    return str(absolute(text)) if text else ""


def studies_beside(folder: Path) -> list[Path]:
    """Return the folders of the searches beside a design's folder, the latest last."""
    found: list[Path] = []
    while (study := folder.with_name(f"{folder.name}-search-{len(found) + 1}")).exists():
        found.append(study)
    return found


def new_study(folder: Path) -> Path:
    """Return a folder beside the design's folder that does not exist yet."""
    return folder.with_name(f"{folder.name}-search-{len(studies_beside(folder)) + 1}")


def offer(scene: bpy.types.Scene) -> None:
    """Show the progress of the sensor's study if it is not over, and offer to continue it.

    The study is the one that the scene names, otherwise the last one beside the design's folder:
    the .blend file may have been saved before the search began, or never.
    """
    search_progress.begin(scene)
    design, study = scene.optisense, study_of(scene)
    if not study and design.is_open and design.is_saved:
        study = next((str(each) for each in reversed(studies_beside(Path(design.folder)))), "")
    if not study or not Path(study).is_dir():
        return
    number = scene.session_uid

    def known(result: dict[str, Any]) -> None:
        scene = scene_of(number)
        if scene is None or session.is_busy() or result["design"] != scene.optisense.title:
            return
        search, running = scene.optisense_search, result["running"]
        if study_of(scene) not in ("", study) or not (running or result["ended"] in NOT_OVER):
            return
        if not search.study:
            search.study, search.budget = study, result["budget"]
            search.objective = ", ".join(result["objectives"])
            search.method = result["method"]
            search.require = ", ".join(result["requirements"])
        search_progress.take_curve(scene, result["curve"])
        done = sum(not row["start"] for row in result["curve"])
        far = f"{done} of {search.budget or result['budget']} trials"
        bpy.context.window_manager.optisense_found.offer = (
            f"The search {Path(study).name} continues without Blender: {far}. Resume shows it"
            if running
            else f"The search {Path(study).name} is not finished: {far}. Resume continues it"
        )
        session.redraw()

    def unreadable(_: EngineError) -> None:
        """Ignore an unreadable study; the error is shown when the user asks for this study."""

    session.ask("study", known, unreadable, study=study)


@bpy.app.handlers.persistent
def _loaded(*_: Any) -> None:
    if not bpy.app.background:  # scripts ask for what they need
        search_progress.clear_ghosts(bpy.context.scene)
        offer(bpy.context.scene)


def _opened(scene: bpy.types.Scene, _: str | None) -> None:
    if not bpy.app.background:
        offer(scene)


HOOKS = ((bpy.app.handlers.load_post, _loaded), (opening.when_opened, _opened))

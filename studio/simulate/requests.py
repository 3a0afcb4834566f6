"""Requests to the engine for a picture, and the handling of its answers."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from ..engine import design_transfer, session
from ..scene.drawings import ignored_edits
from ..scene.objects_at import select
from ..scene.subject import Subject
from . import picture, relight
from .exposure import exposure, keep_exposure, resolution, shown_size

LATEST = "picture"

SAME_DEPTH = 1e-3
"""Difference in mm up to which a contact is not drawn anew."""


def fields(scene: bpy.types.Scene) -> dict[str, Any]:
    """Return the fields of a request for a full picture of the scene's design and contacts.

    Raises:
        EngineError: there is no engine, or the scene does not form a design.
    """
    settings = scene.optisense_simulation
    asked: dict[str, Any] = {
        "design": design_transfer.design(scene),
        "contacts": design_transfer.contacts(scene),
        "noise": round(settings.noise, 3),
        "seed": settings.seed,
        "skin": settings.skin,
        "exposure": exposure(scene),
        "files": ["picture", "pixels"],
        "name": LATEST,
    }
    size = resolution(scene)
    if size is not None:
        asked["resolution"] = size
    return asked


def take(result: dict[str, Any], subject: Subject, *, draft: bool) -> None:
    """Show the picture in the engine's answer, unless its sensor is gone."""
    scene = subject.scene
    if scene is None:
        return
    picture.show(np.load(result["files"]["pixels"]), shown_size(scene) if draft else None)
    keep_exposure(scene, result["exposure"])
    now = bpy.context.window_manager.optisense_picture
    now.scene = scene.session_uid
    now.image = result["image"]
    relight.shown(result["lights"])
    now.shown = True
    now.is_draft = draft
    now.is_relit = now.is_before = now.is_stored = False
    now.file = result["files"].get("picture", "")
    now.summary = summary(result)
    contacts = subject.contacts()
    now.presses = presses(result, [each and each.name for each in contacts])
    _sink(contacts, result)
    if not all(group.shown for group in scene.optisense.light_groups):
        relight.wanted()
    _tell_unseen([contacts[each] for each in result.get("unseen") or []])
    if not draft:
        _tell_ignored(scene)
    session.redraw()


def _sink(contacts: list[bpy.types.Object | None], result: dict[str, Any]) -> None:
    """Draw contacts that are pressed by a force as deep as the picture has them."""
    for contact, row in zip(contacts, _pressed(result), strict=False):
        if contact is None:
            continue
        values = contact.optisense
        if values.press_by == "FORCE" and abs(values.depth - row["depth_mm"]) > SAME_DEPTH:
            values.depth = row["depth_mm"]


def _pressed(result: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the results of the contacts of a full picture; a draft has none."""
    return [] if result.get("draft") else (result.get("settings") or {}).get("presses") or []


def _tell_unseen(contacts: list[bpy.types.Object | None]) -> None:
    """Select the contacts that the picture does not show, and report them."""
    chosen = select([each for each in contacts if each is not None and each.visible_get()])
    if chosen:
        names = ", ".join(each.name for each in chosen)
        session.state().note = (
            f"The camera does not see {names} (selected): move it to where the camera looks, "
            "which Show Chief Rays draws"
        )


def _tell_ignored(scene: bpy.types.Scene) -> None:
    """Report the first object that is drawn in another place or shape than the picture has it."""
    found = ignored_edits(scene)
    if found:
        now = session.state()
        message = f"{found[0]['message'][:1].upper()}{found[0]['message'][1:]}"
        now.note = ". ".join(text for text in (now.note, message) if text)


def presses(result: dict[str, Any], names: list[str | None]) -> str:
    """Return force, pressure and area of each contact of a full picture, one line each.

    Args:
        names: names of the contacts in the order of the request; None for contacts without a line.
    """
    lines = []
    for name, row in zip(names, _pressed(result), strict=False):
        if name is None:
            continue
        text = (
            f"{name}: {row['force_n']:.3g} N at {row['depth_mm']:.3g} mm, up to "
            f"{1000 * row['greatest_pressure_mpa']:.3g} kPa on {row['area_mm2']:.3g} mm²"
        )
        if "shear_force_n" in row:
            text += f"; dragged with {row['shear_force_n']:.3g} N, {row['torque_nmm']:.3g} N mm"
        if "warning" in row:
            text += f"; {row['warning']}"
        lines.append(text)
    return "\n".join(lines)


def summary(result: dict[str, Any]) -> str:
    """Return size, noise and time of a picture, in a line.

    The worst places are the 5 % of the picture with the most noise.
    """
    width, height = result["size"]
    texts = [f"{width} x {height}"]
    settings = result.get("settings") or {}
    noise = settings.get("noise_reached_percent")
    if noise is not None:
        worst = settings.get("noise_of_worst_places_percent")
        places = "" if worst is None else f" ({worst:.2g} % in the worst places)"
        texts.append(f"noise {noise:.1f} %{places}")
    seconds = (settings.get("seconds") or {}).get("total")
    if seconds is not None:
        texts.append(f"{seconds:.1f} s")
    return ", ".join(texts)

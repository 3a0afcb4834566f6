"""Size and exposure of pictures."""

from __future__ import annotations

import math
from collections.abc import Callable

import bpy

from ..scene.collections import objects_of

when_exposed: list[Callable[[], None]] = []
"""Callbacks for a change of the exposure by the user."""

_keeping = False


def resolution(scene: bpy.types.Scene) -> list[int] | None:
    """Return width and height to simulate, in the camera's proportions; None for its own."""
    size = scene.optisense_simulation.size
    cameras = objects_of(scene, "CAMERA")
    if size == "CAMERA" or not cameras:
        return None
    width, height = cameras[0].optisense.pixels
    scale = int(size) / max(width, height)
    return [max(1, round(width * scale)), max(1, round(height * scale))]


def shown_size(scene: bpy.types.Scene) -> tuple[int, int] | None:
    """Return width and height of full pictures, the size of drafts; None without a camera."""
    cameras = objects_of(scene, "CAMERA")
    if not cameras:
        return None
    width, height = resolution(scene) or cameras[0].optisense.pixels
    return width, height


def exposure(scene: bpy.types.Scene) -> str | float:
    """Return the exposure as a field of requests: a factor, or "auto"."""
    settings = scene.optisense_simulation
    return "auto" if settings.auto_exposure else float(settings.exposure)


def keep_exposure(scene: bpy.types.Scene, factor: float) -> None:
    """Store the automatic exposure, so that pictures stay as bright when it is switched off."""
    global _keeping
    settings = scene.optisense_simulation
    if settings.auto_exposure and math.isfinite(factor) and factor > 0.0:
        _keeping = True
        try:
            settings.exposure = factor
        finally:
            _keeping = False


def exposure_changed(values: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    """Call the callbacks after the user has changed the exposure."""
    if not _keeping:
        for each in when_exposed:
            each()

"""Chief rays as curves, one object for each outcome."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..scene.collections import collection, objects_of

NAME = "Chief rays"
THICKNESS = 0.02
"""Radius of the lines of chief rays, mm."""
COLOURS = {
    "hit": ("green", (0.05, 0.55, 0.2, 1.0)),
    "escaped": ("red", (0.9, 0.1, 0.1, 1.0)),
    "absorbed": ("black", (0.1, 0.1, 0.1, 1.0)),
    "total_reflection": ("orange", (0.9, 0.5, 0.0, 1.0)),
    "depth_limit": ("purple", (0.5, 0.1, 0.7, 1.0)),
}
"""Name and RGBA colour (0 to 1) of the lines of each outcome of a chief ray, in its own hue."""
OTHER = ("grey", (0.5, 0.5, 0.5, 1.0))
"""Name and RGBA colour (0 to 1) of outcomes that this version of the studio does not know."""


def show(scene: bpy.types.Scene, result: dict[str, Any]) -> str:
    """Draw the engine's chief rays in place of earlier ones; return a summary of their outcomes."""
    clear(scene)
    files = result["files"]
    vertices, counts = np.load(files["vertices"]), np.load(files["counts"])
    outcomes = np.load(files["outcomes"])
    lines = np.split(vertices, np.cumsum(counts)[:-1])
    texts = []
    for number, name in enumerate(result["outcome_names"]):
        chosen = [line for line, outcome in zip(lines, outcomes, strict=True) if outcome == number]
        if chosen:
            _draw(scene, name, chosen)
            colour = COLOURS.get(name, OTHER)[0]
            share = 100 * len(chosen) / len(lines)
            texts.append(f"{share:.0f} % {name.replace('_', ' ')} ({colour})")
    return ", ".join(texts)


def drawn(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Return the objects of the chief rays that are drawn."""
    return [e for e in objects_of(scene, "SHOWN") if e.optisense.key.startswith("ray ")]


def clear(scene: bpy.types.Scene) -> None:
    """Remove the chief rays."""
    for each in drawn(scene):
        curve = each.data
        bpy.data.objects.remove(each)
        bpy.data.curves.remove(curve)


def _draw(scene: bpy.types.Scene, outcome: str, lines: list[NDArray[np.float32]]) -> None:
    curve = bpy.data.curves.new(f"{NAME}: {outcome}", "CURVE")
    curve.dimensions = "3D"
    curve.bevel_depth = THICKNESS
    curve.bevel_resolution = 0
    for line in lines:
        spline = curve.splines.new("POLY")
        spline.points.add(len(line) - 1)
        homogeneous = np.ones((len(line), 4), dtype=np.float32)
        homogeneous[:, :3] = line
        spline.points.foreach_set("co", homogeneous.ravel())
    item = bpy.data.objects.new(curve.name, curve)
    item.optisense.kind = "SHOWN"
    item.optisense.key = f"ray {outcome}"
    item.color = COLOURS.get(outcome, OTHER)[1]
    item.hide_select = True
    collection(scene, NAME).objects.link(item)

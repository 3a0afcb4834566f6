"""What of an object a search may change, in the words of the engine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

TRIAL, BEST = (0.55, 0.75, 0.95, 1.0), (0.95, 0.55, 0.15, 1.0)
"""Colours of the curve: each trial, and the line of the best so far."""

FEW = 60
"""Trials up to which their dots are large."""

REACH = 2.0
"""mm to either side that a pose may move, until the user says otherwise."""


@dataclass(frozen=True)
class Suggestion:
    """A parameter of a search: a label, and the text that the engine reads."""

    label: str
    text: str


def for_camera() -> list[Suggestion]:
    """Where the camera is, and how wide it sees."""
    places = [Suggestion(f"Camera {axis}", f"camera.position.{axis}=+-{REACH:g}") for axis in "xyz"]
    return [*places, Suggestion("Field of view", "camera.fov=+-5")]


def for_light(group: str, index: int) -> list[Suggestion]:
    """Where one light is, and what its whole group is like."""
    place = f"lights.{group}.lights[{index}].position"
    each = [Suggestion(f"{group} {index} {axis}", f"{place}.{axis}=+-{REACH:g}") for axis in "xyz"]
    whole = [
        Suggestion(f"All of {group}, {axis}", f"lights.{group}.shift.{axis}=-{REACH:g}:{REACH:g}")
        for axis in "xyz"
    ]
    return [*each, *whole, *for_group(group)]


def for_group(group: str) -> list[Suggestion]:
    """How bright and of which colour a group is."""
    return [
        Suggestion(f"{group} flux", f"lights.{group}.flux=0:5"),
        Suggestion(f"{group} colour", f"lights.{group}.colour=red,green,blue,white"),
    ]


def for_part(role: str, material: str, kind: str) -> list[Suggestion]:
    """What a part is made of."""
    if role == "sensing_surface":
        return [
            Suggestion("Specularity", "coating.specularity=0:1"),
            *(Suggestion(f"Reflectance {c}", f"coating.reflectance.{c}=0.05:0.9") for c in "rgb"),
        ]
    if kind == "dielectric":
        return [
            Suggestion(f"{material} index", f"materials.{material}.ior=+-0.1"),
            Suggestion(f"{material} roughness", f"materials.{material}.roughness=0:0.5"),
        ]
    if kind == "conductor":
        return [Suggestion(f"{material} roughness", f"materials.{material}.roughness=0:0.5")]
    return []


def for_cage(
    key: str, chosen: Sequence[int], *, blended: bool, reach: float = REACH
) -> list[Suggestion]:
    """The blend of a cage, or its points: the chosen ones, or all.

    Args:
        key: the cage's name.
        chosen: indices of the selected control points; none means all.
        blended: whether its shape is a mixture of C_min and C_max.
        reach: mm to either side.
    """
    if blended:
        return [Suggestion(f"{key}: A", f"cages.{key}.blend=0:1")]
    some = f"/points={','.join(str(each) for each in chosen)}" if chosen else ""
    what = f"{len(chosen)} points" if chosen else "all points"
    return [
        Suggestion(f"{key}: {what} in z", f"cages.{key}.points=+-{reach:g}/axes=z{some}"),
        Suggestion(f"{key}: {what}", f"cages.{key}.points=+-{reach:g}{some}"),
    ]


def curve_picture(scores: Sequence[float | None], size: tuple[int, int]) -> NDArray[np.float32]:
    """The scores of a search as a picture: each trial a dot, the best so far a line.

    Args:
        scores: in the order of the trials; None where one failed.
        size: pixels, width and height.

    Returns:
        (height, width, 4) float32, row 0 at the bottom.
    """
    width, height = size
    picture = np.zeros((height, width, 4), dtype=np.float32)
    picture[...] = (0.11, 0.12, 0.14, 1.0)
    known = [score for score in scores if score is not None]
    if not known:
        return picture
    low, high = min(known), max(known)
    room = (high - low) or 1.0
    edge = 6
    columns = [
        edge + round(number / max(len(scores) - 1, 1) * (width - 2 * edge - 1))
        for number in range(len(scores))
    ]
    half = 3 if len(scores) <= FEW else 1
    for column, score in zip(columns, scores, strict=True):
        if score is not None:
            row = _row(score, low, room, height, edge)
            picture[row - half : row + half, column - half : column + half] = TRIAL
    best, before, last = -np.inf, 0, columns[0]
    for column, score in zip(columns, scores, strict=True):
        if np.isfinite(best):
            picture[before - 1 : before + 1, last : column + 1] = BEST
        if score is not None and score > best:
            row = _row(score, low, room, height, edge)
            if np.isfinite(best):
                picture[before - 1 : row + 1, column : column + 2] = BEST
            best, before = score, row
        last = column
    return picture


def _row(score: float, low: float, room: float, height: int, edge: int) -> int:
    return edge + round((score - low) / room * (height - 2 * edge - 1))


def texts_of(rows: Sequence[Any]) -> list[str]:
    """The texts of all parameters that are ticked."""
    return [row.text.strip() for row in rows if row.active and row.text.strip()]

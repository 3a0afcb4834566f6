"""Suggested parameters of a search for each kind of object, and the curve of its scores."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .schema import Row

TRIAL, BEST = (0.55, 0.75, 0.95, 1.0), (0.95, 0.55, 0.15, 1.0)
"""Colours (red, green, blue, opacity) of the curve: dots of trials, line of the best so far."""

FEW = 60
"""Number of trials up to which their dots in the curve are drawn large."""

REACH = 2.0
"""Initial range of a position, mm to either side; the user can change it."""


TURN = 10.0
"""Initial range of a direction, degrees to either side; the user can change it."""


NEAR = 0.1
"""Initial range of a number without two bounds, as a share of its present value, to either side."""


def listed(text: str) -> list[str]:
    """Return the entries of a comma-separated list; commas inside brackets do not separate."""
    found, depth = [""], 0
    for sign in text:
        depth += (sign == "(") - (sign == ")")
        if sign == "," and depth <= 0:
            found.append("")
        else:
            found[-1] += sign
    return [each.strip() for each in found if each.strip()]


@dataclass(frozen=True)
class Suggestion:
    """Suggested parameter of a search: a label, and the text that the engine reads."""

    label: str
    text: str


def for_camera(model: str = "", models: Sequence[str] = ()) -> list[Suggestion]:
    """Return suggestions for the camera: position, field of view, direction and model.

    Args:
        model: present model of the camera in the library.
        models: names of all camera models of the library.
    """
    places = [Suggestion(f"Camera {axis}", f"camera.position.{axis}=+-{REACH:g}") for axis in "xyz"]
    return [
        *places,
        Suggestion("Field of view", "camera.fov=+-5"),
        Suggestion("Camera direction", f"camera.turn=+-{TURN:g}"),
        *_one_of("Camera model", "camera.model", model, models),
    ]


def for_light(
    group: str, index: int, *, flux: float = 1.0, model: str = "", models: Sequence[str] = ()
) -> list[Suggestion]:
    """Return suggestions for a light, and for the light group that it belongs to.

    Args:
        index: number of the light in its group, from 0.
        flux: present radiant flux of each light, mW.
        model: present model of the lights in the library.
        models: names of all light models of the library.
    """
    light, whole = f"lights.{group}.lights[{index}]", f"lights.{group}"
    return [
        *(_move(f"{group} {index} {axis}", f"{light}.position.{axis}") for axis in "xyz"),
        Suggestion(f"{group} {index} direction", f"{light}.turn=+-{TURN:g}"),
        *(_move(f"All of {group}, {axis}", f"{whole}.shift.{axis}") for axis in "xyz"),
        Suggestion(f"All of {group}, direction", f"{whole}.turn=+-{TURN:g}"),
        Suggestion(f"{group} flux", f"{whole}.flux={_around(flux, 0.0, max(5.0, 2.0 * flux))}"),
        Suggestion(f"{group} colour", f"{whole}.colour=red,green,blue,white"),
        *_one_of(f"{group} model", f"{whole}.model", model, models),
    ]


def for_surface(
    library: str, libraries: Sequence[str], values: Mapping[str, Any], rows: Mapping[str, Row]
) -> list[Suggestion]:
    """Return suggestions for the coating of the sensing surface.

    Args:
        library: name of the present coating in the library.
        libraries: names of all coatings of the library.
        values: present values of the coating's fields.
        rows: descriptions of the fields, as from `schema.fields`.
    """
    return [
        *_for_fields("", "coating", values, rows),
        *_one_of("Coating", "coating.library", library, libraries),
    ]


def _for_fields(
    label: str, path: str, values: Mapping[str, Any], rows: Mapping[str, Row]
) -> list[Suggestion]:
    """Return suggestions for the numbers of a material or coating: a fraction varies over 0..1,
    another number about its present value.
    """
    found = []
    for name, row in rows.items():
        value = values.get(name)
        fraction = (row.get("minimum"), row.get("maximum")) == (0.0, 1.0)
        title = f"{label} {row['title'].lower()}" if label else row["title"]
        if value is None:
            continue
        if row["type"] == "number" and fraction:
            found.append(Suggestion(title, f"{path}.{name}={_around(value, 0.0, 1.0)}"))
        elif row["type"] == "number":
            reach = NEAR * abs(value) or NEAR
            found.append(Suggestion(title, f"{path}.{name}=+-{reach:.2g}"))
        elif row["type"] == "numbers" and fraction and row["size"] == 3:
            for letter, now in zip("rgb", value, strict=True):
                around = _around(now, 0.05, 0.9)
                found.append(Suggestion(f"{title} {letter}", f"{path}.{name}.{letter}={around}"))
    return found


def for_pose(part: str) -> list[Suggestion]:
    """Return suggestions for position and direction of a part that is in no cage."""
    return [
        *(_move(f"{part} {axis}", f"parts.{part}.shift.{axis}") for axis in "xyz"),
        Suggestion(f"{part} direction", f"parts.{part}.turn=+-{TURN:g}"),
    ]


def for_material(
    part: str,
    material: str,
    values: Mapping[str, Any],
    rows: Mapping[str, Row],
    choices: Sequence[str],
) -> list[Suggestion]:
    """Return suggestions for the material of a part.

    Args:
        values: present values of the material's fields.
        rows: descriptions of the fields, as from `schema.fields`.
        choices: names of the library's materials that suit the part.
    """
    found = _for_fields(material, f"materials.{material}", values, rows)
    return [*found, *_one_of(f"{part} material", f"parts.{part}.material", material, choices)]


def _move(label: str, path: str) -> Suggestion:
    return Suggestion(label, f"{path}=+-{REACH:g}")


def _around(now: float, low: float, high: float) -> str:
    """Return a range as text, widened to include the present value: a search starts from it."""
    return f"{min(low, now):.6g}:{max(high, now):.6g}"


def _one_of(label: str, path: str, now: str, names: Sequence[str]) -> list[Suggestion]:
    """Return a choice among names, the present one first; empty if there is only one."""
    choices = sorted(names, key=lambda name: name != now)
    return [Suggestion(label, f"{path}={','.join(choices)}")] if len(choices) > 1 else []


def for_cage(key: str, chosen: Sequence[int], *, blended: bool) -> list[Suggestion]:
    """Return suggestions for a cage: its blend, or its control points.

    Args:
        chosen: indices of the selected control points; empty means all.
        blended: whether the cage's shape is a blend of C_min and C_max.
    """
    if blended:
        return [Suggestion(f"{key}: A", f"cages.{key}.blend=0:1")]
    some = f"/points={','.join(str(each) for each in chosen)}" if chosen else ""
    what = f"{len(chosen)} points" if chosen else "all points"
    return [
        Suggestion(f"{key}: {what} in z", f"cages.{key}.points=+-{REACH:g}/axes=z{some}"),
        Suggestion(f"{key}: {what}", f"cages.{key}.points=+-{REACH:g}{some}"),
    ]


def curve_picture(scores: Sequence[float | None], size: tuple[int, int]) -> NDArray[np.float32]:
    """Draw the scores of a search: a dot for each trial, a line for the best so far.

    Args:
        scores: scores in the order of the trials; None for a failed trial.
        size: width and height, pixels.

    Returns:
        Picture (height, width, 4), float32 RGBA in 0..1; row 0 is at the bottom.
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
    """Return the texts of all active parameters."""
    return [row.text.strip() for row in rows if row.active and row.text.strip()]

"""Where each LED goes: in the frame of the design, and on a flat board."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optisense import library
from optisense.design import Light, LightGroup, SensorDesign
from optisense.errors import LibraryError
from optisense.library import LightEntry, TypicalLight

FloatArray = NDArray[np.float64]

SAME_PLANE = 0.01
"""mm: LEDs whose windows are this close to one plane, and face one way, share a board."""

SAME_DIRECTION = 1e-3
"""Angle in radians below which two directions count as one; a margin for rounding."""


@dataclass(frozen=True)
class Placement:
    """One LED to place.

    Attributes:
        designator: D1, D2, ... in the order of the design.
        group: the light group it belongs to.
        model: the light's name in the library or the design.
        part: the maker's order number, or "" where the library knows none.
        position: mm, the middle of its window.
        direction: unit vector, where it shines.
        rotation: degrees, counter-clockwise seen from in front of the LED, from the rest position
            to its own `up`. At rest the height of the window points along +z as far as it can,
            or along +x where the LED shines along z.
        board: LEDs of one number lie in one plane and face one way.
        on_board: mm, x and y on the board seen from in front: y is up at rest, the origin is
            where the origin of the design falls on it, straight along the normal.
        colour: R, G, B, as in the design.
        flux: mW, radiant.
    """

    designator: str
    group: str
    model: str
    part: str
    position: tuple[float, float, float]
    direction: tuple[float, float, float]
    rotation: float
    board: int
    on_board: tuple[float, float]
    colour: tuple[float, float, float]
    flux: float


def placements(design: SensorDesign) -> list[Placement]:
    """All LEDs of a design, in its order."""
    boards: list[tuple[FloatArray, float]] = []
    found: list[Placement] = []
    for name, group in design.lights.items():
        part = part_number(group)
        for light in group.lights:
            right, up, forward = axes_at_rest(light)
            position = np.array(light.position)
            found.append(
                Placement(
                    designator=f"D{len(found) + 1}",
                    group=name,
                    model=group.model,
                    part=part,
                    position=light.position,
                    direction=_triple(forward),
                    rotation=_rotation(light, right, up),
                    board=_board(forward, float(position @ forward), boards),
                    on_board=(float(position @ right), float(position @ up)),
                    colour=group.colour,
                    flux=group.flux,
                )
            )
    return found


def axes_at_rest(light: Light) -> FloatArray:
    """(3, 3) rows: right and up of the window seen from in front, and where the light shines."""
    forward = np.array(light.direction) / np.linalg.norm(light.direction)
    right = np.cross((0.0, 0.0, 1.0), forward)
    if np.linalg.norm(right) < 1e-6:
        right = np.cross((1.0, 0.0, 0.0), forward)
    right /= np.linalg.norm(right)
    return np.array([right, np.cross(forward, right), forward])


def part_number(group: LightGroup) -> str:
    """The maker's order number for the colour of a group, "" where the library knows none."""
    colour = typical_colour(group)
    return colour[1].part or "" if colour is not None else ""


def typical_colour(group: LightGroup) -> tuple[str, TypicalLight] | None:
    """The name and numbers of a library light's colour that is the group's, or None."""
    entry = light_entry(group)
    if entry is None:
        return None
    wanted = np.array(group.colour) / sum(group.colour)
    for name, typical in entry.typical.items():
        if np.allclose(np.array(typical.colour) / sum(typical.colour), wanted, atol=1e-3):
            return name, typical
    return None


def light_entry(group: LightGroup) -> LightEntry | None:
    """The library's entry of a group's light, None where it has none that can be read."""
    try:
        entry: Any = library.entry("light", group.model)
    except LibraryError:
        return None
    assert isinstance(entry, LightEntry)
    return entry


COLUMNS = (
    "designator", "x_mm", "y_mm", "z_mm", "direction_x", "direction_y", "direction_z",
    "rotation_deg", "board", "board_x_mm", "board_y_mm", "model", "part", "group",
    "colour_r", "colour_g", "colour_b", "flux_mW",
)  # fmt: skip


def placement_csv(placed: Sequence[Placement]) -> str:
    """A pick-and-place table (RFC 4180), a row for each LED; lengths to a tenth of a micrometre."""
    text = io.StringIO()
    writer = csv.writer(text)
    writer.writerow(COLUMNS)
    for led in placed:
        writer.writerow(
            [
                led.designator,
                *(_digits(value, 4) for value in led.position),
                *(_digits(value, 6) for value in led.direction),
                _digits(led.rotation, 3),
                led.board,
                *(_digits(value, 4) for value in led.on_board),
                led.model,
                led.part,
                led.group,
                *(f"{value:g}" for value in led.colour),
                f"{led.flux:g}",
            ]
        )
    return text.getvalue()


def _rotation(light: Light, right: FloatArray, up: FloatArray) -> float:
    """Degrees from -180 (left out) to 180."""
    if light.up is None:
        return 0.0
    across, along = float(np.dot(light.up, right)), float(np.dot(light.up, up))
    if np.hypot(across, along) < 1e-6 * np.linalg.norm(light.up):
        return 0.0  # it points along the direction and says nothing
    angle = float(np.degrees(np.arctan2(-across, along)))
    return 180.0 if angle <= -180.0 + 1e-9 else angle + 0.0


def _board(forward: FloatArray, height: float, boards: list[tuple[FloatArray, float]]) -> int:
    """The number of the board of this normal and distance from the origin; a new one if none."""
    for number, (normal, distance) in enumerate(boards, start=1):
        turned = np.linalg.norm(np.cross(normal, forward)) > SAME_DIRECTION
        if not turned and normal @ forward > 0.0 and abs(distance - height) <= SAME_PLANE:
            return number
    boards.append((forward, height))
    return len(boards)


def _triple(vector: FloatArray) -> tuple[float, float, float]:
    return float(vector[0]), float(vector[1]), float(vector[2])


def _digits(value: float, digits: int) -> str:
    """Fixed digits, without a minus before zero."""
    text = f"{value:.{digits}f}"
    return text.removeprefix("-") if float(text) == 0.0 else text

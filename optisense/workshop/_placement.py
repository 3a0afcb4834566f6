"""Positions of the LEDs: in the frame of the design, and on a flat board."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from optisense import library
from optisense.array_types import FloatArray
from optisense.design import Light, LightGroup, SensorDesign
from optisense.design.lights import frame_of
from optisense.design.posing import triple
from optisense.workshop._boards import boards_of
from optisense.workshop._tables import digits, light_entry
from optisense.writing import csv_table


@dataclass(frozen=True)
class Placement:
    """Position of one LED.

    Attributes:
        designator: D1, D2, ... in the order of the design.
        group: light group of the LED.
        model: name of the light in the library or the design.
        part: the maker's order number, or "" if the library has none.
        position: middle of its window, mm.
        direction: unit vector of its direction.
        rotation: rotation in degrees, counter-clockwise seen from in front of the LED, from the
            rest position to its own `up`. At rest the height of the window points along +z as far
            as possible, or along +x if the LED shines along z.
        board: number of the board; LEDs of one number lie in one plane, or back to back on the two
            sides of one board.
        layer: "top", or "bottom" for LEDs that face away from the board's first one.
        on_board: x and y on the board seen from in front of its top, mm: y is up at rest, the
            origin is the projection of the design's origin along the normal.
        colour: R, G, B, as in the design.
        flux: radiant flux, mW.
        turn_on_board: rotation in degrees, counter-clockwise, seen from in front of the board's
            top, 0 to 360.
    """

    designator: str
    group: str
    model: str
    part: str
    position: tuple[float, float, float]
    direction: tuple[float, float, float]
    rotation: float
    board: int
    layer: str
    on_board: tuple[float, float]
    colour: tuple[float, float, float]
    flux: float
    turn_on_board: float


def placements(design: SensorDesign) -> list[Placement]:
    """Return the positions of all LEDs of a design, in its order."""
    leds = [(name, group, each) for name, group in design.lights.items() for each in group.lights]
    boards = boards_of([light for _, _, light in leds])
    found: list[Placement] = []
    for number, (name, group, light) in enumerate(leds):
        right, up, forward = frame_of(light.direction, None)
        place = boards[number]
        position = np.array(light.position)
        own_up = up if light.up is None else np.array(light.up)
        turn = np.degrees(np.arctan2(-(own_up @ place.right), own_up @ place.up))
        found.append(
            Placement(
                designator=f"D{number + 1}",
                group=name,
                model=group.model,
                part=part_number(group),
                position=light.position,
                direction=triple(forward),
                rotation=_rotation(light, right, up),
                board=place.board,
                layer="bottom" if place.bottom else "top",
                on_board=(float(position @ place.right), float(position @ place.up)),
                colour=group.colour,
                flux=group.flux,
                turn_on_board=float(turn % 360.0),
            )
        )
    return found


def part_number(group: LightGroup) -> str:
    """Return the maker's order number for the colour of a group, "" if the library has none."""
    colour = library.typical_colour(group.model, group.colour)
    return colour[1].part or "" if colour is not None else ""


def what_to_order(group: LightGroup) -> str:
    """Return the order number of a group's light, or a description of a replacement."""
    number = part_number(group)
    if number:
        return number
    entry, known = light_entry(group), library.typical_colour(group.model, group.colour)
    words = ["no order number known: any LED"]
    if known is not None:
        words[0] = f"no order number known: any {known[0]} LED"
    if entry is not None and entry.package is not None:
        words.append("of {:g} x {:g} x {:g} mm".format(*entry.package))
    if known is not None and known[1].wavelength is not None:
        words.append(f"with a dominant wavelength of {known[1].wavelength:g} nm")
    return " ".join(words)


COLUMNS = (
    "designator", "x_mm", "y_mm", "z_mm", "direction_x", "direction_y", "direction_z",
    "rotation_deg", "board", "layer", "board_x_mm", "board_y_mm", "model", "part", "group",
    "colour_r", "colour_g", "colour_b", "flux_mW",
)  # fmt: skip


def placement_csv(placed: Sequence[Placement]) -> str:
    """Return a pick-and-place table (RFC 4180), a row per LED; lengths are rounded to 0.1 um."""
    rows = [
        [
            led.designator,
            *(digits(value, 4) for value in led.position),
            *(digits(value, 6) for value in led.direction),
            *(digits(led.rotation, 3), led.board, led.layer),
            *(digits(value, 4) for value in led.on_board),
            *(led.model, led.part, led.group),
            *(f"{value:g}" for value in led.colour),
            f"{led.flux:g}",
        ]
        for led in placed
    ]
    return csv_table(COLUMNS, rows)


def _rotation(light: Light, right: FloatArray, up: FloatArray) -> float:
    """Return the rotation in degrees, from -180 (excluded) to 180."""
    if light.up is None:
        return 0.0
    across, along = float(np.dot(light.up, right)), float(np.dot(light.up, up))
    if np.hypot(across, along) < 1e-6 * np.linalg.norm(light.up):
        return 0.0  # `up` is parallel to the direction and gives no rotation
    angle = float(np.degrees(np.arctan2(-across, along)))
    return 180.0 if angle <= -180.0 + 1e-9 else angle + 0.0

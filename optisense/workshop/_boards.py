"""Assignment of LEDs to circuit boards, and to the sides of the boards."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.cluster.hierarchy import fcluster, linkage

from optisense.array_types import FloatArray
from optisense.design import Light
from optisense.design.lights import frame_of

SAME_PLANE = 0.01
"""Largest distance of LEDs' windows from one plane for which they may share a board, mm, if they
face in one direction."""

SAME_DIRECTION = 1e-3
"""Largest angle between directions that count as equal, radians: 0.06 degrees, the rounding of
directions that are written with three decimals."""

FARTHEST = 15.0
"""Largest distance between neighbouring LEDs of one board, mm; rows of LEDs in such sensors have a
pitch of 2 to 8 mm."""

THICKEST = 6.0
"""Largest distance between the windows of LEDs back to back on one board, mm: twice the highest
LEDs of the library (1.9 mm) and a board of 1.6 mm are 5.4."""


@dataclass(frozen=True)
class BoardPosition:
    """Position of an LED.

    Attributes:
        board: number of the board, from 1, in the order of the LEDs.
        bottom: whether it is on the other side than the board's first LED.
        right, up: unit vectors (3,) of the board's x and y, the same for both of its sides.
    """

    board: int
    bottom: bool
    right: FloatArray
    up: FloatArray


@dataclass
class _Side:
    """LEDs of one plane that are near one another."""

    members: list[int]
    frame: FloatArray
    height: float
    box: FloatArray


def boards_of(lights: Sequence[Light]) -> list[BoardPosition]:
    """Return the board of each LED."""
    sides = [side for plane in _planes(lights) for side in _split(lights, plane)]
    sides.sort(key=lambda side: side.members[0])
    found: dict[int, BoardPosition] = {}
    number = 0
    taken: set[int] = set()
    for index, side in enumerate(sides):
        if index in taken:
            continue
        number += 1
        right, up, _ = side.frame
        back = next((k for k in range(index + 1, len(sides))
                     if k not in taken and _back_to_back(side, sides[k])), None)  # fmt: skip
        for member in side.members:
            found[member] = BoardPosition(number, False, right, up)
        if back is not None:
            taken.add(back)
            for member in sides[back].members:
                found[member] = BoardPosition(number, True, right, up)
    return [found[index] for index in range(len(lights))]


def _planes(lights: Sequence[Light]) -> list[list[int]]:
    """Return the LEDs that face in one direction and lie in one plane, by plane."""
    planes: list[tuple[FloatArray, float, list[int]]] = []
    for index, light in enumerate(lights):
        forward = frame_of(light.direction, None)[2]
        height = float(np.array(light.position) @ forward)
        for normal, distance, members in planes:
            turned = np.linalg.norm(np.cross(normal, forward)) > SAME_DIRECTION
            if not turned and normal @ forward > 0.0 and abs(distance - height) <= SAME_PLANE:
                members.append(index)
                break
        else:
            planes.append((forward, height, [index]))
    return [members for _, _, members in planes]


def _split(lights: Sequence[Light], plane: list[int]) -> list[_Side]:
    """Return a plane's LEDs by the boards that they can be on."""
    frame = frame_of(lights[plane[0]].direction, None)
    places = np.array([lights[index].position for index in plane])
    labels = np.ones(1, dtype=np.int64)
    if len(plane) > 1:
        labels = fcluster(linkage(places, "single"), FARTHEST, "distance")
    sides = []
    for label in dict.fromkeys(labels.tolist()):
        chosen = np.flatnonzero(labels == label)
        box = np.array([places[chosen].min(axis=0), places[chosen].max(axis=0)])
        height = float(places[chosen[0]] @ frame[2])
        sides.append(_Side([plane[k] for k in chosen], frame, height, box))
    return sides


def _back_to_back(one: _Side, other: _Side) -> bool:
    """Return whether LEDs face away from one another, a board's thickness apart."""
    normal = one.frame[2]
    if normal @ other.frame[2] > -1.0 + SAME_DIRECTION**2:
        return False
    between = one.height + other.height
    gap = np.maximum(one.box[0], other.box[0]) - np.minimum(one.box[1], other.box[1])
    gap -= np.abs(normal) * gap  # they may be apart along the normal
    return bool(0.0 < between <= THICKEST and (gap <= SAME_PLANE).all())

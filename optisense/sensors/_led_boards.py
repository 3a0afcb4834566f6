"""Upright LED boards in the wall of a round sensor: bodies that block light, and light groups."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from optisense.array_types import FloatArray
from optisense.design import AreaEmitter, Light, LightGroup
from optisense.design.posing import triple
from optisense.geometry import TriangleMesh
from optisense.geometry.rotations import rotation
from optisense.sensors._sources import package

COLOURS = {"R": (1.0, 0.0, 0.0), "G": (0.0, 1.0, 0.0), "B": (0.0, 0.0, 1.0)}
"""Shares of red, green and blue in the light of each colour."""
BOARDS = 4
"""Number of LED boards around the sensor's axis: eight light groups, two on each board."""

LED_MODEL = "smd-0805"
LED = (1.25, 2.0)
"""Width (along the radius) and length of an LED's emitting window, mm: those of package 0805."""
WINDOW_GAP = 0.01
"""Distance between an LED's body and its window, mm: wide enough not to count as contact."""
WALL_MARGIN = 0.15
"""Thickness of the wall that remains on both sides of a board, mm, an assumption."""
RING_HEIGHT = 0.3
"""z of the windows of a ring of LEDs at the foot of the wall, mm, assumed: just inside it."""


@dataclass(frozen=True)
class LedBoards:
    """Four boards at 0, 90, 180 and 270 degrees, with LEDs on both faces.

    Attributes:
        radius: distance from the axis to the middle of the wall, mm.
        depth: thickness of the wall, mm.
        bottom: z of the lower edge, mm.
        height: height of a board, mm.
        thickness: thickness of a board without LEDs, mm.
        leds: number of LEDs on each face.
    """

    radius: float
    depth: float
    bottom: float
    height: float
    thickness: float
    leds: int

    @property
    def outermost(self) -> float:
        """Distance from the axis to the farthest corner of a board or an LED's window, mm."""
        board = math.hypot(self.radius + self._half_depth, 0.5 * self.thickness)
        return max(board, math.hypot(self.radius + 0.5 * LED[0], self._window))

    @property
    def _half_depth(self) -> float:
        return 0.5 * self.depth - WALL_MARGIN

    @property
    def _window(self) -> float:
        """Distance from the middle of a board to the windows of its LEDs, mm."""
        return 0.5 * self.thickness + package(LED_MODEL)[2] + WINDOW_GAP

    def _heights(self) -> FloatArray:
        """Return z of the middles of the LEDs, (leds,) mm."""
        pitch = self.height / self.leds
        return np.asarray(self.bottom + pitch * (np.arange(self.leds) + 0.5), dtype=np.float64)

    def mesh(self) -> TriangleMesh:
        """Return the boards and the bodies of the LEDs on them: closed boxes that touch."""
        across, half, high = 0.5 * self.thickness, self._half_depth, package(LED_MODEL)[2]
        top = self.bottom + self.height
        bodies = [
            TriangleMesh.box(
                (self.radius - half, -across, self.bottom), (self.radius + half, across, top)
            )
        ]
        inner, outer = self.radius - 0.5 * LED[0], self.radius + 0.5 * LED[0]
        for z in self._heights():
            for y in (-across - high, across):
                low = (inner, y, z - 0.5 * LED[1])
                bodies.append(TriangleMesh.box(low, (outer, y + high, z + 0.5 * LED[1])))
        return TriangleMesh.joined(
            [
                body.transformed(rotation((0.0, 0.0, 1.0), 90.0 * board))
                for board in range(BOARDS)
                for body in bodies
            ]
        )

    def light_groups(self, colours: str, flux: float) -> dict[str, LightGroup]:
        """Return one light group per face, `lg1` to `lg8`, anticlockwise seen from +z, with a
        letter of its colour and a flux of each LED, mW.

        Group 1 is on the board at 0 degrees and shines anticlockwise; group 2 faces it from the
        next board, and so on.
        """
        groups = {}
        for number, letter in enumerate(colours, start=1):
            side = 1.0 if number % 2 else -1.0
            turn = rotation((0.0, 0.0, 1.0), 90.0 * (number // 2 % BOARDS))
            lights = [
                Light(
                    position=triple(turn @ (self.radius, side * self._window, z)),
                    direction=triple(turn @ (0.0, side, 0.0)),
                    up=(0.0, 0.0, 1.0),
                )
                for z in self._heights()
            ]
            groups[f"lg{number}"] = _group(letter, flux, lights)
        return groups


def ring(colour: str, radius: float, count: int, flux: float) -> LightGroup:
    """Return LEDs in a ring, with a radius (mm) to their middles, at the foot of a wall that shine
    up along it; if their number is a multiple of four, none is below a board.
    """
    lights = [
        Light(
            position=(radius * math.cos(angle), radius * math.sin(angle), RING_HEIGHT),
            direction=(0.0, 0.0, 1.0),
            up=(-math.sin(angle), math.cos(angle), 0.0),
        )
        for angle in 2.0 * np.pi * (np.arange(count) + 0.5) / count
    ]
    return _group(colour, flux, lights)


def _group(letter: str, flux: float, lights: list[Light]) -> LightGroup:
    return LightGroup(
        model=LED_MODEL,
        colour=COLOURS[letter],
        flux=flux,
        emitter=AreaEmitter(shape="rectangle", size=LED),
        lights=lights,
    )

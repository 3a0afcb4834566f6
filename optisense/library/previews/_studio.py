"""Surroundings of the preview ball: a chequered floor, a uniform sky and soft lamps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from optisense.array_types import FloatArray

FLOOR = -1.0
"""Height of the chequered floor, in radii of the ball, whose middle is at 0."""
SQUARE = 0.6
"""Side of a square of the floor, in radii of the ball; about three squares are visible below it."""
DARK, BRIGHT = 0.16, 0.62
"""Reflectances of the dark and of the bright squares of the floor, which clear balls refract
visibly and without outshining the lamps."""


@dataclass(frozen=True)
class DistantLamp:
    """Round, distant lamp.

    Attributes:
        direction: unit vector (3,) towards it.
        radiance: radiance (3,) at R, G, B.
        radius: angular radius at which it has faded to half, degrees.
    """

    direction: FloatArray
    radiance: FloatArray
    radius: float

    @property
    def solid_angle(self) -> float:
        """Solid angle, steradians."""
        return float(2.0 * np.pi * (1.0 - np.cos(np.radians(self.radius))))

    def seen(self, towards: FloatArray) -> FloatArray:
        """Return the radiance (n, 3) along unit directions (n, 3)."""
        angle = np.degrees(np.arccos(np.clip(towards @ self.direction, -1.0, 1.0)))
        t = np.clip((1.15 * self.radius - angle) / (0.3 * self.radius), 0.0, 1.0)
        return np.asarray((t * t * (3.0 - 2.0 * t))[:, None] * self.radiance)


@dataclass(frozen=True)
class Studio:
    """Surroundings of the ball, which has radius 1 and is at the origin.

    Attributes:
        lamps: lamps.
        sky: radiance of the zenith; half of it on the horizon.
        floor: factor on the radiance of the floor.
        solid: darkness of the ball's shadow, 0 to 1.
    """

    lamps: list[DistantLamp]
    sky: float
    floor: float
    solid: float

    def radiance(self, start: FloatArray, towards: FloatArray, lamps: bool = True) -> FloatArray:
        """Return the radiance (n, 3) that arrives at points (n, 3) from unit directions (n, 3)."""
        height = towards[:, 2]
        light = np.repeat((self.sky * (0.5 + 0.5 * np.clip(height, 0, 1)))[:, None], 3, axis=1)
        if lamps:
            for lamp in self.lamps:
                light += lamp.seen(towards)
        down = height < -1e-6
        reach = (FLOOR - start[down, 2]) / height[down]
        place = start[down] + reach[:, None] * towards[down]
        squares = np.floor(place[:, 0] / SQUARE) + np.floor(place[:, 1] / SQUARE)
        shade = self.floor * np.where(squares % 2 == 0, DARK, BRIGHT)
        far = np.clip(reach / 30.0, 0.0, 1.0)
        hidden = np.clip(1.0 / np.linalg.norm(place, axis=1) ** 3, 0.0, 1.0)
        near = shade * (1.0 - 0.85 * self.solid * hidden)
        light[down] = ((1.0 - far) * near + far * 0.5 * self.sky)[:, None]
        return light

    def irradiance(self, normal: FloatArray) -> FloatArray:
        """Return the irradiance (n, 3) on a face for each unit normal (n, 3); lamps count as points
        of their solid angle.
        """
        up = 0.5 * (1.0 + normal[:, 2])  # the share of the sky that the face sees
        floor = 0.5 * (DARK + BRIGHT) * self.floor * (1.0 - 0.5 * self.solid)
        even = np.pi * (up * 0.8 * self.sky + (1.0 - up) * floor)
        light = np.repeat(even[:, None], 3, axis=1)
        for lamp in self.lamps:
            facing = np.maximum(normal @ lamp.direction, 0.0) * lamp.solid_angle
            light += facing[:, None] * lamp.radiance
        return light


def _lamp(
    direction: tuple[float, float, float], radiance: list[float], radius: float
) -> DistantLamp:
    vector = np.array(direction)
    return DistantLamp(vector / np.linalg.norm(vector), np.array(radiance), radius)


def white_studio(solid: float) -> Studio:
    """Return a studio with one white lamp, for materials."""
    return Studio([_lamp((-0.5, -0.6, 0.62), [3.2] * 3, 17.0)], sky=0.62, floor=1.0, solid=solid)


def coloured_studio() -> Studio:
    """Return a studio for coatings: a red, a green and a blue lamp around the view."""
    lamps = [
        _lamp((-0.86, -0.45, 0.20), [5.0, 0.1, 0.1], 19.0),
        _lamp((0.86, -0.45, 0.20), [0.1, 4.0, 0.1], 19.0),
        _lamp((0.0, -0.50, 0.86), [0.1, 0.1, 5.5], 19.0),
    ]
    return Studio(lamps, sky=0.10, floor=0.35, solid=1.0)

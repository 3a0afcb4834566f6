"""The windows of lamps: the radiance that rays meet which end on the emitting face of a light."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from optisense.array_types import FloatingArray
from optisense.design.emitters import Intensity
from optisense.geometry.connected import connected_components
from optisense.optics.backend.arrays import floats, indices
from optisense.optics.scene._lamp_places import SIGNS
from optisense.optics.scene.emitters import UP_TURN, Emitter, EmitterShape

POLAR_STEPS = 720
"""Number of steps of a tabulated profile over the polar angles from 0 to 180 degrees: steps of a
quarter of a degree, finer than the tables of luminaires (1 degree and more)."""
AZIMUTH_STEPS = 120
"""Number of its steps over the azimuth: 3 degrees, where the usual tables have 5 and more."""
MIN_COSINE = 0.01
"""Lower bound on the cosine at a window by which the intensity of a table is divided. Some tables
have light at 90 degrees, where a flat window has no area."""
FLOATS_PER_WINDOW = 12
"""Number of floats of a window in the table; three gathers of four floats read them."""
SAME_PLACE = 1e-6
"""Largest distance (mm) between positions and corners, and largest difference between unit normals,
of two windows that are one: it covers the rounding of numbers in files, and is far below
`RAY_OFFSET`, at which windows are two for rays."""


@dataclass(frozen=True)
class LampWindows:
    """The emitting faces of lights of 1 mW.

    Attributes:
        rows: `FLOATS_PER_WINDOW` floats per light: the axis and a factor on the radiance, the width
            axis and the exponent of the profile, and the number of its table, plus 1. The first
            entry stands for no light, and the lights follow in their order.
        groups: light group of each entry.
        profiles: intensity (1/sr) of each table, of a power of 1 over all directions, on a grid of
            polar angles and of angles from the width axis.
        exist: whether any light has a window.
        after: for each entry, the next one with the same window, in a ring; None if every light has
            a window of its own.
    """

    rows: mi.Float
    groups: mi.UInt32
    profiles: mi.Float
    exist: bool
    after: mi.UInt32 | None = None

    @classmethod
    def of(cls, emitters: list[Emitter]) -> LampWindows:
        """Return the windows of lights; those of points have no radiance."""
        rows = np.zeros((len(emitters) + 1, FLOATS_PER_WINDOW), dtype=np.float32)
        rows[0, 7] = 1  # any exponent
        numbers: dict[int, int] = {}
        tables: list[FloatingArray] = []
        for row, emitter in zip(rows[1:], emitters, strict=True):
            area = emitter.area
            row[0:3], row[4:7] = emitter.frame[2], emitter.frame[0]
            row[7] = emitter.exponent
            if emitter.intensity is None:
                scale = (emitter.exponent + 1) / (2 * np.pi)
            else:
                number = numbers.setdefault(id(emitter.intensity), len(numbers))
                if number == len(tables):
                    tables.append(_grid(emitter.intensity))
                row[8:9] = np.array([number + 1], dtype=np.uint32).view(np.float32)
                scale = 1.0
            row[3] = scale / area if area > 0 else 0.0
        groups = np.array([0, *(emitter.group for emitter in emitters)])
        profiles = np.array(tables) if tables else np.zeros(1)
        exist = bool(rows[:, 3].any())
        rings = _rings(emitters)
        if not rings:
            return cls(floats(rows), indices(groups), floats(profiles), exist)
        after = np.arange(len(rows))
        for ring in rings:
            after[ring] = np.roll(ring, -1)
        return cls(floats(rows), indices(groups), floats(profiles), exist, indices(after))

    @dr.syntax
    def add_radiances(
        self,
        light: mi.UInt32,
        direction: mi.Vector3f,
        add: Callable[[mi.Float, mi.UInt32, mi.Bool], None],
    ) -> None:
        """Call a function with `radiance` of the lights whose windows rays end on, then of the
        other lights that have the same window, such as the three colours of an RGB LED.

        The function is recorded twice, whatever the number of lights, or once if every light has a
        window of its own.
        """
        add(*self.radiance(light, direction))
        if dr.hint(self.after is not None, mode="scalar"):
            other = dr.gather(mi.UInt32, self.after, light)
            while dr.hint(other != light, exclude=[self, light, direction, add]):
                add(*self.radiance(other, direction))
                other = dr.gather(mi.UInt32, self.after, other)

    def radiance(
        self, light: mi.UInt32, direction: mi.Vector3f
    ) -> tuple[mi.Float, mi.UInt32, mi.Bool]:
        """Return the radiance (n,), 1/(mm^2 sr), of windows in unit directions away from them,
        their light groups (n,), and whether there is a window.

        A window of area A whose intensity is proportional to cos^m has the radiance
        (m + 1) / (2 pi A) cos^(m - 1): 1 / (pi A) if it is Lambertian.

        Args:
            light: number + 1 (n,) of the light, 0 for none.
        """
        lit = light > 0
        first = dr.gather(mi.Vector4f, self.rows, light * 3, lit)
        second = dr.gather(mi.Vector4f, self.rows, light * 3 + 1, lit)
        third = dr.gather(mi.Vector4f, self.rows, light * 3 + 2, lit)
        axis = mi.Vector3f(first.x, first.y, first.z)
        aside = mi.Vector3f(second.x, second.y, second.z)
        profile = dr.reinterpret_array(mi.UInt32, third.x)
        tabulated = lit & (profile > 0)
        cosine = dr.maximum(dr.dot(axis, direction), MIN_COSINE)
        x, y = dr.dot(aside, direction), dr.dot(dr.cross(axis, aside), direction)
        intensity = self._intensity(profile, dr.dot(axis, direction), dr.atan2(y, x), tabulated)
        shape = dr.select(tabulated, intensity / cosine, dr.power(cosine, second.w - 1))
        return shape * first.w, dr.gather(mi.UInt32, self.groups, light, lit), lit

    def _intensity(
        self, profile: mi.UInt32, cosine: mi.Float, angle: mi.Float, active: mi.Bool
    ) -> mi.Float:
        """Return the intensity (n,) of tables at an angle (radians) from the width axis."""
        up = dr.safe_acos(cosine) * (POLAR_STEPS / dr.pi)
        turn = angle * (AZIMUTH_STEPS / dr.two_pi)
        turn = dr.select(turn < 0, turn + AZIMUTH_STEPS, turn)
        i = dr.minimum(mi.UInt32(up), POLAR_STEPS - 1)
        j = dr.minimum(mi.UInt32(turn), AZIMUTH_STEPS - 1)
        across = POLAR_STEPS + 1
        start = ((dr.maximum(profile, 1) - 1) * (AZIMUTH_STEPS + 1) + j) * across + i
        one, next_one, other, next_other = (
            dr.gather(mi.Float, self.profiles, start + step, active)
            for step in (0, 1, across, across + 1)
        )
        f, g = up - mi.Float(i), turn - mi.Float(j)
        return dr.lerp(dr.lerp(one, next_one, f), dr.lerp(other, next_other, f), g)


def _rings(emitters: list[Emitter]) -> list[NDArray[np.int64]]:
    """Return the numbers + 1 of the lights of each window that several lights have."""
    lamps = [(number, lamp) for number, lamp in enumerate(emitters) if lamp.area > 0]
    if not lamps:
        return []
    places = cKDTree([lamp.position for _, lamp in lamps])
    pairs = [
        (lamps[i][0], lamps[j][0])
        for i, j in places.query_pairs(SAME_PLACE)
        if _is_same_window(lamps[i][1], lamps[j][1])
    ]
    if not pairs:
        return []
    part = connected_components(len(emitters), *np.array(pairs).T)
    shared = np.flatnonzero(np.bincount(part) > 1)
    return [np.flatnonzero(part == number) + 1 for number in shared]


def _is_same_window(one: Emitter, other: Emitter) -> bool:
    """Return whether the windows of two lights at one position coincide: discs have no `up`, and a
    rectangle turned by a half turn, or a quarter turn with its sides exchanged, is the same.
    """
    if one.shape is not other.shape:
        return False
    if np.linalg.norm(one.frame[2] - other.frame[2]) > SAME_PLACE:
        return False
    if one.shape is EmitterShape.DISC:
        return abs(one.size[0] - other.size[0]) <= SAME_PLACE
    away = np.linalg.norm(_corners(one)[:, None] - _corners(other), axis=2)
    return bool((away.min(axis=1) <= SAME_PLACE).all())


def _corners(emitter: Emitter) -> FloatingArray:
    """Return the corners (4, 3), mm, of a rectangular window."""
    across = np.array(emitter.size)[:, None] / 2 * emitter.frame[:2]
    return np.asarray(np.array(emitter.position) + SIGNS @ across)


def _grid(intensity: Intensity) -> FloatingArray:
    """Return the intensity (azimuths, polar angles), 1/sr, of a power of 1 on a grid of angles."""
    polar = np.linspace(0, 180, POLAR_STEPS + 1)
    turn = np.linspace(0, 360, AZIMUTH_STEPS + 1)
    values = intensity.at(*np.broadcast_arrays(polar, turn[:, None] - UP_TURN))
    # The trapezoidal rule in azimuth; in the polar angle, cells have their exact solid angle.
    ring = (values[1:] + values[:-1]).mean(axis=0) / 2
    cells = -np.diff(np.cos(np.radians(polar)))
    power = 2 * np.pi * ((ring[1:] + ring[:-1]) / 2 * cells).sum()
    return np.asarray(values / power)

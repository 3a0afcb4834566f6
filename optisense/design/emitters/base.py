"""The interface of all kinds of lamps."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field

from optisense.array_types import FloatArray, FloatingArray
from optisense.design.fields import DEGREES, Number
from optisense.design.kinds import KindModel, Limits, fills
from optisense.errors import DesignError, LibraryError
from optisense.registry import Registry
from optisense.text import brief

HalfAngle = Annotated[Number, Field(gt=0.0, le=90.0, json_schema_extra=DEGREES)]
"""Angle from the axis of a lamp that shines forward, degrees."""

COARSE_POLAR = 0.25
"""Step of the polar angles at which the end of a beam is searched, degrees: beams are rarely
narrower than this, and for narrower ones the axis is kept."""

DARK = 1e-6
"""Smallest share of the peak intensity that counts as light, far below the noise of any picture."""

POLAR_ANGLES = 1025
"""Number of polar angles of a table over the beam; over 90 degrees they are 0.09 degrees apart."""

WINDOW_SIDES = Limits("a width and a height above 0 mm", (2,), above=0.0)
"""Limits of the sides of a window, mm."""

COSINE_POWER = Limits("a number that is not negative", low=0.0)
"""Limits of the exponent of a lamp whose intensity is a power of the cosine."""

AZIMUTHS = 145
"""Number of azimuths of an unsymmetric lamp's table: every 2.5 degrees, with 0 and 360."""

SYMMETRIC = 1e-9
"""Largest difference between azimuths, as a share of the peak, of a lamp that is symmetric about
its axis: rounding only."""


@dataclass(frozen=True, eq=False)
class Intensity:
    """Radiant intensity over the polar angle from the axis and the azimuth.

    Attributes:
        polar: polar angles (n,), degrees, ascending from 0.
        azimuth: azimuths (m,), degrees: 0 alone if the lamp is symmetric, else from 0 to 360.
        values: relative intensity (m, n), linear between the angles and 0 beyond the last one.
    """

    polar: FloatingArray
    azimuth: FloatingArray
    values: FloatingArray

    def at(self, polar: FloatingArray, azimuth: FloatingArray) -> FloatingArray:
        """Return the relative intensity (...) at polar angles and azimuths (...), degrees."""
        p = np.clip(np.interp(polar, self.polar, np.arange(len(self.polar))), 0, None)
        i = np.minimum(p.astype(int), max(len(self.polar) - 2, 0))
        f = p - i
        i1 = np.minimum(i + 1, len(self.polar) - 1)
        if len(self.azimuth) == 1:
            j = j1 = np.zeros(np.shape(polar), dtype=int)
            g = np.zeros(np.shape(polar))
        else:
            q = np.interp(np.mod(azimuth, 360.0), self.azimuth, np.arange(len(self.azimuth)))
            j = np.minimum(q.astype(int), len(self.azimuth) - 2)
            g, j1 = q - j, j + 1
        low = self.values[j, i] * (1 - f) + self.values[j, i1] * f
        high = self.values[j1, i] * (1 - f) + self.values[j1, i1] * f
        inside = (polar >= self.polar[0]) & (polar <= self.polar[-1])
        return np.where(inside, low * (1 - g) + high * g, 0.0)

    def without_azimuth(self) -> Intensity:
        """Return the table with one azimuth if it is symmetric about the axis, else itself."""
        if np.ptp(self.values, axis=0).max() > SYMMETRIC * self.values.max():
            return self
        return Intensity(self.polar, np.zeros(1), self.values[:1])


@dataclass(frozen=True)
class Window:
    """Flat face that a lamp's light leaves through, with uniform density over its area.

    Attributes:
        shape: disc (or ellipse) or rectangle.
        size: width and height, mm.
    """

    shape: Literal["disc", "rectangle"]
    size: tuple[float, float]

    @property
    def is_valid(self) -> bool:
        """True if the shape is known and the size is positive."""
        known = self.shape in ("disc", "rectangle")
        return known and isinstance(self.size, tuple) and WINDOW_SIDES.allow(self.size)


class LightModel(KindModel):
    """Emission of a lamp; each kind of lamp is a subclass.

    A kind needs its fields and `relative_intensity`; code that simulates, draws or lists lamps
    calls only the methods below. Angles are in degrees: polar from the light's direction, 0 to 180;
    azimuth about it, 0 at the light's `up` and right-handed, so that azimuth 90 is at the cross
    product of direction and `up`.
    """

    kinds: ClassVar[Registry[Any]] = Registry(
        "kind of emitter",
        "optisense.emitters",
        DesignError,
        {
            "area": "optisense.design.emitters._lamps:AreaEmitter",
            "ies": "optisense.design.emitters._lamps:IesEmitter",
            "spot": "optisense.design.emitters._lamps:SpotEmitter",
        },
    )

    @abstractmethod
    def relative_intensity(self, polar: ArrayLike, azimuth: ArrayLike = 0.0) -> FloatArray:
        """Return the radiant intensity over its largest value, in the shape of the angles.

        Args:
            polar: angle (...) from the light's direction, degrees.
            azimuth: angle about it, degrees, of a shape that broadcasts with `polar`.

        Raises:
            OptiSenseError: a file of the lamp can't be read.
        """

    def window(self) -> Window | None:
        """Return the face that the light leaves through; None for a point."""
        return None

    def cosine_power(self) -> float | None:
        """Return the exponent p if the intensity is the cosine to the power of p, which is sampled
        exactly; else None, and the intensity is sampled from its table.
        """
        return None

    def angles(self) -> tuple[FloatArray, FloatArray]:
        """Return polar (n,) and azimuth (m,) angles, degrees, of a table of the intensity.

        Between these angles, the intensity is nearly linear. Both ascend; polar angles start at 0
        and end where the light does, azimuths run from 0 to 360 inclusive.
        """
        azimuth = np.linspace(0.0, 360.0, AZIMUTHS)
        polar = np.arange(0.0, 180.0 + COARSE_POLAR, COARSE_POLAR)
        light = self.relative_intensity(polar[:, None], azimuth[None, :]).max(axis=1)
        bright = light > DARK
        last = int(np.flatnonzero(bright)[-1]) if bright.any() else 0
        return np.linspace(0.0, polar[min(last + 1, len(polar) - 1)], POLAR_ANGLES), azimuth

    def intensity(self) -> Intensity:
        """Return the intensity as a table, which the simulation samples.

        Raises:
            OptiSenseError: a file of the lamp can't be read.
        """
        polar, azimuth = self.angles()
        values = self.relative_intensity(polar[None, :], azimuth[:, None])
        shape = (len(azimuth), len(polar))
        return Intensity(polar, azimuth, np.broadcast_to(values, shape)).without_azimuth()

    def half_angle(self, azimuth: float = 0.0) -> float:
        """Return the angle from the axis, degrees, at which the intensity is half that on the axis.

        The result is 180 if there is no such angle, or if the axis is dark.

        Args:
            azimuth: azimuth of the plane in which the angle is measured, degrees.
        """
        angle = np.linspace(0.0, 180.0, 7201)
        value = self.relative_intensity(angle, azimuth)
        below = np.flatnonzero(value < 0.5 * value[0] * (1.0 - 1e-9))
        if value[0] <= 0.0 or len(below) == 0:
            return 180.0
        last, first = below[0] - 1, below[0]
        drop = value[last] - value[first]
        return float(angle[last] + (value[last] - 0.5 * value[0]) / drop * (angle[1] - angle[0]))

    def in_words(self) -> str:
        """Return the kind of lamp and its most informative number, in a few words."""
        return f"{self.kind}, half at {self.half_angle():.3g} degrees"

    def _check_results(self) -> None:
        """Refuse an intensity that is not finite, is negative or is 0 everywhere, and a window or
        an exponent that can't be used.
        """
        window, power = self.window(), self.cosine_power()
        if window is not None and not (isinstance(window, Window) and window.is_valid):
            raise LibraryError(
                f"the window of an emitter of kind '{self.kind}' is {brief(repr(window))}",
                hint="Return None, or a Window of shape 'disc' or 'rectangle', with "
                f"{WINDOW_SIDES.words}",
            )
        if power is not None and not COSINE_POWER.allow(power):
            raise LibraryError(
                f"the cosine power of an emitter of kind '{self.kind}' is {brief(repr(power))}",
                hint=f"Return None, or {COSINE_POWER.words}",
            )
        azimuth = np.linspace(0.0, 360.0, AZIMUTHS)
        polar = np.arange(0.0, 180.0 + COARSE_POLAR, COARSE_POLAR)
        around = self.relative_intensity(polar[:, None], azimuth[None, :])
        if not fills(around, np.broadcast_shapes(polar[:, None].shape, azimuth[None, :].shape)):
            raise LibraryError(
                f"the intensity of an emitter of kind '{self.kind}' is {brief(repr(around))}",
                hint="Return an array in the shape of the angles",
            )
        values = np.concatenate([np.ravel(around), np.ravel(self.intensity().values)])
        from_0 = Limits("finite and not negative", values.shape, low=0.0)
        if not from_0.allow(values) or values.max() <= 0.0:
            raise LibraryError(
                f"the intensity of an emitter of kind '{self.kind}' must be "
                f"{from_0.words} from 0 to 180 degrees, and above 0 somewhere",
                hint="Change its numbers",
            )

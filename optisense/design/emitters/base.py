"""The interface of all kinds of lamps."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from optisense.design.emitters.intensity import Intensity
from optisense.design.fields import DEGREES, Number
from optisense.design.kinds import KindModel
from optisense.errors import DesignError, LibraryError
from optisense.registry import Registry

FloatArray = NDArray[np.float64]

HalfAngle = Annotated[Number, Field(gt=0.0, le=90.0, json_schema_extra=DEGREES)]
"""An angle from the axis, in degrees, of a lamp that shines forward."""

COARSE_POLAR = 0.25
"""Degrees between the angles at which the end of a beam is looked for: a beam is rarely narrower
than this, and one that is keeps its axis."""

DARK = 1e-6
"""A share of the peak: a lamp that sends less than this counts as dark."""

POLAR_ANGLES = 1025
"""Polar angles of a table over the beam; a beam of 90 degrees gets one every 0.09 degrees."""

AZIMUTHS = 145
"""Azimuths of a table of a lamp that is not symmetric: one every 2.5 degrees, both 0 and 360."""


@dataclass(frozen=True)
class Window:
    """The flat face that a lamp's light leaves through, evenly over its area.

    Attributes:
        shape: disc (or ellipse) or rectangle.
        size: mm, width and height.
    """

    shape: Literal["disc", "rectangle"]
    size: tuple[float, float]

    @property
    def area(self) -> float:
        """mm^2 of the face."""
        filled = np.pi / 4 if self.shape == "disc" else 1.0
        return float(self.size[0] * self.size[1] * filled)


class LightModel(KindModel):
    """The emission of a lamp; each kind of lamp is a subclass.

    A kind needs its fields and `relative_intensity`; whatever simulates, draws or lists lamps
    asks the methods below and nothing else. Angles are in degrees: polar from the light's
    direction, 0 to 180; azimuth about it, 0 at the light's `up`.
    """

    kinds: ClassVar[Registry[Any]] = Registry(
        "kind of emitter",
        "optisense.emitters",
        DesignError,
        {
            "area": "optisense.design.emitters.area:AreaEmitter",
            "ies": "optisense.design.emitters.ies:IesEmitter",
            "spot": "optisense.design.emitters.spot:SpotEmitter",
        },
    )

    @abstractmethod
    def relative_intensity(self, polar: ArrayLike, azimuth: ArrayLike = 0.0) -> FloatArray:
        """Radiant intensity over its largest value, at angles of any shapes that broadcast.

        Raises:
            OptiSenseError: a file of the lamp can't be read.
        """

    def window(self) -> Window | None:
        """The face that the light leaves through; None for a point."""
        return None

    def cosine_power(self) -> float | None:
        """The power of the cosine that the intensity is, where it is one: it is sampled exactly
        then. None, and it is sampled from its table."""
        return None

    def angles(self) -> tuple[FloatArray, FloatArray]:
        """Polar (n,) and azimuth (m,) angles between which the intensity is nearly linear.

        Both ascend; polar angles start at 0 and end where the light does, azimuths run from 0 to
        360 inclusive.
        """
        azimuth = np.linspace(0.0, 360.0, AZIMUTHS)
        polar = np.arange(0.0, 180.0 + COARSE_POLAR, COARSE_POLAR)
        light = self.relative_intensity(polar[:, None], azimuth[None, :]).max(axis=1)
        bright = light > DARK
        last = int(np.flatnonzero(bright)[-1]) if bright.any() else 0
        return np.linspace(0.0, polar[min(last + 1, len(polar) - 1)], POLAR_ANGLES), azimuth

    def intensity(self) -> Intensity:
        """The intensity as a table, which the simulation samples.

        Raises:
            OptiSenseError: a file of the lamp can't be read.
        """
        polar, azimuth = self.angles()
        values = self.relative_intensity(polar[None, :], azimuth[:, None])
        shape = (len(azimuth), len(polar))
        return Intensity(polar, azimuth, np.broadcast_to(values, shape)).without_azimuth()

    def half_angle(self, azimuth: float = 0.0) -> float:
        """Degrees from the axis at which the intensity has fallen to half its value there.

        180 where it never does, or where the axis is dark.
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
        """The kind of lamp and its most telling number, in a few words."""
        return f"{self.kind}, half at {self.half_angle():.3g} degrees"

    def check(self) -> None:
        """Find out whether the lamp can be simulated.

        Raises:
            OptiSenseError: its intensity is not finite, is negative, or is 0 everywhere, or a
                file of it can't be read.
        """
        values = self.intensity().values
        if not np.isfinite(values).all() or values.min() < 0.0 or values.max() <= 0.0:
            raise LibraryError(
                f"the intensity of an emitter of kind '{self.kind}' must be finite and not "
                "negative, and above 0 somewhere",
                hint="Change its numbers",
            )

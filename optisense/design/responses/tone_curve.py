"""Tone curves: from the linear level of a channel to the stored level."""

from __future__ import annotations

from abc import abstractmethod
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from optisense.array_types import FloatingArray
from optisense.design.colour import encode, srgb_curve
from optisense.design.fields import Fraction, InconsistentValueError, Positive
from optisense.design.kinds import KindModel
from optisense.design.responses.base import LEVELS, ramp
from optisense.errors import DesignError
from optisense.registry import Registry


class ToneCurve(KindModel):
    """Conversion of linear levels, 0 to 1, into stored ones, 0 to 1; each kind is a subclass."""

    kinds: ClassVar[Registry[Any]] = Registry(
        "kind of tone curve",
        "optisense.tone_curves",
        DesignError,
        {
            "srgb": "optisense.design.responses.tone_curve:SrgbCurve",
            "gamma": "optisense.design.responses.tone_curve:GammaCurve",
            "points": "optisense.design.responses.tone_curve:PointsCurve",
        },
    )

    def _check_own_kind(self) -> None:
        """Check the stored levels of a ramp."""
        self._require("curve", self.curve(ramp(1.0)), LEVELS)

    @abstractmethod
    def curve(self, linear: FloatingArray) -> NDArray[np.float64]:
        """Return the stored levels (...), 0 to 1 before rounding, of linear levels (...).

        Linear levels are clipped to 0..1.
        """

    def encode(self, linear: FloatingArray) -> NDArray[np.uint8]:
        """Return the stored levels (...) in 8 bits."""
        return np.round(255.0 * self.curve(linear)).astype(np.uint8)


class SrgbCurve(ToneCurve):
    """The transfer curve of sRGB (IEC 61966-2-1)."""

    title: ClassVar[str] = "sRGB"

    kind: Literal["srgb"] = "srgb"

    def curve(self, linear: FloatingArray) -> NDArray[np.float64]:
        """Return the stored levels (...), 0 to 1: a power of 1 / 2.4, linear in the dark."""
        return srgb_curve(linear)

    def encode(self, linear: FloatingArray) -> NDArray[np.uint8]:
        """Return the stored levels (...) in 8 bits, in single precision."""
        return encode(linear)


class GammaCurve(ToneCurve):
    """A power: the stored level is the linear one to the power of 1 / gamma."""

    title: ClassVar[str] = "Gamma"

    kind: Literal["gamma"] = "gamma"
    gamma: Positive = Field(default=2.2, description="1 stores linear levels", examples=[2.2])

    def curve(self, linear: FloatingArray) -> NDArray[np.float64]:
        """Return the stored levels (...), 0 to 1: a power of linear levels (...)."""
        level = np.clip(np.asarray(linear, dtype=float), 0.0, 1.0)
        return np.asarray(level ** (1.0 / self.gamma))


class PointsCurve(ToneCurve):
    """Straight pieces between given points, as cameras store their tone curves."""

    title: ClassVar[str] = "Points"

    kind: Literal["points"] = "points"
    points: Annotated[list[tuple[Fraction, Fraction]], Field(min_length=2)] = Field(
        description="linear level and stored level of each point, rising",
        examples=[[(0.0, 0.0), (0.1, 0.33), (0.5, 0.84), (1.0, 1.0)]],
    )

    @model_validator(mode="after")
    def _rises(self) -> PointsCurve:
        linear, stored = np.array(self.points).T
        for number, (step, rise) in enumerate(zip(np.diff(linear), np.diff(stored), strict=True)):
            if step <= 0.0 or rise < 0.0:
                raise InconsistentValueError(
                    f"the tone curve does not rise from point {number} {self.points[number]} to "
                    f"point {number + 1} {self.points[number + 1]}",
                    ("points", number + 1),
                    "Give points of rising linear levels whose stored levels never fall",
                )
        if linear[0] != 0.0 or linear[-1] != 1.0:
            raise InconsistentValueError(
                f"the tone curve runs from {linear[0]:g} to {linear[-1]:g}",
                ("points",),
                "Let the first point have a linear level of 0 and the last one of 1",
            )
        return self

    def curve(self, linear: FloatingArray) -> NDArray[np.float64]:
        """Return the stored levels (...), 0 to 1, interpolated between the points."""
        return np.interp(np.clip(linear, 0.0, 1.0), *np.array(self.points).T)

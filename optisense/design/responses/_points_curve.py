"""Tone curve through given points."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from optisense.array_types import FloatingArray
from optisense.design.fields import Fraction, InconsistentValueError
from optisense.design.responses._tone_curve import ToneCurve


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

"""Blur by limited depth of field."""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np
from pydantic import Field

from optisense.array_types import FloatingArray
from optisense.design.fields import MILLIMETRES, Positive
from optisense.design.lenses.blur import LensBlur, LensView

DISC_DEVIATION = 0.25
"""Standard deviation along an axis of a uniformly lit disc, divided by its diameter."""


class Defocus(LensBlur):
    """Blur of a thin lens: a point nearer or farther than the focus is spread over a disc.

    A point at the distance z from the entrance pupil is seen under the angle A |1/z - 1/z_f|, with
    A the diameter of the entrance pupil and z_f the distance in focus: the circle of confusion. The
    disc is replaced by a normal distribution of the same variance.
    """

    title: ClassVar[str] = "Defocus"
    by_depth: ClassVar[bool] = True

    kind: Literal["defocus"] = "defocus"
    focal_length: Positive = Field(
        description="focal length of the lens", examples=[3.04], json_schema_extra=MILLIMETRES
    )
    f_number: Positive = Field(
        description="focal length over the diameter of the entrance pupil", examples=[2.0]
    )
    focus_distance: Positive = Field(
        description="distance in focus, from the entrance pupil, in air",
        examples=[25.0],
        json_schema_extra=MILLIMETRES,
    )

    def circle(self, camera: LensView, vergence: FloatingArray) -> FloatingArray:
        """Return the diameter (...) of the circle of confusion, as a share of the picture's width.

        Args:
            vergence: inverse (...) of the apparent distance, 1/mm.
        """
        pupil = self.focal_length / self.f_number
        angle = pupil * np.abs(vergence - 1.0 / self.focus_distance)
        return np.asarray(angle * camera.angle_scale)

    def deviation(self, camera: LensView, vergence: FloatingArray) -> FloatingArray:
        """Return the standard deviation (...) of the disc: a quarter of the circle's diameter.

        Args:
            vergence: inverse (...) of the apparent distance, 1/mm.
        """
        return DISC_DEVIATION * self.circle(camera, vergence)

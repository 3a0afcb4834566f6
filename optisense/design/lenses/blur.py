"""Blur: how a lens spreads the light of a point over the picture.

The spread is a normal distribution, whose standard deviation is given as a share of the picture's
width, so that it does not depend on the resolution of a render.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import Annotated, Any, ClassVar, Literal, Protocol

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from scipy.ndimage import gaussian_filter

from optisense.design.fields import MILLIMETRES, NonNegative, Positive
from optisense.design.kinds import KindModel
from optisense.errors import DesignError
from optisense.registry import Registry

FloatArray = NDArray[np.floating]

HOME = "optisense.design.lenses.blur"

DISC_DEVIATION = 0.25
"""Standard deviation along an axis of a uniformly lit disc, over its diameter."""

REACH = 4.0
"""Standard deviations after which a blur ends (SciPy's own choice)."""

LEAST_WIDTH = 0.05
"""Standard deviation in pixels below which a blur changes a picture by less than 1e-5."""

STEPS = 6
"""Widths from which a blur that varies over the picture is interpolated. Between two of them the
variance is right exactly, as it is that of a mixture; only the shape of the spread is between."""

LARGEST = 0.25
"""Standard deviation, a share of the picture's width, of the widest blur: all is blurred away."""


class LensView(Protocol):
    """What a blur may ask about a camera."""

    @property
    def resolution(self) -> tuple[int, int]:
        """Pixels, width and height."""

    @property
    def angle_scale(self) -> float:
        """Widths of the picture a radian, in its middle."""


class LensBlur(KindModel):
    """How wide a lens spreads the light of a point; each kind is a subclass."""

    kinds: ClassVar[Registry[Any]] = Registry(
        "kind of lens blur",
        "optisense.blurs",
        DesignError,
        {"gaussian": f"{HOME}:GaussianBlur", "defocus": f"{HOME}:Defocus"},
    )

    by_depth: ClassVar[bool] = False
    """Whether it depends on how far away things are."""

    @abstractmethod
    def deviation(self, camera: LensView, vergence: FloatArray) -> FloatArray:
        """Standard deviation as a share of the picture's width.

        Args:
            camera: whose lens it is.
            vergence: (...) 1/mm: one over the distance at which what a pixel sees appears to lie.
                Where `by_depth` is false, it is a single 0.
        """


class GaussianBlur(LensBlur):
    """The same width everywhere."""

    title: ClassVar[str] = "Gaussian"

    kind: Literal["gaussian"] = "gaussian"
    width: Annotated[NonNegative, Field(le=1000.0)] = Field(
        description="standard deviation in pixels of the camera's own resolution",
        examples=[0.7],
        json_schema_extra={"unit": "pixels"},
    )

    def deviation(self, camera: LensView, vergence: FloatArray) -> FloatArray:
        """The width over the pixels across."""
        return np.asarray(self.width / camera.resolution[0]) + 0.0 * vergence


class Defocus(LensBlur):
    """A thin lens: what lies nearer or farther than the focus is spread over a disc.

    A point at the distance z from the entrance pupil is seen under the angle A |1/z - 1/z_f|, with
    A the diameter of the entrance pupil and z_f the distance in focus: the circle of confusion. Its
    disc is taken for a normal distribution of the same variance.
    """

    title: ClassVar[str] = "Defocus"
    by_depth: ClassVar[bool] = True

    kind: Literal["defocus"] = "defocus"
    focal_length: Positive = Field(
        description="of the lens", examples=[3.04], json_schema_extra=MILLIMETRES
    )
    f_number: Positive = Field(
        description="focal length over the diameter of the entrance pupil", examples=[2.0]
    )
    focus_distance: Positive = Field(
        description="from the entrance pupil to what is sharp, in air",
        examples=[25.0],
        json_schema_extra=MILLIMETRES,
    )

    def circle(self, camera: LensView, vergence: FloatArray) -> FloatArray:
        """Diameter of the circle of confusion, as a share of the picture's width."""
        pupil = self.focal_length / self.f_number
        angle = pupil * np.abs(vergence - 1.0 / self.focus_distance)
        return np.asarray(angle * camera.angle_scale)

    def deviation(self, camera: LensView, vergence: FloatArray) -> FloatArray:
        """A quarter of the circle's diameter."""
        return DISC_DEVIATION * self.circle(camera, vergence)


def reach_of(deviation: float, width: int) -> int:
    """Pixels as far as a blur reaches in a picture so many pixels wide."""
    return int(np.ceil(REACH * min(deviation, LARGEST) * width)) + 1


def blurred(levels: FloatArray, deviation: FloatArray) -> FloatArray:
    """Levels (h, w, 3) blurred by standard deviations in pixels, () or (h, w)."""
    widths = np.asarray(deviation, dtype=np.float64)
    low, high = float(widths.min()), float(widths.max())
    if high < LEAST_WIDTH:
        return levels
    if high - low < LEAST_WIDTH:
        return _spread(levels, 0.5 * (low + high))
    steps = np.sqrt(np.linspace(low**2, high**2, STEPS))
    place = np.clip(np.interp(widths**2, steps**2, np.arange(STEPS)), 0.0, STEPS - 1.0)
    total = np.zeros_like(levels, dtype=np.float32)
    for number, width in enumerate(steps):
        weight = np.maximum(1.0 - np.abs(place - number), 0.0).astype(np.float32)
        if weight.any():
            total += weight[..., None] * _spread(levels, float(width))
    return total


def _spread(levels: FloatArray, width: float) -> FloatArray:
    if width < LEAST_WIDTH:
        return levels
    return np.asarray(gaussian_filter(levels, (width, width, 0.0), truncate=REACH, mode="nearest"))

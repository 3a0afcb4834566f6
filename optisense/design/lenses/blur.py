"""Blur of a lens: the point spread function.

It is a normal distribution, whose standard deviation is given as a share of the picture's
width, so that it does not depend on the resolution of a render.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, Protocol

import numpy as np
from pydantic import Field

from optisense.array_types import FloatingArray
from optisense.design.fields import MILLIMETRES, NonNegative, Positive
from optisense.design.kinds import KindModel, Limits, fills
from optisense.errors import DesignError
from optisense.registry import Registry

REACH = 4.0
"""Radius at which a blur is cut off, in standard deviations (SciPy's default)."""

LEAST_WIDTH = 0.05
"""Smallest standard deviation applied, pixels; smaller blurs change levels by below 1e-5."""

STEPS = 6
"""Number of widths from which a blur that varies over the picture is interpolated. Between two of
them the variance is exact, as it is that of a mixture; only the shape of the spread is
interpolated."""

LARGEST = 0.25
"""Largest standard deviation of a blur, as a share of the picture's width; it leaves no detail."""

DISC_DEVIATION = 0.25
"""Standard deviation along an axis of a uniformly lit disc, divided by its diameter."""


class LensView(Protocol):
    """Properties of a camera that a blur can depend on."""

    @property
    def resolution(self) -> tuple[int, int]:
        """Width and height of the picture, pixels."""

    @property
    def angle_scale(self) -> float:
        """Scale in the middle of the picture, in widths of the picture per radian."""


class _SomeView(NamedTuple):
    """Camera by which own kinds are tried."""

    resolution: tuple[int, int] = (640, 480)
    angle_scale: float = 1.0


class LensBlur(KindModel):
    """The point spread function of a lens; each kind is a subclass."""

    kinds: ClassVar[Registry[Any]] = Registry(
        "kind of lens blur",
        "optisense.blurs",
        DesignError,
        {
            "gaussian": "optisense.design.lenses.blur:GaussianBlur",
            "defocus": "optisense.design.lenses.blur:Defocus",
        },
    )

    by_depth: ClassVar[bool] = False
    """Whether it depends on the distance of the scene."""

    def _check_own_kind(self) -> None:
        """Check the deviation from afar up to 10 mm."""
        vergence = np.linspace(0.0, 0.1, 20).reshape(4, 5) if self.by_depth else np.zeros((1, 1))
        found = np.asarray(self.deviation(_SomeView(), vergence))
        if fills(found, vergence.shape):
            found = np.broadcast_to(found, vergence.shape)
        words = "an array in the shape of the vergence, finite and not negative"
        self._require("deviation", found, Limits(words, vergence.shape, low=0.0))

    @abstractmethod
    def deviation(self, camera: LensView, vergence: FloatingArray) -> FloatingArray:
        """Return the standard deviation (...) as a share of the picture's width.

        Args:
            vergence: inverse (...) of the apparent distance, in each principal plane, of the point
                that a pixel sees, 1/mm; a single 0 if `by_depth` is false.
        """


class GaussianBlur(LensBlur):
    """Blur of the same width everywhere."""

    title: ClassVar[str] = "Gaussian"

    kind: Literal["gaussian"] = "gaussian"
    width: Annotated[NonNegative, Field(le=1000.0)] = Field(
        description="standard deviation in pixels of the camera's own resolution",
        examples=[0.7],
        json_schema_extra={"unit": "pixels"},
    )

    def deviation(self, camera: LensView, vergence: FloatingArray) -> FloatingArray:
        """Return the width over the number of pixels across, in the shape of `vergence`."""
        return np.asarray(self.width / camera.resolution[0]) + 0.0 * vergence


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
        """Return the diameter (...) of the circle of confusion, a share of the picture's width."""
        pupil = self.focal_length / self.f_number
        angle = pupil * np.abs(vergence - 1.0 / self.focus_distance)
        return np.asarray(angle * camera.angle_scale)

    def deviation(self, camera: LensView, vergence: FloatingArray) -> FloatingArray:
        """Return the standard deviation (...) of the disc: a quarter of the circle's diameter."""
        return DISC_DEVIATION * self.circle(camera, vergence)


def reach_of(deviation: float, width: int) -> int:
    """Return the radius, pixels, within which a blur is computed, by its standard deviation as a
    share of the picture's width, and this width, pixels.
    """
    return int(np.ceil(REACH * min(deviation, LARGEST) * width)) + 1


def blurred(
    levels: FloatingArray, deviation: FloatingArray, span: tuple[float, float] | None = None
) -> FloatingArray:
    """Return levels (h, w, 3), blurred by a standard deviation, a scalar or (h, w), pixels.

    Args:
        span: smallest and largest deviation in the whole picture, if the levels are a part of it,
            which is then blurred as it is in the whole.
    """
    widths = np.asarray(deviation, dtype=np.float64)
    low, high = span or (float(widths.min()), float(widths.max()))
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


def _spread(levels: FloatingArray, width: float) -> FloatingArray:
    if width < LEAST_WIDTH:
        return levels
    from scipy.ndimage import gaussian_filter  # takes a third of a second to load

    return np.asarray(gaussian_filter(levels, (width, width, 0.0), truncate=REACH, mode="nearest"))

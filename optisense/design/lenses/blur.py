"""Blur of a lens: the point spread function.

It is a normal distribution, whose standard deviation is given as a share of the picture's
width, so that it does not depend on the resolution of a render.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, ClassVar, NamedTuple, Protocol

import numpy as np

from optisense.array_types import FloatingArray
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
interpolated.
"""

LARGEST = 0.25
"""Largest standard deviation of a blur, as a share of the picture's width; it leaves no detail."""


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
            "gaussian": "optisense.design.lenses._gaussian_blur:GaussianBlur",
            "defocus": "optisense.design.lenses.defocus:Defocus",
        },
    )

    by_depth: ClassVar[bool] = False
    """Whether it depends on the distance of the scene."""

    def _check_own_kind(self) -> None:
        """Check the deviation from afar up to 10 mm.

        Raises:
            LibraryError: it is not finite, is negative, or has another shape.
        """
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
            vergence: inverse (...) of the apparent distance of the point that a pixel sees, 1/mm; a
                single 0 if `by_depth` is false.
        """


def reach_of(deviation: float, width: int) -> int:
    """Return the radius, pixels, within which a blur is computed.

    Args:
        deviation: standard deviation, as a share of the picture's width.
        width: width of the picture, pixels.
    """
    return int(np.ceil(REACH * min(deviation, LARGEST) * width)) + 1


def blurred(
    levels: FloatingArray, deviation: FloatingArray, span: tuple[float, float] | None = None
) -> FloatingArray:
    """Return levels (h, w, 3), blurred by a width that may vary over the picture.

    Args:
        levels: levels (h, w, 3).
        deviation: standard deviation, a scalar or (h, w), pixels.
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

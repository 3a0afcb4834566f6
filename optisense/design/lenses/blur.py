"""Blur: how a lens spreads the light of a point over the picture.

The spread is a normal distribution, whose standard deviation is given as a share of the picture's
width, so that it does not depend on the resolution of a render.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from optisense.design.kinds import KindModel
from optisense.errors import DesignError
from optisense.registry import Registry

FloatArray = NDArray[np.floating]

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
    """Properties of a camera that a blur can depend on."""

    @property
    def resolution(self) -> tuple[int, int]:
        """Pixels, width and height."""

    @property
    def angle_scale(self) -> float:
        """Widths of the picture a radian, in its middle."""


class LensBlur(KindModel):
    """The point spread of a lens; each kind is a subclass."""

    kinds: ClassVar[Registry[Any]] = Registry(
        "kind of lens blur",
        "optisense.blurs",
        DesignError,
        {
            "gaussian": "optisense.design.lenses.gaussian_blur:GaussianBlur",
            "defocus": "optisense.design.lenses.defocus:Defocus",
        },
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


def reach_of(deviation: float, width: int) -> int:
    """Pixels as far as a blur reaches in a picture so many pixels wide."""
    return int(np.ceil(REACH * min(deviation, LARGEST) * width)) + 1


def blurred(
    levels: FloatArray, deviation: FloatArray, span: tuple[float, float] | None = None
) -> FloatArray:
    """Levels blurred by a width that may vary.

    Args:
        levels: (h, w, 3).
        deviation: () or (h, w) standard deviation in pixels.
        span: the least and the largest deviation in the whole picture where this is a part of it,
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


def _spread(levels: FloatArray, width: float) -> FloatArray:
    if width < LEAST_WIDTH:
        return levels
    return np.asarray(gaussian_filter(levels, (width, width, 0.0), truncate=REACH, mode="nearest"))

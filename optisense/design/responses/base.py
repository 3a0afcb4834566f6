"""The interface of all kinds of camera responses."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from optisense.design.colour import srgb_curve
from optisense.design.kinds import KindModel
from optisense.errors import DesignError
from optisense.registry import Registry

FloatArray = NDArray[np.floating]

EXPOSURE_TARGET = 0.55
"""Level (of 1, before the transfer curve) at which automatic exposure puts the 95th percentile of
the brightest channel."""


class CameraResponse(KindModel):
    """Turns linear radiance into the picture that a camera stores; each kind is a subclass.

    Radiance times the exposure is the exposed level, at which 1 is full. `respond` makes of it what
    the sensor reads (linear, 0 to 1), and `curve` what is stored (0 to 1).
    """

    kinds: ClassVar[Registry[Any]] = Registry(
        "kind of camera response",
        "optisense.responses",
        DesignError,
        {"full-well": "optisense.design.responses.full_well:FullWellResponse"},
    )

    @abstractmethod
    def respond(self, exposed: FloatArray, width: int | None = None) -> NDArray[np.float32]:
        """(h, w, 3) linear, 0 to 1: what the sensor reads.

        Args:
            exposed: (h, w, 3), the picture or a part of it.
            width: pixels across the whole picture, where this is a part of it.
        """

    def full_level(self) -> float:
        """The exposed level above which a channel is overexposed."""
        return 1.0

    def reach(self, width: int) -> int:
        """Pixels as far as light in one pixel changes others; 0 where it changes none.

        Args:
            width: pixels across the whole picture.
        """
        return 0

    def spreads(self, exposed: FloatArray) -> bool:
        """Whether light in some pixel of a picture changes others."""
        return self.reach(exposed.shape[1]) > 0

    def curve(self, linear: FloatArray) -> NDArray[np.float64]:
        """The stored levels, 0 to 1 before rounding, of the sensor's readings: the sRGB curve."""
        return srgb_curve(linear)

    def encode(self, linear: FloatArray) -> NDArray[np.uint8]:
        """The same in 8 bits."""
        return np.round(255.0 * self.curve(linear)).astype(np.uint8)

    def auto_exposure(self, radiance: FloatArray) -> float:
        """The factor that makes a good picture of a radiance image (h, w, 3)."""
        light = brightest(np.asarray(radiance))
        seen = light[light > 0]
        level = float(np.percentile(seen, 95)) if seen.size else 0.0
        return EXPOSURE_TARGET * self.full_level() / level if level > 0 else 1.0


def brightest(image: FloatArray) -> FloatArray:
    """(h, w) the largest channel; several times sooner than NumPy's maximum along an axis of 3."""
    return np.maximum(np.maximum(image[..., 0], image[..., 1]), image[..., 2])

"""The interface of all kinds of camera responses."""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from optisense.array_types import FloatingArray
from optisense.design.colour import encode, srgb_curve
from optisense.design.fields import NonNegative, Positive
from optisense.design.kinds import ROUNDING, KindModel, Limits
from optisense.design.lenses.blur import REACH
from optisense.errors import DesignError
from optisense.registry import Registry

EXPOSURE_TARGET = 0.55
"""Level (of 1, before the transfer curve) to which automatic exposure maps the 95th percentile of
the brightest channel; it leaves room for highlights."""

RAMP = (4, 5, 3)
"""Shape of the small picture by which own kinds are tried."""

FROM_0 = Limits("an array in the shape of the levels, finite and not negative", RAMP, low=0.0)
"""Limits of levels that fill pixels."""

LEVELS = Limits("an array in the shape of the levels, 0 to 1", RAMP, 0.0, 1.0 + ROUNDING)
"""Limits of a sensor's reading and of stored levels."""

MAX_EXCESS = 4.0
"""Largest excess over the full well that the mask counts, as a multiple of a full pixel, so that a
lamp in view does not whiten the whole picture."""

SPARE = 2
"""Margin of the blur's radius, in pixels, for its rounding."""

_READINGS = {"respond", "filled"}
"""Methods that turn exposed levels into those of the sensor; a kind may override either or both."""


class CameraResponse(KindModel):
    """Conversion of linear radiance into the picture that a camera stores; each kind is a subclass.

    Radiance times the exposure is the exposed level, at which 1 is full. `respond` turns it into
    the sensor's reading (linear, 0 to 1), and `curve` turns the reading into the stored level (0 to
    1).
    """

    kinds: ClassVar[Registry[Any]] = Registry(
        "kind of camera response",
        "optisense.responses",
        DesignError,
        {"full-well": "optisense.design.responses.base:FullWellResponse"},
    )

    def _check_own_kind(self) -> None:
        """Check what it makes of a ramp from the dark to twice a full pixel."""
        exposed = ramp(2.0)
        reading = self.respond(exposed, RAMP[1])
        self._require("respond", reading, LEVELS)
        self._require("filled", self.light_in_pixels(exposed, RAMP[1]), FROM_0)
        self._require("curve", self.curve(reading), LEVELS)
        self._require("full_level", self.full_level(), Limits("a number above 0", above=0.0))
        self._require("reach", self.reach(RAMP[1]), Limits("a number from 0 up", low=0.0))

    @abstractmethod
    def respond(self, exposed: FloatingArray, width: int | None = None) -> NDArray[np.float32]:
        """Return the sensor's reading, (h, w, 3), linear, 0 to 1.

        Args:
            exposed: exposed levels (h, w, 3) of the picture or a part of it.
            width: number of pixels across the whole picture, if `exposed` is a part of it.
        """

    def filled(self, exposed: FloatingArray, width: int | None = None) -> FloatingArray:
        """Return the levels (h, w, 3) of light in the sensor's pixels, from 0 up, before a pixel or
        the converter cuts them off at 1: their noise is that of all this light.

        A kind that does not say has its reading. The arguments are those of `respond`.
        """
        return self.respond(exposed, width)

    def light_in_pixels(self, exposed: FloatingArray, width: int | None = None) -> FloatingArray:
        """Return the levels (h, w, 3) of light in the sensor's pixels, to which noise is added.

        They are those of `filled`, or of `respond` if a subclass of another kind overrides only
        that: the inherited `filled` would leave the override out.
        """
        last = next(kind for kind in type(self).__mro__ if vars(kind).keys() & _READINGS)
        reading = self.filled if "filled" in vars(last) else self.respond
        return reading(exposed, width)

    def full_level(self) -> float:
        """Return the exposed level above which a channel is overexposed."""
        return 1.0

    def reach(self, width: int) -> int:
        """Return the distance, in pixels, over which light in one pixel of a picture of a width, in
        pixels, changes others; 0 if it changes none.
        """
        return 0

    def spreads(self, exposed: FloatingArray) -> bool:
        """Return whether light in some pixel of exposed levels (h, w, 3) changes others."""
        return self.reach(exposed.shape[1]) > 0

    def curve(self, linear: FloatingArray) -> NDArray[np.float64]:
        """Return the stored levels (...), 0 to 1 before rounding, of readings (...), 0 to 1.

        They follow the sRGB curve unless a kind has its own.
        """
        return srgb_curve(linear)

    def encode(self, linear: FloatingArray) -> NDArray[np.uint8]:
        """Return the stored levels (...) in 8 bits of readings (...), 0 to 1."""
        return np.round(255.0 * self.curve(linear)).astype(np.uint8)

    def auto_exposure(self, radiance: FloatingArray) -> float:
        """Return the exposure, a factor on radiance (h, w, 3), for a well exposed picture."""
        light = brightest(np.asarray(radiance))
        seen = light[light > 0]
        level = float(np.percentile(seen, 95)) if seen.size else 0.0
        return EXPOSURE_TARGET * self.full_level() / level if level > 0 else 1.0


class FullWellResponse(CameraResponse):
    """Overexposure spreads over the channels and into the neighbourhood; sRGB curve.

    Exposure is followed by saturation as in the OptiSense paper (section "Camera"): where a channel
    is overexposed, a mask of the excess is blurred and spread over all three channels, which gives
    the whitish spots around bright lights. The paper gives no constants: the full well at a level
    of 1 and the blur of 6 pixels at a width of 640 are assumptions.
    """

    title: ClassVar[str] = "Full well"

    kind: Literal["full-well"] = "full-well"
    full_well: Annotated[Positive, Field(le=1.0)] = Field(
        default=1.0, description="exposed level above which a channel is overexposed"
    )
    blur: Annotated[NonNegative, Field(le=0.5)] = Field(
        default=6.0 / 640.0,
        description="standard deviation of the spread of overexposure, as a share of the width",
    )

    def full_level(self) -> float:
        """Return the full well."""
        return self.full_well

    def reach(self, width: int) -> int:
        """Return the radius of the blur, in pixels."""
        return int(REACH * self.blur * width) + SPARE

    def spreads(self, exposed: FloatingArray) -> bool:
        """Return whether a pixel of exposed levels (h, w, 3) is overexposed."""
        return bool(exposed.max() > self.full_well)

    def respond(self, exposed: FloatingArray, width: int | None = None) -> NDArray[np.float32]:
        """Return the reading (h, w, 3), with overexposure spread over the channels, and clipped."""
        return np.clip(self.filled(exposed, width), 0.0, 1.0, dtype=np.float32)

    def filled(self, exposed: FloatingArray, width: int | None = None) -> FloatingArray:
        """Return the levels (h, w, 3), with overexposure spread over the channels."""
        exposed = np.asarray(exposed, dtype=np.float32)
        excess = np.clip(brightest(exposed) - self.full_well, 0.0, MAX_EXCESS)
        if excess.any():
            from scipy.ndimage import gaussian_filter  # takes a third of a second to load

            blur = self.blur * (width or exposed.shape[1])
            mask = np.clip(gaussian_filter(excess, blur), 0.0, 1.0)
            exposed = exposed + mask[:, :, None] * (
                self.full_well - np.minimum(exposed, self.full_well)
            )
        return exposed

    def encode(self, linear: FloatingArray) -> NDArray[np.uint8]:
        """Return the stored levels (...) in 8 bits, by the sRGB curve in single precision."""
        return encode(linear)


def ramp(top: float) -> NDArray[np.float32]:
    """Return levels (`RAMP`) from 0 to `top`."""
    return np.linspace(0.0, top, math.prod(RAMP), dtype=np.float32).reshape(RAMP)


def brightest(image: FloatingArray) -> FloatingArray:
    """Return the largest channel (h, w) of an image (h, w, 3).

    This is several times faster than NumPy's maximum along an axis of 3.
    """
    return np.maximum(np.maximum(image[..., 0], image[..., 1]), image[..., 2])

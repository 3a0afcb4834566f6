"""Sensor whose overexposed pixels spill into their neighbours.

Exposure, then saturation as in the OptiSense paper (section "Camera"): where a channel is
overexposed, a mask of the excess is blurred and spread over all three channels, which gives the
whitish spots around bright lights. The paper gives no constants: the full well at a level of 1 and
the blur of 6 pixels at a width of 640 are assumptions.
"""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from optisense.array_types import FloatingArray
from optisense.design.colour import encode
from optisense.design.fields import NonNegative, Positive
from optisense.design.responses.base import CameraResponse, brightest

MAX_EXCESS = 4.0
"""Largest excess over the full well that the mask counts, as a multiple of a full pixel, so that a
lamp in view does not whiten the whole picture.
"""

BLUR_REACH = 4.0
"""Radius at which the blur of overexposure is cut off, in standard deviations (SciPy's default)."""

SPARE = 2
"""Margin of the blur's radius, in pixels, for its rounding."""


class FullWellResponse(CameraResponse):
    """Overexposure spreads over the channels and into the neighbourhood; sRGB curve."""

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
        return int(BLUR_REACH * self.blur * width) + SPARE

    def spreads(self, exposed: FloatingArray) -> bool:
        """Return whether a pixel of exposed levels (h, w, 3) is overexposed."""
        return bool(exposed.max() > self.full_well)

    def respond(self, exposed: FloatingArray, width: int | None = None) -> NDArray[np.float32]:
        """Return the reading (h, w, 3), with overexposure spread over the channels, and clipped.

        Args:
            exposed: exposed levels (h, w, 3) of the picture or a part of it.
            width: number of pixels across the whole picture, if `exposed` is a part of it.
        """
        return np.clip(self.filled(exposed, width), 0.0, 1.0, dtype=np.float32)

    def filled(self, exposed: FloatingArray, width: int | None = None) -> FloatingArray:
        """Return the levels (h, w, 3), with overexposure spread over the channels.

        Args:
            exposed: exposed levels (h, w, 3) of the picture or a part of it.
            width: number of pixels across the whole picture, if `exposed` is a part of it.
        """
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

"""Tone curve of sRGB."""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import FloatingArray
from optisense.design.colour import encode, srgb_curve
from optisense.design.responses._tone_curve import ToneCurve


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

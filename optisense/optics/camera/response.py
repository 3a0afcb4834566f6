"""The camera's response: from linear radiance to the picture that a camera would store.

Exposure, then saturation as in the OptiSense paper (section "Camera"): where a channel is
overexposed, a mask of the excess is blurred and spread over all three channels, which gives the
whitish spots around bright lights. The paper gives no constants: the knee is the sensor's full
well (1), the blur of 6 pixels at a width of 640 is an assumption.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from optisense.design.colour import encode
from optisense.errors import RenderError

KNEE = 1.0
"""Exposed level above which a channel is overexposed: the sensor's full well."""
BLUR_WIDTH = 6.0 / 640.0
"""Standard deviation of the blur of the overexposure mask, as a fraction of the image width: 6
pixels of 640, an assumption."""
EXPOSURE_TARGET = 0.55
"""Level (of 1, before the sRGB curve) at which automatic exposure puts the 95th percentile of the
brightest channel."""
MAX_EXCESS = 4.0
"""Largest excess over the full well that the mask counts, so that a lamp in view does not whiten
the whole picture."""

FloatArray = NDArray[np.floating]


def auto_exposure(radiance: FloatArray) -> float:
    """The factor that makes a good picture of a radiance image (h, w, 3)."""
    brightest = _brightest(np.asarray(radiance))
    seen = brightest[brightest > 0]
    level = float(np.percentile(seen, 95)) if seen.size else 0.0
    return EXPOSURE_TARGET / level if level > 0 else 1.0


def saturate(exposed: FloatArray, width: int | None = None) -> NDArray[np.float32]:
    """Spread overexposure over the channels and clip; (h, w, 3) linear, 1 is full well.

    Args:
        exposed: the picture, or a part of it.
        width: pixels across the whole picture, where this is a part of it.
    """
    exposed = np.asarray(exposed, dtype=np.float32)
    excess = np.clip(_brightest(exposed) - KNEE, 0.0, MAX_EXCESS)
    if excess.any():
        blur = BLUR_WIDTH * (width or exposed.shape[1])
        mask = np.clip(gaussian_filter(excess, blur), 0.0, 1.0)
        exposed = exposed + mask[:, :, None] * (KNEE - np.minimum(exposed, KNEE))
    return np.clip(exposed, 0.0, 1.0, dtype=np.float32)


def _brightest(image: FloatArray) -> FloatArray:
    """(h, w) the largest channel; several times sooner than NumPy's maximum along an axis of 3."""
    return np.maximum(np.maximum(image[..., 0], image[..., 1]), image[..., 2])


def picture(radiance: FloatArray, exposure: float | str = "auto") -> NDArray[np.uint8]:
    """An 8-bit picture (h, w, 3) of a radiance image.

    Raises:
        RenderError: the exposure is neither "auto" nor a number above 0.
    """
    if exposure == "auto":
        factor = auto_exposure(radiance)
    else:
        try:
            factor = float(exposure)
        except ValueError:
            factor = -1.0
        if not (np.isfinite(factor) and factor > 0):
            raise RenderError(
                f"the exposure is {exposure!r}", hint='give "auto" or a factor above 0'
            )
    return encode(saturate(np.asarray(radiance) * factor))

"""From linear radiance to the picture that a camera would store, by its response."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from optisense.design.responses import USUAL_RESPONSE, CameraResponse
from optisense.errors import RenderError

FloatArray = NDArray[np.floating]


def picture(
    radiance: FloatArray,
    exposure: float | str = "auto",
    response: CameraResponse = USUAL_RESPONSE,
) -> NDArray[np.uint8]:
    """An 8-bit picture (h, w, 3) of a radiance image.

    Raises:
        RenderError: the exposure is neither "auto" nor a number above 0.
    """
    if exposure == "auto":
        factor = response.auto_exposure(radiance)
    else:
        try:
            factor = float(exposure)
        except ValueError:
            factor = -1.0
        if not (np.isfinite(factor) and factor > 0):
            raise RenderError(
                f"the exposure is {exposure!r}", hint='give "auto" or a factor above 0'
            )
    return response.encode(response.respond(np.asarray(radiance) * factor))

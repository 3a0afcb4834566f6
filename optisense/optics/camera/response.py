"""The picture that a camera stores of linear radiance, computed by its picture chain."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import FloatingArray
from optisense.design.responses import PictureChain
from optisense.design.responses.electronics import NoiseSeed
from optisense.errors import RenderError


def picture(
    radiance: FloatingArray,
    exposure: float | str = "auto",
    chain: PictureChain | None = None,
    noise_seed: NoiseSeed = 0,
) -> NDArray[np.uint8]:
    """Return an 8-bit picture (h, w, 3) of a radiance image.

    Args:
        radiance: (h, w, 3) radiance, mW/(mm^2 sr).
        exposure: factor on the radiance above 0, or "auto".
        chain: picture chain of the camera; the default `PictureChain` if None.
        noise_seed: seed of the camera's noise, if it has some.

    Raises:
        RenderError: the exposure is neither "auto" nor a number above 0.
    """
    chain = chain or PictureChain()
    if exposure == "auto":
        factor = chain.auto_exposure(radiance)
    else:
        try:
            factor = float(exposure)
        except ValueError:
            factor = -1.0
        if not (np.isfinite(factor) and factor > 0):
            raise RenderError(
                f"the exposure is {exposure!r}", hint='give "auto" or a factor above 0'
            )
    return chain.encode(chain.respond(np.asarray(radiance) * factor, seed=noise_seed))

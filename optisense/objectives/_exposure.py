"""The exposure with which a sensor and its contacts are scored."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from optisense.design.responses import PictureChain

MOST_SATURATED = 0.02
"""Largest share of a contact's pixels that automatic exposure allows to be overexposed: on a shiny
sensor, the exposure is lowered until the highlights on contacts are small."""


def exposure_for(
    untouched: NDArray[np.float32],
    contacts: Iterable[NDArray[np.float32]],
    chain: PictureChain | None = None,
) -> float:
    """Return the automatic exposure for a sensor and its contacts.

    It is the automatic exposure of the untouched sensor (`auto_exposure`). If this would overexpose
    more than `MOST_SATURATED` of the pixels of a contact, it is lowered as little as needed.

    Args:
        untouched: (h, w, 3) radiance of the untouched sensor.
        contacts: (n, 3) radiance of the pixels of each contact, from `PictureChain.metered`.
        chain: picture chain of the camera; the default `PictureChain` if None.

    Returns:
        The factor from radiance to the camera's response.
    """
    response = chain or PictureChain()
    exposure = response.auto_exposure(untouched)
    for radiance in contacts:
        brightest = radiance.max(axis=1)
        kept = min(len(brightest) - 1, int((1.0 - MOST_SATURATED) * len(brightest)))
        level = float(np.partition(brightest, kept)[kept])
        if level * exposure > response.full_level():
            exposure = response.full_level() / level
    return exposure

"""The exposure at which a sensor and its contacts are judged."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from optisense.design.responses import PictureChain

MOST_SATURATED = 0.02
"""Automatic exposure lets so many of a contact's pixels be overexposed: a person who sets up a
shiny sensor turns the exposure down until the highlights on what is pressed in are small."""


def exposure_for(
    untouched: NDArray[np.float32],
    contacts: Iterable[NDArray[np.float32]],
    chain: PictureChain | None = None,
) -> float:
    """The factor from radiance to what the camera reads that suits a sensor and its contacts.

    The untouched sensor is exposed well (`auto_exposure`), unless more than `MOST_SATURATED` of
    the pixels of a contact would be overexposed; then as little less as is needed.

    Args:
        untouched: (h, w, 3) radiance.
        contacts: (n, 3) of the pixels of each contact: radiance as `PictureChain.metered` sees it.
        chain: of the camera; the usual one if None.
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

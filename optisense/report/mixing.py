"""The layers of light groups as the page's mixer takes them: fine enough to be added up."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optisense.design.responses.chain import PictureChain
from optisense.design.responses.full_well import MAX_EXCESS, FullWellResponse
from optisense.report.pictures import data_uri

FloatArray = NDArray[np.floating]

CODES = 4096
"""Levels of a layer: 16 for each grey level of a picture, so that twice the sum of eight layers is
right within one grey level."""

CURVE_STEPS = 2048
"""Steps of the table of the tone curve over the root of the linear level; two neighbours differ by
at most one grey level where the curve is as steep as sRGB's."""


def mixing_data(
    layers: Mapping[str, FloatArray], exposure: float, chain: PictureChain
) -> dict[str, Any]:
    """What the page needs to show a picture by other brightnesses of the light groups.

    The levels of a layer are those before overexposure and clipping, which belong to the sum. They
    are stored by the root of their size, in two pictures of 8 and 4 bits, since browsers read no
    finer ones.

    Args:
        layers: (h, w, 3) linear radiance, for each light group.
        exposure: the factor on the radiance.
        chain: of the camera.

    Returns:
        Can be written as JSON.
    """
    response = chain.response
    spread = None
    if isinstance(response, FullWellResponse) and chain.is_plain:
        width = next(iter(layers.values())).shape[1] if layers else 1
        spread = {
            "full": response.full_well, "most": MAX_EXCESS, "pixels": response.blur * width,
        }  # fmt: skip
    return {
        "layers": {name: _coded(chain.linear(exposure * each)) for name, each in layers.items()},
        "curve": _curve(chain),
        "spread": spread,
    }


def _coded(levels: FloatArray) -> dict[str, Any]:
    roots = np.sign(levels) * np.sqrt(np.abs(levels))
    least, most = min(float(roots.min()), 0.0), max(float(roots.max()), 1e-6)
    step = (most - least) / (CODES - 1)
    codes = np.round((roots - least) / step).astype(np.uint16)
    return {
        "least": least,
        "step": step,
        "coarse": data_uri((codes >> 4).astype(np.uint8)),
        "fine": data_uri((codes & 15).astype(np.uint8)),
    }


def _curve(chain: PictureChain) -> str:
    """Grey levels of the squares of 0 to 1, one byte each."""
    levels = np.linspace(0.0, 1.0, CURVE_STEPS + 1, dtype=np.float32) ** 2
    return base64.b64encode(chain.encode(levels).tobytes()).decode("ascii")

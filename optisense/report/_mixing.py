"""Layers of light groups as the page's mixer takes them, precise enough to be summed."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from typing import Any

import numpy as np

from optisense.array_types import FloatingArray
from optisense.design.responses.base import MAX_EXCESS, FullWellResponse
from optisense.design.responses.chain import PictureChain
from optisense.report._pictures import data_uri

CODES = 4096
"""Number of levels of a layer: 16 for each grey level of a picture, so that twice the sum of eight
layers is correct within one grey level.
"""

CURVE_STEPS = 2048
"""Number of steps of the table of the tone curve over the square root of the linear level;
neighbours differ by at most one grey level for a curve as steep as sRGB's.
"""


def mixing_data(
    layers: Mapping[str, FloatingArray], exposure: float, chain: PictureChain
) -> dict[str, Any]:
    """Return the data with which the page shows a picture for other brightnesses of the light
    groups.

    The levels of a layer are those before overexposure and clipping, which apply to the sum. They
    are stored by their square root, in two pictures of 8 and 4 bits, since browsers read no finer
    ones.

    Args:
        layers: linear radiance (h, w, 3) for each light group.
        exposure: factor on the radiance.

    Returns:
        Values that can be written as JSON.
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


def _coded(levels: FloatingArray) -> dict[str, Any]:
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
    """Return the grey levels of the squares of 0 to 1, one byte each."""
    levels = np.linspace(0.0, 1.0, CURVE_STEPS + 1, dtype=np.float32) ** 2
    return base64.b64encode(chain.encode(levels).tobytes()).decode("ascii")

"""Uniformity: the evenness of the light of each colour on the untouched skin."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from optisense.errors import ObjectiveError
from optisense.objectives.registry import no_pixels, objective

if TYPE_CHECKING:
    from optisense.objectives.evaluation import Evaluation

DIM, BRIGHT = 5.0, 95.0
"""Percentiles of the light in the pixels that see the skin that define its dim and bright parts.
The extremes would be single pixels beside a light or in a corner."""

UNLIT = 0.01
"""Share of the brightest colour's level below which a colour counts as unlit: a few levels of 255,
little more than the camera's noise.
"""

COLOURS = ("red", "green", "blue")


@objective(
    "uniformity",
    title="Uniformity",
    beside=COLOURS,
    reads=no_pixels,
    range=(0.0, 1.0),
    numbers=COLOURS,
)
def uniformity(evaluation: Evaluation) -> tuple[float, dict[str, Any], dict[str, Any]]:
    """The evenness of the light on the untouched skin: dim over bright, for the least even colour.

    The value is the ratio of the 5th to the 95th percentile of the linear light in the pixels that
    see the skin, the smallest over those of red, green and blue that are lit; 1 is even.
    """
    evaluation.view.refuse_less(evaluation.settings)
    image = evaluation.untouched
    light = image.radiance[np.linalg.norm(image.normals, axis=2) > 0.5].astype(np.float64)
    dim, bright = np.percentile(light, (DIM, BRIGHT), axis=0)
    lit = bright > UNLIT * bright.max()
    if not lit.any():
        raise ObjectiveError("no light arrives on the skin", hint="Check the lights")
    ratios = {
        name: float(low / high)
        for name, low, high, some in zip(COLOURS, dim, bright, lit, strict=True)
        if some
    }
    least = min(ratios, key=lambda name: ratios[name])
    return ratios[least], {**ratios, "least_even": least}, {}

"""Power: the radiant flux of all LEDs."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from optisense.objectives.registry import objective

if TYPE_CHECKING:
    from optisense.objectives.evaluation import Evaluation


USUAL = (66.0, 4.5)
"""Power (mW) of the strongest and the weakest lights of a built-in sensor: GelSight360, DIGIT."""


@objective(
    "power",
    title="Power",
    range=(0.0, math.inf),
    unit="mW",
    lower_is_better=True,
    rays_only=True,
    usual=USUAL,
    numbers=("lights",),
)
def power(evaluation: Evaluation) -> tuple[float, dict[str, Any]]:
    """The radiant flux, in mW, of all LEDs of the sensor.

    The electrical power is the radiant flux over the LEDs' efficiency.
    """
    lights = evaluation.design.lights
    groups = {name: group.flux * len(group.lights) for name, group in lights.items()}
    parts = {
        "groups": groups,
        "lights": sum(len(group.lights) for group in lights.values()),
    }
    return float(sum(groups.values())), parts

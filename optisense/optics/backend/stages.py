"""The stages of a render, as progress reports name them."""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum


class Stage(Enum):
    """A stage of a render; its value is the name that users see."""

    PREPARING = "preparing the scene"
    PILOT = "tracing pilot photons"
    PHOTONS = "tracing photons"
    SMOOTHING = "smoothing the light"
    SHADING = "shading the picture"
    DONE = "done"


StageCallback = Callable[[Stage, float, int, float | None], None]
"""A function that is called with the stage, the traced part of the photons (0 to 1), their number,
and the relative noise if it is known."""

_BEFORE = {
    Stage.PREPARING: 0.0,
    Stage.PILOT: 0.02,
    Stage.PHOTONS: 0.05,
    Stage.SMOOTHING: 0.8,
    Stage.SHADING: 0.85,
    Stage.DONE: 1.0,
}
"""Fraction (0 to 1) of the time of a render that has passed when each stage begins, as measured
with five million photons."""


def fraction_done(stage: Stage, part: float) -> float:
    """Estimate the completed fraction (0 to 1) of a render.

    Args:
        part: the traced part of the photons, 0 to 1.
    """
    if stage is not Stage.PHOTONS:
        return _BEFORE[stage]
    return _BEFORE[stage] + part * (_BEFORE[Stage.SMOOTHING] - _BEFORE[stage])

"""The stages of a render, and the reports of its progress that name them."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum


class Stage(Enum):
    """A stage of a render; its value is the name that users see."""

    PREPARING = "preparing the scene"
    PILOT = "tracing pilot photons"
    PHOTONS = "tracing photons"
    SMOOTHING = "smoothing the light"
    SHADING = "shading the picture"
    DONE = "done"


@dataclass(frozen=True)
class RenderProgress:
    """The progress of a render.

    Attributes:
        stage: the current stage.
        part: traced part of the photons, 0 to 1.
        fraction: approximate completed fraction of the render, 0 to 1.
        photons: number of photons traced so far.
        noise: relative noise, per cent; None if it is not known.
        seconds: time since the start, s.
    """

    stage: Stage
    part: float
    fraction: float
    photons: int
    noise: float | None
    seconds: float


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


def _fraction_done(stage: Stage, part: float) -> float:
    """Estimate the completed fraction (0 to 1) of a render.

    Args:
        part: the traced part of the photons, 0 to 1.
    """
    if stage is not Stage.PHOTONS:
        return _BEFORE[stage]
    return _BEFORE[stage] + part * (_BEFORE[Stage.SMOOTHING] - _BEFORE[stage])


def stage_callback(
    listener: Callable[[RenderProgress], None] | None, began: float
) -> StageCallback:
    """Return a function that tells a listener of each stage of a render that began at a time, s."""

    def on_stage(stage: Stage, part: float, traced: int, reached: float | None) -> None:
        if listener is not None:
            noise = None if reached is None or not math.isfinite(reached) else 100 * reached
            seconds = time.perf_counter() - began
            listener(
                RenderProgress(stage, part, _fraction_done(stage, part), traced, noise, seconds)
            )

    return on_stage

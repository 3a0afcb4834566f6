"""The progress of samples that share one light: pictures of random contacts."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from optisense.cli.progress import ProgressLine
from optisense.time_left import TimedStep

if TYPE_CHECKING:
    from optisense.optics import OpticalModel, RenderProgress

LOADING, BUILDING = "loading", "building the scene"

MILLION_PHOTONS = 1.6
"""Seconds to trace so many, on two cores of a desktop processor, GelSight Mini."""


def loading_steps() -> list[TimedStep]:
    """Steps before any picture, with their usual times on such a machine."""
    return [TimedStep(LOADING, 1, 2.4), TimedStep(BUILDING, 1, 0.8)]


def sample_steps(
    name: str, photons: int, count: int, seconds: float, after: float
) -> list[TimedStep]:
    """Steps of samples: their light and the first one, the others, and what follows.

    Args:
        name: of the samples, which none of another name shares.
        photons: of their light.
        count: of all samples.
        seconds: that one usually takes.
        after: seconds that usually follow the last one.
    """
    return [
        TimedStep(_light(name), 1, photons / 1e6 * MILLION_PHOTONS + 4.0),
        TimedStep(name, count, seconds),
        TimedStep(_after(name), 1, after),
    ]


def shown_samples(
    line: ProgressLine, model: OpticalModel, name: str, after: str
) -> Callable[[int, int], None]:
    """What is to be called with the number of samples that are done, and of all.

    Args:
        line: has the steps of `sample_steps`.
        model: of the sensor; tells of the light while it is traced.
        name: of the samples.
        after: what follows them.
    """
    line.begin(_light(name), text=f"{name}: tracing light")
    first: list[int] = []
    in_light = True

    def light(progress: RenderProgress) -> None:
        if in_light:
            line.time_left.advance(progress.fraction)
            line.say(f"{name}: {progress.stage.value}")

    def show(done: int, count: int) -> None:
        nonlocal in_light
        in_light = in_light and (not first or done == first[0])
        if not first:
            first.append(done)
            line.say(f"{name}: tracing light", done, count)
        elif done == first[0] + 1:
            line.begin(name, count, done)
        if done >= count:
            line.begin(_after(name), text=after)
        elif done > first[0]:
            line.advance(done, count)

    model.listener = light
    return show


def _light(name: str) -> str:
    return f"light of {name}"


def _after(name: str) -> str:
    return f"after {name}"

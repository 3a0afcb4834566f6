"""Progress of samples that share one light: pictures of random contacts."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from optisense.cli.output_folder import take_folder
from optisense.cli.progress import ProgressLine
from optisense.time_left import TimedStep
from optisense.usual_times import BUILDING as BUILDING_TIME
from optisense.usual_times import LOADING as LOADING_TIME
from optisense.usual_times import UsualTimes

if TYPE_CHECKING:
    from optisense.design import SensorDesign
    from optisense.optics import OpticalModel, RenderProgress

LOADING, BUILDING = "loading", "building the scene"


def loading_steps(libraries: float = 0.0) -> list[TimedStep]:
    """Return the steps before any picture, with their usual durations.

    Args:
        libraries: time to load libraries that only this command needs, s.
    """
    pace = UsualTimes.here().thread_pace
    return [
        TimedStep(LOADING, 1, pace * (LOADING_TIME + libraries), gauges=False),
        TimedStep(BUILDING, 1, pace * BUILDING_TIME, gauges=False),
    ]


def sample_steps(
    name: str,
    photons: int,
    count: int,
    work: float,
    after: float,
    *,
    is_cached: bool = False,
    times: UsualTimes | None = None,
) -> list[TimedStep]:
    """Return the steps of samples: their light and the first one, the others, and the work after
    them.

    Args:
        name: name of the samples, different from that of other samples.
        work: processor time of a sample on GelSight Mini, s.
        after: time of the work after the last sample, s.
        is_cached: whether the light is cached already, since other samples have used it.
        times: usual durations for the sensor; those of a GelSight Mini on an idle machine if None.
    """
    usual = times or UsualTimes.here()
    light = 0.0 if is_cached else usual.first_light(photons) + usual.compiling()
    sample = work * usual.shading * usual.pace
    return [
        TimedStep(_light(name), 1, light + sample),
        TimedStep(name, count, sample),
        TimedStep(_after(name), 1, after * usual.thread_pace, gauges=False),
    ]


def load_sensor(
    line: ProgressLine,
    source: str,
    out: Path | None,
    variant: str,
    steps: Callable[[UsualTimes, SensorDesign], list[TimedStep]],
) -> OpticalModel:
    """Return the model of a command's sensor, after the design was loaded, the output folder taken
    and the scene built.

    Args:
        line: progress line with the steps of `loading_steps`.
        source: name or folder of the design.
        out: output folder, if there is one.
        steps: function that returns the later steps for usual durations and the design.

    Raises:
        OptiSenseError: the design can't be loaded or built, or the folder can't be taken.
    """
    from optisense.sensors import load

    design = load(source)
    if out is not None:
        take_folder(out)
    from optisense.optics import OpticalModel

    line.begin(BUILDING)
    set_expected_durations(line, design, lambda times: steps(times, design))
    return OpticalModel(design, variant)


def set_expected_durations(
    line: ProgressLine, design: SensorDesign, steps: Callable[[UsualTimes], list[TimedStep]]
) -> None:
    """Set the expected durations for this sensor on this machine, once both are known.

    Args:
        steps: function that returns the steps for usual durations.
    """
    times = UsualTimes.here(design.sensing_area, len(design.lights))
    for step in steps(times):
        line.time_left.expect(step.name, seconds=step.seconds)


def sample_progress(
    line: ProgressLine, model: OpticalModel, name: str, after: str
) -> Callable[[int, int], None]:
    """Return a callback that takes the number of finished samples and that of all.

    Args:
        line: progress line with the steps of `sample_steps`.
        model: model of the sensor, which reports the progress of its light.
        after: text of the work after the samples.
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

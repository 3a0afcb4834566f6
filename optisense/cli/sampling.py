"""Progress of samples that share one light: pictures of random contacts."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from optisense.cli.console import print_notes
from optisense.cli.output_folder import take_folder
from optisense.cli.progress import ProgressLine

if TYPE_CHECKING:
    from optisense.optics import OpticalModel, RenderProgress

LOADING, BUILDING = "loading", "building the scene"


def load_sensor(
    line: ProgressLine,
    source: str,
    out: Path | None,
    variant: str,
    resolution: tuple[int, int] | None,
) -> OpticalModel:
    """Return the model of a command's sensor, after the design was loaded, the output folder taken
    and the scene built; print a note if its pictures have another shape than the camera's.

    Args:
        source: name or folder of the design.
        out: output folder, if there is one.
        resolution: (width, height) of the pictures; None is the camera's own.

    Raises:
        OptiSenseError: the design can't be loaded or built, or the folder can't be taken.
    """
    from optisense.sensors import load

    design = load(source)
    print_notes(design.camera.shape_notes(resolution))
    if out is not None:
        take_folder(out)
    from optisense.optics import OpticalModel

    line.begin(BUILDING)
    return OpticalModel(design, variant)


def sample_progress(
    line: ProgressLine, model: OpticalModel, name: str, after: str
) -> Callable[[int, int], None]:
    """Return a callback that takes the number of finished samples and that of all.

    Args:
        model: model of the sensor, which reports the progress of its light.
        after: text of the work after the samples.
    """
    from optisense.optics.backend.stages import Stage

    line.begin(f"{name}: tracing light")
    first: list[int] = []
    in_light = True

    def light(progress: RenderProgress) -> None:
        if in_light and progress.stage is not Stage.DONE:
            line.advance(progress.fraction)
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
            line.begin(after)
        elif done > first[0]:
            line.advance(done, count)

    model.listener = light
    return show

"""``optisense render``: render a tactile image of a design with contacts, and its report."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from optisense.cli.console import EXIT_INTERRUPTED, handles_errors, messages, output
from optisense.cli.options import (
    ContactOption,
    DesignArgument,
    VariantOption,
    out_option,
    parse_contacts,
)
from optisense.cli.output_folder import take_folder
from optisense.cli.progress import ProgressLine, about, progress_line
from optisense.cli.sampling import BUILDING, LOADING, loading_steps, set_expected_durations
from optisense.cli.stopping import Interrupt, deferred_interrupt
from optisense.commands.rendering import RenderOptions
from optisense.quality import PICTURE_PHOTONS
from optisense.time_left import TimedStep
from optisense.usual_times import USUAL_PIXELS, UsualTimes

if TYPE_CHECKING:
    from optisense.optics import OpticalModel, RenderProgress, TactileImage
    from optisense.report.real_sensor import RealComparison

PICTURE = "image.png"


@handles_errors
def render(
    design: DesignArgument,
    out: Annotated[Path, out_option("Folder for the results.")],
    contact: ContactOption = None,
    *,
    options: RenderOptions,
    variant: VariantOption = "auto",
) -> None:
    """Render what the sensor's camera sees, with or without contacts.

    Writes image.png, radiance.exr, normals.npy, contact_mask.npy, layers/*.exr, run.json and
    report.html into the folder. Ctrl-C stops early and writes the result so far.
    """
    size = options.resolution
    if options.noise is not None and options.seconds is not None:
        raise typer.BadParameter("give one of them, not both", param_hint="--noise, --seconds")
    contacts = parse_contacts(contact)

    with (
        progress_line(*_steps(UsualTimes.here(), options), waits=_waits) as line,
        deferred_interrupt() as interrupt,
    ):
        line.begin(LOADING)
        from optisense.sensors import load

        sensor = load(design)
        take_folder(out)

        from optisense.optics import OpticalModel
        from optisense.optics.imaging.tactile_image import REPORT_FILE
        from optisense.report import write_report
        from optisense.report.camera_rays import CameraRays
        from optisense.report.light_section import LightSection
        from optisense.report.real_sensor import has_real_picture

        interrupt.raise_if_requested()
        line.begin(BUILDING)
        width, height = size or sensor.camera.resolution
        pixels = width * height
        set_expected_durations(line, sensor, lambda times: _steps(times, options, pixels))
        model = OpticalModel(sensor, variant=variant)
        interrupt.raise_if_requested()
        stages = RenderStages(line)

        def report_progress(progress: RenderProgress) -> None:
            stages(progress)
            if progress.photons and stages.stage == TRACING:  # a picture can be made of these
                interrupt.raise_if_requested()

        image = model.render(
            contacts,
            resolution=size,
            photons=options.photons_to_trace(),
            noise=options.noise,
            seconds=options.seconds,
            seed=options.seed,
            skin=options.skin,
            progress=report_progress,
        )
        line.begin(WRITING)
        image.settings["contacts"] = list(contact or [])
        image.save(out, options.exposure)
        real = None
        if has_real_picture(sensor) and not image.interrupted and not interrupt.requested:
            line.say(COMPARING)
            real = _compare_with_real(model, image, interrupt)
        light = None
        if not image.interrupted and not interrupt.requested:
            line.say(FOLLOWING)
            light = LightSection.of(model, seed=options.seed)
        write_report(
            out / REPORT_FILE,
            sensor,
            image,
            contacts,
            exposure=options.exposure,
            rays=CameraRays.of(model),
            real=real,
            light=light,
        )
    _print_summary(image, out)
    if image.interrupted:
        messages.print("interrupted: the files contain what was finished")
    if interrupt.requested:
        raise typer.Exit(EXIT_INTERRUPTED)


WRITING = "writing the report"
TRACING, SHADING = "tracing photons", "shading the picture"
COMPARING = "comparing with a real sensor"
FOLLOWING = "following the light of each group"

NOISE_PHOTONS = 4_000_000
"""Number of photons that a noise target is expected to take, before the noise is known."""

WRITING_TIME = 0.8
"""Time to write the files and the report, s; measured on GelSight Mini at 320x240."""


def _steps(
    times: UsualTimes, options: RenderOptions, pixels: int = USUAL_PIXELS
) -> list[TimedStep]:
    """Return the steps of a render with this number of pixels, and their usual durations."""
    usual = NOISE_PHOTONS if options.noise is not None else PICTURE_PHOTONS
    tracing = times.tracing(options.photons or usual)
    if options.photons is None and options.seconds is not None:
        tracing = max(1.0, options.seconds - 5.0)
    compiling = times.compiling() / 2.0
    return [
        *loading_steps(),
        TimedStep("preparing the scene", 1, times.preparing()),
        TimedStep("tracing pilot photons", 1, times.pilot()),
        TimedStep(TRACING, 1, tracing + compiling),
        TimedStep("smoothing the light", 1, times.smoothing()),
        TimedStep(SHADING, 1, times.picture(pixels) + compiling),
        TimedStep(WRITING, 1, WRITING_TIME * times.thread_pace),
    ]


def _waits(line: ProgressLine) -> str:
    """Return what a first Ctrl-C waits for: a picture is made from the light so far."""
    left = line.time_left
    rest = left.seconds_left - left.seconds_left_of(TRACING)
    return f"finishing the picture{about(rest)}"


def _compare_with_real(
    model: OpticalModel, image: TactileImage, interrupt: Interrupt
) -> RealComparison | None:
    """Return the comparison with the real picture of this sensor, or None if Ctrl-C ended it."""
    from optisense.report.real_sensor import compare_with_real

    # Use as many photons as were asked for, so that the cached light serves again.
    photons = min(image.settings["photons_asked"] or image.settings["photons"], PICTURE_PHOTONS)
    seed = image.settings["seed"]
    try:
        return compare_with_real(
            model, photons, seed, lambda progress: interrupt.raise_if_requested()
        )
    except KeyboardInterrupt:
        return None


class RenderStages:
    """Display of the stages of a render on a progress line.

    Attributes:
        stage: current stage.
    """

    def __init__(self, line: ProgressLine) -> None:
        """Show the stages on ``line``, which has a step for each."""
        self._line = line
        self.stage = ""

    def __call__(self, progress: RenderProgress) -> None:
        """Show a report of progress."""
        from optisense.optics.backend.stages import Stage

        if progress.stage is Stage.DONE:
            return
        if progress.stage.value != self.stage:
            self.stage = progress.stage.value
            self._line.begin(self.stage)
        notes = [f"{progress.photons / 1e6:.1f} million photons"] if progress.photons else []
        if progress.noise is not None:
            notes.append(f"noise {progress.noise:.1f} %")
        what = self.stage
        if self.stage == TRACING:
            self._line.time_left.advance(progress.part * self._line.time_left.count)
            if not progress.photons:
                what = "compiling, " + what
        self._line.say(what, None, None, *notes)


def _print_summary(image: TactileImage, folder: Path) -> None:
    """Print size, photons, noise and time of an image, its warnings, and the files."""
    from optisense.optics.imaging.tactile_image import REPORT_FILE

    height, width = image.contact_mask.shape
    settings = image.settings
    facts = [f"{width} x {height} pixels", f"{settings['photons'] / 1e6:.2g} million photons"]
    if settings["noise_reached_percent"] is not None:
        facts.append(f"noise {settings['noise_reached_percent']:.2g} %")
    if (worst := settings["noise_of_worst_places_percent"]) is not None:
        facts.append(f"{worst:.2g} % and more in the worst 5 %")
    facts.append(f"{settings['seconds']['total']:.2g} s")
    output.print(", ".join(facts), style="dim")
    for warning in image.pressed.warnings if image.pressed is not None else ():
        output.print(f"warning: {warning}", style="yellow")
    output.print(f"picture: {folder / PICTURE}")
    output.print(f"report:  {folder / REPORT_FILE}")

"""``optisense render``: render a tactile image of a design with contacts, and its report."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from optisense.cli.console import (
    EXIT_INTERRUPTED,
    handles_errors,
    messages,
    output,
    print_notes,
)
from optisense.cli.options import (
    ContactOption,
    DesignArgument,
    VariantOption,
    out_option,
    parse_contacts,
    print_small_indenters,
)
from optisense.cli.output_folder import take_folder
from optisense.cli.progress import ProgressLine, progress_line
from optisense.cli.sampling import BUILDING, LOADING
from optisense.cli.stopping import Interrupt, deferred_interrupt
from optisense.commands.rendering import RenderOptions
from optisense.quality import PICTURE_PHOTONS

if TYPE_CHECKING:
    from optisense.geometry import Contact
    from optisense.optics import OpticalModel, RenderProgress, TactileImage
    from optisense.report.real_sensor import RealComparison

PICTURE = "image.png"

FILES = (PICTURE, "radiance.exr", "normals.npy", "contact_mask.npy", "pressure.npy", "markers.csv",
         "run.json", "report.html")  # fmt: skip
"""Files that a render may write, besides its layers."""

MARK = ("run.json", '"photons_asked"')
"""File of each render, and a text in it, by which the folder of an earlier one is recognised."""


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
    report.html into the folder, pressure.npy for contacts on an elastic skin, and markers.csv for a
    design with markers. Ctrl-C stops early and writes the result so far.
    """
    size = options.resolution
    if options.noise is not None and options.seconds is not None:
        raise typer.BadParameter("give one of them, not both", param_hint="--noise, --seconds")
    contacts = parse_contacts(contact)

    with (
        progress_line(lambda line: "finishing the picture") as line,
        deferred_interrupt() as interrupt,
    ):
        line.begin(LOADING)
        from optisense.sensors import load

        sensor = load(design)
        print_notes(sensor.camera.shape_notes(size))
        layers = [f"layers/{group}.exr" for group in sensor.lights]
        take_folder(out, [*FILES, *layers], MARK)

        from optisense.optics import OpticalModel
        from optisense.optics.backend.stages import Stage
        from optisense.optics.imaging.tactile_image import REPORT_FILE
        from optisense.report import write_report
        from optisense.report.camera_rays import CameraRays
        from optisense.report.light_section import LightSection
        from optisense.report.real_sensor import has_real_picture

        interrupt.raise_if_requested()
        line.begin(BUILDING)
        model = OpticalModel(sensor, variant=variant)
        print_notes(model.marker_notes())
        interrupt.raise_if_requested()

        def report_progress(progress: RenderProgress) -> None:
            _show_render(line, progress)
            # A picture can be made of the photons so far.
            if progress.photons and progress.stage is Stage.PHOTONS:
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
            partial=True,
        )
        line.begin("writing the report")
        image.settings["contacts"] = list(contact or [])
        image.save(out, options.exposure)
        real = None
        if has_real_picture(sensor) and not image.interrupted and not interrupt.requested:
            line.begin("comparing with a real sensor")
            real = _compare_with_real(model, image, interrupt)
        light = None
        if not image.interrupted and not interrupt.requested:
            line.begin("following the light of each group")
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
    _print_summary(image, contacts, out)
    if image.interrupted:
        messages.print("interrupted: the files contain what was finished")
    if interrupt.requested:
        raise typer.Exit(EXIT_INTERRUPTED)


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


def _show_render(line: ProgressLine, progress: RenderProgress) -> None:
    """Show the progress of a render: its stage, its finished share, photons and noise."""
    from optisense.optics.backend.stages import Stage

    if progress.stage is Stage.DONE:
        return
    what = progress.stage.value
    notes = [f"{progress.photons / 1e6:.1f} million photons"] if progress.photons else []
    if progress.noise is not None:
        notes.append(f"noise {progress.noise:.1f} %")
    if progress.stage is Stage.PHOTONS and not progress.photons:
        what = "compiling, " + what
    line.advance(progress.fraction)
    line.say(what, None, None, *notes)


def _print_summary(image: TactileImage, contacts: Sequence[Contact], folder: Path) -> None:
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
    print_small_indenters(contacts)
    if contacts and not image.interrupted and not image.contact_mask.any():
        sentence = "warning: no pixel sees a contact: it is out of view, or too small"
        output.print(sentence, style="yellow")
    output.print(f"picture: {folder / PICTURE}")
    output.print(f"report:  {folder / REPORT_FILE}")

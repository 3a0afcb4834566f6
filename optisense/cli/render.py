"""``optisense render``: from a design and contacts to a tactile image and its report."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from optisense.cli.console import EXIT_INTERRUPTED, ends_well, messages, output
from optisense.cli.interrupt import held_interrupt
from optisense.cli.options import (
    ContactOption,
    DesignArgument,
    VariantOption,
    parse_contacts,
    parse_exposure,
    parse_resolution,
)
from optisense.cli.output_folder import take_folder

if TYPE_CHECKING:
    from optisense.optics import RenderProgress, TactileImage

PICTURE = "image.png"
ONE_PICTURE = 1_000_000
"""Photons for a single picture. A program that keeps its model pays once and takes more."""


@ends_well
def render(
    design: DesignArgument,
    out: Annotated[
        Path, typer.Option("--out", "-o", metavar="DIR", help="Folder for the results.")
    ],
    contact: ContactOption = None,
    resolution: Annotated[
        str | None,
        typer.Option(
            metavar="WIDTHxHEIGHT",
            help="Pixels of the picture, as 320x240. The camera's own when left out.",
            show_default=False,
        ),
    ] = None,
    photons: Annotated[
        int | None,
        typer.Option(
            min=1,
            metavar="N",
            help="Photons to trace: 1 million when no limit is given, enough for a good picture.",
            show_default=False,
        ),
    ] = None,
    noise: Annotated[
        float | None,
        typer.Option(
            min=0.01,
            max=100.0,
            metavar="PERCENT",
            help="Stop when the noise has come down to this.",
            show_default=False,
        ),
    ] = None,
    seconds: Annotated[
        float | None,
        typer.Option(min=0.01, metavar="S", help="Stop after this time.", show_default=False),
    ] = None,
    seed: Annotated[
        int,
        typer.Option(
            min=0, max=2**32 - 1, metavar="N", help="The same seed gives the same picture."
        ),
    ] = 0,
    exposure: Annotated[
        str,
        typer.Option(
            metavar="auto|VALUE",
            help="Brightness of the picture: a factor on the radiance, or found by itself.",
        ),
    ] = "auto",
    variant: VariantOption = "auto",
) -> None:
    """Render what the sensor's camera sees, with or without contacts.

    Writes image.png, radiance.exr, normals.npy, contact_mask.npy, layers/*.exr, run.json and
    report.html into the folder. Ctrl-C stops early and writes what there is.
    """
    size = None if resolution is None else parse_resolution(resolution)
    brightness = parse_exposure(exposure)
    if noise is not None and seconds is not None:
        raise typer.BadParameter("give one of them, not both", param_hint="--noise, --seconds")
    contacts = parse_contacts(contact)

    from optisense.sensors import load

    sensor = load(design)
    take_folder(out)

    from optisense.cli.placing import place_contacts
    from optisense.optics import OpticalModel
    from optisense.optics.imaging.tactile_image import REPORT_FILE
    from optisense.report import write_report
    from optisense.report.camera_rays import CameraRays

    with _progress_bar() as show:
        model = OpticalModel(sensor, variant=variant)

        def report_progress(progress: RenderProgress) -> None:
            show(progress)
            if progress.fraction < 1:
                interrupt.raise_if_requested()

        with held_interrupt() as interrupt:
            image = model.render(
                contacts,
                resolution=size,
                photons=photons if photons or noise or seconds else ONE_PICTURE,
                noise=noise,
                seconds=seconds,
                seed=seed,
                progress=report_progress,
            )
    image.settings["contacts"] = list(contact or [])
    image.save(out, brightness)
    write_report(
        out / REPORT_FILE,
        sensor,
        image,
        contacts,
        exposure=brightness,
        indenters=place_contacts(model, contacts),
        rays=CameraRays.of(model),
    )
    _say_what_came(image, out)
    if image.interrupted:
        messages.print("interrupted: the files hold what was finished until then")
    if interrupt.requested:
        raise typer.Exit(EXIT_INTERRUPTED)


@contextmanager
def _progress_bar() -> Iterator[Callable[[RenderProgress], None]]:
    """A bar on standard error with photons, noise and time; silent when that is no terminal."""
    from rich.progress import TextColumn, TimeElapsedColumn

    from optisense.cli.progress import passing_bar

    percent, note = TextColumn("{task.percentage:>3.0f} %"), TextColumn("{task.fields[note]}")
    with passing_bar("rendering", percent, note, TimeElapsedColumn()) as bar:
        task = bar.add_task("render", total=1.0, note="preparing the scene")

        def show(progress: RenderProgress) -> None:
            note = f"{progress.photons / 1e6:.1f} million photons"
            if progress.noise is not None:
                note += f", noise {progress.noise:.1f} %"
            bar.update(task, completed=progress.fraction, note=note)

        yield show


def _say_what_came(image: TactileImage, folder: Path) -> None:
    from optisense.optics.imaging.tactile_image import REPORT_FILE

    height, width = image.contact_mask.shape
    settings = image.settings
    facts = [f"{width} x {height} pixels", f"{settings['photons'] / 1e6:.2g} million photons"]
    if settings["noise_reached_percent"] is not None:
        facts.append(f"noise {settings['noise_reached_percent']:.2g} %")
    facts.append(f"{settings['seconds']['total']:.2g} s")
    output.print(", ".join(facts), style="dim")
    output.print(f"picture: {folder / PICTURE}", markup=False)
    output.print(f"report:  {folder / REPORT_FILE}", markup=False)

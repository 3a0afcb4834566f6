"""``optisense dataset``: labelled pictures of random contacts."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from optisense.cli.console import EXIT_FAILURE, ends_well, messages, output
from optisense.cli.options import (
    DesignArgument,
    EstimatorOption,
    NoiseOption,
    SamplePhotonsOption,
    SampleResolutionOption,
    VariantOption,
    out_option,
    parse_exposure,
    parse_resolution,
    seed_option,
)
from optisense.cli.output_folder import take_folder
from optisense.cli.progress import progress_line
from optisense.cli.sampling import (
    BUILDING,
    LOADING,
    expect_here,
    loading_steps,
    sample_steps,
    shown_samples,
)
from optisense.optics.estimators import RADIANCE_CACHE
from optisense.quality import SAMPLE_PHOTONS
from optisense.time_left import TimedStep
from optisense.usual_times import USUAL_PIXELS, UsualTimes

if TYPE_CHECKING:
    from optisense.tasks import Dataset


SAMPLES = "samples"
"""The step of the progress."""

SAMPLE_WORK = 0.5
"""Processor seconds that a sample of `USUAL_PIXELS` usually takes, its files included."""


@ends_well
def dataset(
    design: DesignArgument,
    out: Annotated[Path, out_option("Folder of the dataset; a new one, or one to go on.")],
    count: Annotated[
        int, typer.Option("--count", "-n", min=1, metavar="N", help="Samples in all.")
    ] = 100,
    indenter: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KIND:SIZE",
            help="What presses: sphere:1.5, cylinder:2,6, plane or mesh:FILE. Given several times, "
            "each is as likely as the others.  [default: sphere:1.5]",
            show_default=False,
        ),
    ] = None,
    depth: Annotated[
        str, typer.Option(metavar="LOW:HIGH", help="How deep, mm; drawn evenly in between.")
    ] = "0.3:1",
    rotation: Annotated[
        str, typer.Option(metavar="LOW:HIGH", help="Degrees about the surface normal.")
    ] = "0:360",
    tilt: Annotated[
        float,
        typer.Option(min=0.0, max=89.0, metavar="DEGREES", help="The most it tilts, about 2 axes."),
    ] = 0.0,
    margin: Annotated[
        float,
        typer.Option(
            min=0.0,
            max=49.0,
            metavar="PERCENT",
            help="Of the picture's width that stays free between a contact and the picture's "
            "edge; 0 lets the edge cut contacts.",
        ),
    ] = 2.0,
    resolution: SampleResolutionOption = None,
    photons: SamplePhotonsOption = SAMPLE_PHOTONS,
    seed: Annotated[int, seed_option("Of places, depths and noise.")] = 0,
    exposure: Annotated[
        str,
        typer.Option(
            metavar="auto|VALUE", help="One for all pictures; auto suits the untouched sensor."
        ),
    ] = "auto",
    camera_noise: NoiseOption = 0.0,
    radiance: Annotated[
        bool, typer.Option("--radiance", help="Also write linear radiance as EXR files.")
    ] = False,
    estimator: EstimatorOption = RADIANCE_CACHE,
    variant: VariantOption = "auto",
) -> None:
    """Make a dataset of random contacts: pictures, depth, normals, masks and labels.

    Stopped at any moment, the same command continues it. A folder that was begun with other
    settings is left alone.
    """
    brightness = parse_exposure(exposure)
    size = None if resolution is None else parse_resolution(resolution)
    depths = parse_range(depth, "--depth")
    rotations = parse_range(rotation, "--rotation")

    def steps(times: UsualTimes, pixels: int = USUAL_PIXELS) -> list[TimedStep]:
        work = SAMPLE_WORK * (0.5 + 0.5 * pixels / USUAL_PIXELS)
        return sample_steps(SAMPLES, photons, count, work, 0.2, times=times)

    try:
        with progress_line(*loading_steps(), *steps(UsualTimes.here())) as line:
            line.begin(LOADING)
            from optisense.sensors import load
            from optisense.tasks import ContactDraw, DatasetSettings, generate

            indenters = tuple(indenter or ("sphere:1.5",))
            settings = DatasetSettings(
                contacts=ContactDraw(indenters, depths, rotations, tilt, margin / 100),
                resolution=size,
                photons=photons,
                seed=seed,
                exposure=brightness,
                camera_noise=camera_noise,
                radiance=radiance,
                estimator=estimator,
            )
            settings.contacts.parsed()
            sensor = load(design)
            take_folder(out)

            from optisense.optics import OpticalModel

            line.begin(BUILDING)
            width, height = size or sensor.camera.resolution
            expect_here(line, sensor, lambda times: steps(times, width * height))
            model = OpticalModel(sensor, variant)
            show = shown_samples(line, model, SAMPLES, "reading the dataset")
            made = generate(model, out, count, settings, show)
    except KeyboardInterrupt:
        from optisense.tasks.dataset import LABELS, Dataset

        if (out / LABELS).exists():
            finished = len(Dataset.load(out))
            messages.print(f"{finished} of {count} samples are there; the same command continues")
        raise
    _say_what_came(made, count)


def parse_range(text: str, option: str) -> tuple[float, float]:
    """Read ``LOW:HIGH`` or one number.

    Raises:
        typer.BadParameter: anything else.
    """
    low, _, high = text.partition(":")
    try:
        return float(low), float(high or low)
    except ValueError:
        raise typer.BadParameter(
            f"'{text}' is not LOW:HIGH, such as 0.3:1", param_hint=option
        ) from None


def _say_what_came(made: Dataset, count: int) -> None:
    """Tell how many samples there are, and why others are not.

    Raises:
        typer.Exit: there is none.
    """
    reasons = Counter(row["reason"] for row in made.failures if int(row["index"]) < count)
    output.print(f"dataset: {made.folder}, {len(made)} samples", markup=False)
    if reasons:
        failed, (reason, times) = reasons.total(), reasons.most_common(1)[0]
        mostly = "" if times == failed else f", {times} times"
        output.print(
            f"{failed} contacts could not be made: {reason}{mostly} "
            f"({made.folder / 'failures.csv'} lists them)",
            markup=False,
            style="yellow",
        )
    if not len(made):
        raise typer.Exit(EXIT_FAILURE)

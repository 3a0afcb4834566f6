"""``optisense dataset``: make labelled pictures of random contacts."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from optisense.cli.console import EXIT_FAILURE, handles_errors, messages, output
from optisense.cli.options import DesignArgument, VariantOption, out_option
from optisense.cli.progress import progress_line
from optisense.cli.sampling import LOADING, load_sensor, sample_progress
from optisense.commands.options import MOST_ITEMS
from optisense.commands.sampling import DatasetOptions

if TYPE_CHECKING:
    from optisense.tasks import Dataset


@handles_errors
def dataset(
    design: DesignArgument,
    out: Annotated[Path, out_option("Folder of the dataset; a new one, or one to continue.")],
    count: Annotated[
        int,
        typer.Option(
            "--count", "-n", min=1, max=MOST_ITEMS, metavar="N", help="Total number of samples."
        ),
    ] = 100,
    *,
    options: DatasetOptions,
    mend: Annotated[
        bool,
        typer.Option(
            "--mend",
            help="Check all existing samples, and make those with missing or damaged files again.",
        ),
    ] = False,
    parquet: Annotated[
        bool,
        typer.Option(
            "--parquet",
            help="Also write all samples as Parquet files, which Hugging Face's datasets loads. "
            "Existing ones are written again if they lack a sample, and with --mend.",
        ),
    ] = False,
    licence: Annotated[
        str | None,
        typer.Option(
            metavar="ID",
            help="Licence that the card of the dataset names, such as cc-by-4.0.",
        ),
    ] = None,
    variant: VariantOption = "auto",
) -> None:
    """Make a dataset of random contacts: pictures, depth, normals, masks and labels.

    If it was stopped, the same command continues it. A folder that was begun with other settings is
    not changed.
    """
    from optisense.tasks.data_card import check_licence, write_card
    from optisense.tasks.parquet import (
        has_all_samples,
        parquet_files,
        require_parquet,
        write_parquet,
    )

    check_licence(licence)
    again = bool(parquet_files(out)) and not parquet
    if parquet or again:
        require_parquet()
    try:
        with progress_line() as line:
            line.begin(LOADING)
            from optisense.tasks import DatasetSettings, generate

            settings = DatasetSettings(**options.settings())
            settings.contacts.parsed()
            model = load_sensor(line, design, out, variant, settings.resolution)
            show = sample_progress(line, model, "samples", "reading the dataset")
            made = generate(model, out, count, settings, show, mend=mend)
            stale = (parquet or again) and (mend or not has_all_samples(made))
            if stale:
                line.begin("writing Parquet files")
                write_parquet(made, line.advance)
            write_card(made, licence)
    except KeyboardInterrupt:
        from optisense.tasks.dataset import Dataset
        from optisense.tasks.dataset_tables import LABELS

        if (out / LABELS).exists():
            finished = len(Dataset.load(out))
            messages.print(
                f"{finished} of {count} samples are finished; the same command continues"
            )
        raise
    _print_summary(made, count)
    if again and stale:
        messages.print("the folder's Parquet files were written again, with all samples")


def _print_summary(made: Dataset, count: int) -> None:
    """Print the number of samples, why others failed, and which splits are empty."""
    reasons = Counter(row["reason"] for row in made.failures if int(row["index"]) < count)
    output.print(f"dataset: {made.folder}, {len(made)} samples")
    if reasons:
        failed, (reason, times) = reasons.total(), reasons.most_common(1)[0]
        mostly = "" if times == failed else f", {times} times"
        output.print(
            f"{failed} contacts could not be made: {reason}{mostly} "
            f"({made.folder / 'failures.csv'} lists them)",
            style="yellow",
        )
    if not len(made):
        raise typer.Exit(EXIT_FAILURE)
    if made.empty_splits:
        named = " and ".join(made.empty_splits)
        output.print(f"no sample is in the split {named}: raise --count", style="yellow")

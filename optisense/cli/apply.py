"""``optisense apply``: write a trial of a study as an ordinary design."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path
from typing import Annotated

import typer

from optisense.cli.console import handles_errors, output
from optisense.cli.options import out_option


@handles_errors
def apply(
    study: Annotated[
        Path,
        typer.Argument(metavar="STUDY", help="The folder of a search (its --out)."),
    ],
    out: Annotated[
        Path,
        out_option("The folder to write; it must be new or empty."),
    ],
    trial: Annotated[
        str, typer.Option(metavar="best|start|NUMBER", help="The trial whose design is written.")
    ] = "best",
) -> None:
    """Write the design that a search has found into a folder."""
    from optisense.search import Study
    from optisense.search.study.applied import design_of
    from optisense.sensors import save_design

    with closing(Study.open(study)) as opened:
        chosen = opened.trial(trial)
        save_design(design_of(opened, chosen), out, new=True)
        output.print(f"{out / 'design.yaml'}")
        output.print(f"trial {chosen.number}: {opened.objective} {chosen.unbiased_score:.4g}")

"""``optisense ledger``: where the light of each group goes."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from optisense.cli.console import ends_well, output, table_of
from optisense.cli.options import DesignArgument, VariantOption, out_option
from optisense.cli.output_folder import take_folder
from optisense.cli.progress import progress_line
from optisense.commands.ledger import LedgerOptions
from optisense.writing import write_text

if TYPE_CHECKING:
    from optisense.optics.ledger import LightLedger

JSON_FILE, PAGE_FILE = "ledger.json", "ledger.html"

LEAST_SHOWN = 5e-5
"""Share of a group's light below which the table says nothing: less than 0.01 %."""


@ends_well
def ledger(
    design: DesignArgument,
    *,
    options: LedgerOptions,
    out: Annotated[Path | None, out_option("Folder for ledger.json and ledger.html.")] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print JSON with every line instead of a table.")
    ] = False,
    variant: VariantOption = "auto",
) -> None:
    """Tell where the light of each group goes: to the skin, into which part, or out of which.

    In per cent of the power of each group, nothing pressed in. The lines add up to 100 %.
    """
    with progress_line() as line:
        line.say("loading")
        from optisense.sensors import load

        sensor = load(design)
        if out is not None:
            take_folder(out)

        from optisense.optics import OpticalModel
        from optisense.report.light_section import LightSection, ledger_page

        line.say("following light")
        section = LightSection.of(OpticalModel(sensor, variant), options.photons, options.seed)
        found = section.ledger
    text = json.dumps(found.as_data(), indent=2, allow_nan=False)
    if out is not None:
        write_text(out / JSON_FILE, text + "\n")
        write_text(out / PAGE_FILE, ledger_page(sensor, section))
    if as_json:
        print(text)
        return
    _print(found)
    if out is not None:
        output.print(f"numbers: {out / JSON_FILE}", markup=False)
        output.print(f"page:    {out / PAGE_FILE}", markup=False)


def _print(found: LightLedger) -> None:
    groups = list(found.emitted)
    table = table_of("% of the light of", *groups)
    for where in found.places():
        shares = [found.share(group, where) for group in groups]
        if max(shares) >= LEAST_SHOWN:
            table.add_row(where, *(f"{100 * share:.2f}" for share in shares))
    table.add_row("sum", *(f"{100 * found.closing_sum(group):.2f}" for group in groups))
    table.add_row("emitted (mW)", *(f"{found.emitted[group]:.4g}" for group in groups))
    output.print(table)
    worst = max((entry.noise for entry in found.entries), default=0.0)
    output.print(f"noise of a line: at most {100 * worst:.2g} %", style="dim")

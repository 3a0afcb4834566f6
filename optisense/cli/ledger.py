"""``optisense ledger``: print where the light of each group goes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from optisense.cli.console import handles_errors, output, print_json, table_of
from optisense.cli.options import DesignArgument, VariantOption, json_option, out_option
from optisense.cli.output_folder import take_folder
from optisense.cli.progress import progress_line
from optisense.commands.rendering import LedgerOptions
from optisense.percentages import bound_percent
from optisense.writing import write_json, write_text

if TYPE_CHECKING:
    from optisense.optics.ledger import LightLedger
    from optisense.optics.light_at_camera import CameraLight
    from optisense.optics.place_light import PlaceLight

JSON_FILE, PAGE_FILE = "ledger.json", "ledger.html"

LEAST_SHOWN = 5e-5
"""Smallest share of a group's light that the table shows: smaller ones round to 0.00 %."""

LEAST_EXIT = 0.005
"""Smallest share of a group's light that a listed face lets escape, half a per cent."""


@handles_errors
def ledger(
    design: DesignArgument,
    *,
    options: LedgerOptions,
    out: Annotated[Path | None, out_option("Folder for ledger.json and ledger.html.")] = None,
    at: Annotated[
        list[str] | None,
        typer.Option(
            metavar="U,V",
            help="Also explain the light at this point of the skin, in mm from the camera's "
            "axis to the right and to the top of the picture. May be given several times.",
        ),
    ] = None,
    as_json: Annotated[bool, json_option("Print JSON with every line instead of a table.")] = False,
    variant: VariantOption = "auto",
) -> None:
    """Show how much light of each group reaches the skin, is absorbed, or escapes, by part.

    The table is in per cent of the power of each group, without contacts; its lines add up to
    100 %. --at also explains why a point of the skin is dark or bright: which groups light it, what
    their light has met on its way, and from where it comes.
    """
    with progress_line() as line:
        line.say("loading")
        from optisense.geometry import parse_place
        from optisense.sensors import load

        places = [parse_place(text) for text in at or []]

        sensor = load(design)
        if out is not None:
            take_folder(out)

        from optisense.optics import OpticalModel, camera_light
        from optisense.report.light_section import LightSection, ledger_page

        line.say("following light")
        model = OpticalModel(sensor, variant)
        seen = camera_light(model, options.photons, options.seed)
        section = LightSection.of(model, options.photons, options.seed, places, seen)
        found = section.ledger
    data = found.as_data() | {"camera": seen.as_data()}
    if places:
        data["places"] = [place.as_data() for place in section.places]
    if out is not None:
        write_json(out / JSON_FILE, data)
        write_text(out / PAGE_FILE, ledger_page(sensor, section))
    if as_json:
        print_json(data)
        return
    _print(found, seen)
    for place in section.places:
        _print_place(place)
    if out is not None:
        output.print(f"numbers: {out / JSON_FILE}")
        output.print(f"page:    {out / PAGE_FILE}")


def _print(found: LightLedger, seen: CameraLight) -> None:
    groups = list(found.emitted)
    table = table_of("% of the light of", *groups)
    for where in found.places():
        shares = [found.share(group, where) for group in groups]
        if max(shares) >= LEAST_SHOWN:
            table.add_row(where, *(f"{100 * share:.2f}" for share in shares))
    table.add_row("sum", *(f"{100 * found.closing_sum(group):.2f}" for group in groups))
    table.add_row("emitted (mW)", *(f"{found.emitted[group]:.4g}" for group in groups))
    # Light at the lens is not part of the sum: most of it goes on and is counted where it ends.
    for title, values in seen.as_text().items():
        table.add_row(title, *(values[group] for group in groups))
    output.print(table)
    worst = max((entry.noise for entry in found.entries), default=0.0)
    output.print(f"noise of a line: at most {bound_percent(worst)}", style="dim")
    if faces := found.faces(LEAST_EXIT):
        output.print()
        table = table_of("escaped through the face", *groups)
        for face, shares in faces.items():
            table.add_row(face, *(f"{100 * share:.2f}" for share in shares))
        output.print(table)


def _print_place(place: PlaceLight) -> None:
    title = "light at ({}) mm".format(", ".join(f"{part:g}" for part in place.at))
    if not place.groups:
        output.print(f"\n{title}: no light group emits light")
        return
    output.print()
    groups = list(place.groups.values())
    table = table_of(title, *place.groups)
    table.add_row("irradiance (mW/mm²)", *(f"{each.irradiance:.3g}" for each in groups))
    table.add_row("of the mean in view", *(f"{each.of_mean:.2f}" for each in groups))
    for words in groups[0].ways:
        shares = [each.ways[words] for each in groups]
        if max(shares) >= LEAST_SHOWN:
            table.add_row(f"{words} (%)", *(f"{100 * share:.1f}" for share in shares))
    table.add_row(
        "mean angle to the normal (degrees)", *(f"{each.mean_angle:.0f}" for each in groups)
    )
    table.add_row("main azimuth (degrees)", *(f"{each.main_azimuth:.0f}" for each in groups))
    output.print(table)
    worst = max(each.noise for each in groups)
    output.print(
        f"noise of the irradiance: at most {bound_percent(worst)}; azimuths are 0 at the right of "
        "the image and 90 at its top",
        style="dim",
    )

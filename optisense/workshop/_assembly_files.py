"""Files with which a maker of circuit boards places LEDs: KiCad's, and JLCPCB's pair of tables.

x and y are those of the board seen from in front of its top, and so are rotations,
counter-clockwise, of LEDs on either side.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from optisense.design import SensorDesign
from optisense.library import typical_colour
from optisense.text import cell
from optisense.workshop._dxf import closed, dxf
from optisense.workshop._placement import Placement, what_to_order
from optisense.workshop._tables import digits, light_entry
from optisense.writing import csv_table

MARGIN = 1.0
"""Width of the board around the bodies of its LEDs in the outline, mm; an assumption."""

USUAL_BODY = 3.5
"""Side of an LED's body that the library lacks, mm: the longer side of the common SMD 3528."""


def assembly_files(design: SensorDesign, placed: Sequence[Placement]) -> dict[str, str]:
    """Return the text of each file by its name: four for each board."""
    files: dict[str, str] = {}
    for board in sorted({led.board for led in placed}):
        leds = [led for led in placed if led.board == board]
        files[f"board-{board}.pos"] = _kicad(design, leds)
        files[f"board-{board}-cpl.csv"] = _cpl(leds)
        files[f"board-{board}-bom.csv"] = _bom(design, leds)
        files[f"board-{board}.dxf"] = _outline(design, leds)
    return files


def _footprint(design: SensorDesign, led: Placement) -> str:
    width, length = _body(design, led)
    return f"LED_{length:g}x{width:g}mm"


def _body(design: SensorDesign, led: Placement) -> tuple[float, float]:
    """Return the sides of an LED's body, mm."""
    entry = light_entry(design.lights[led.group])
    if entry is None or entry.package is None:
        return USUAL_BODY, USUAL_BODY
    return entry.package[0], entry.package[1]


def _kicad(design: SensorDesign, leds: Sequence[Placement]) -> str:
    """Return a position file as KiCad writes them, in its text form."""
    lines = [
        "### Footprint positions ###",
        "## Unit = mm, Angle = deg.",
        "## Side : All",
        f"# {'Ref':<7} {'Val':<25} {'Package':<20} {'PosX':>10} {'PosY':>10} {'Rot':>9}  Side",
    ]
    for led in leds:
        lines.append(
            f"{led.designator:<9} {cell(f'{led.model}-{led.group}'):<25} "
            f"{_footprint(design, led):<20} "
            f"{digits(led.on_board[0], 4):>10} {digits(led.on_board[1], 4):>10} "
            f"{digits(led.turn_on_board, 4):>9}  {led.layer}"
        )
    return "\n".join([*lines, "## End", ""])


def _cpl(leds: Sequence[Placement]) -> str:
    """Return JLCPCB's table of positions."""
    rows = [
        (led.designator, *(f"{digits(value, 4)}mm" for value in led.on_board),
         led.layer.capitalize(), digits(led.turn_on_board, 3))
        for led in leds
    ]  # fmt: skip
    return csv_table(("Designator", "Mid X", "Mid Y", "Layer", "Rotation"), rows)


def _bom(design: SensorDesign, leds: Sequence[Placement]) -> str:
    """Return JLCPCB's table of parts, a row for each group of lights."""
    rows = []
    for name in dict.fromkeys(led.group for led in leds):
        own = [led for led in leds if led.group == name]
        colour = typical_colour(design.lights[name].model, design.lights[name].colour)
        words = " ".join(filter(None, [own[0].model, colour[0] if colour else name]))
        designators = ",".join(led.designator for led in own)
        number = cell(what_to_order(design.lights[name]))
        rows.append((cell(words), designators, _footprint(design, own[0]), number))
    return csv_table(("Comment", "Designator", "Footprint", "Part number"), rows)


def _outline(design: SensorDesign, leds: Sequence[Placement]) -> str:
    """Return a rectangle around the LEDs as a DXF drawing (release 12), in mm."""
    reach = max(max(_body(design, led)) for led in leds) / 2.0 + MARGIN
    places = np.array([led.on_board for led in leds])
    (x0, y0), (x1, y1) = places.min(axis=0) - reach, places.max(axis=0) + reach
    return dxf(closed("Edge.Cuts", [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]))

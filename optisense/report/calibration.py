"""Page of a calibration, the design before and after beside photographs, and its folder."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

from optisense.calibration.calibrating import calibrate
from optisense.calibration.photographs import Photographs
from optisense.calibration.realism import PATCH, Realism
from optisense.calibration.result import Calibration
from optisense.calibration.settings import CalibrationSettings
from optisense.design import SensorDesign, save_design
from optisense.folders import held
from optisense.kept_arrays import KeptArrays
from optisense.report._files import page
from optisense.report.comparison import (
    CONTRAST,
    background_pictures,
    channel_rows,
    noise_row,
    press_row,
    press_section,
    radius_cell,
)
from optisense.writing import write_json, write_text, written_together

JSON_FILE, PAGE_FILE = "calibration.json", "calibration.html"
"""Files of a calibration beside those of the fitted design."""

RENDERINGS = "renderings"
"""Subfolder of a calibration in which its renderings are kept while it runs."""

FIGURES = {
    "unexplained": "unexplained, patch of 1.35 radii",
    "contact": "error over response, contact",
    "ring": "error over response, ring",
    "similarity": "similarity of the responses",
    "far": "far field, levels",
    "far_smooth": "far field without noise, levels",
}
"""Figures of presses whose medians the page shows, with their labels."""

READINGS = {
    "radius": "ball read by the model's reader, times",
    "degrees": "error of the normals that it reads, degrees",
    "radius_back": "ball read by the photographs' reader in the model, times",
    "degrees_back": "error of the normals that it reads there, degrees",
    "radius_alone": "ball read by the reader of the other photographs, times",
    "degrees_alone": "error of the normals that it reads, degrees",
}
"""Figures of readings whose medians the page shows, with their labels."""


def calibrate_into(
    folder: Path,
    design: SensorDesign,
    photographs: Photographs,
    settings: CalibrationSettings,
    variant: str,
    progress: Callable[[str, int, int], None],
) -> Calibration:
    """Fit a design to photographs, and write the fitted design, its numbers and its page together.

    A run that ends early leaves its finished renderings in the folder, and the next one with the
    same arguments continues from them.

    Args:
        folder: folder of the result, whose lock is held meanwhile.
        design, photographs, settings, variant, progress: see `calibrate`.

    Raises:
        FolderInUseError: another process is writing to the folder.
        CalibrationError: there are too few photographs, or they do not fit the design.
        OptiSenseError: the design can't be rendered, or the folder can't be written.
    """
    with held(folder):
        kept = KeptArrays(folder / RENDERINGS)
        found = calibrate(
            design, photographs, settings, variant=variant, kept=kept, progress=progress
        )
        with written_together("the calibration") as stage:
            write_text(stage(folder / PAGE_FILE), render_calibration(found))
            write_json(stage(folder / JSON_FILE), found.as_data())
            save_design(found.design, folder)
        kept.remove()
    return found


def render_calibration(found: Calibration) -> str:
    """Return a calibration as one self-contained HTML page."""
    before, after = found.before, found.after
    count = len(after.realism.presses)
    return page(
        "calibration",
        title=found.design.name,
        description=found.design.description,
        headline=[
            ("presses", str(count)),
            ("held out", str(len(found.held_out))),
            ("exposure", f"{found.exposure:.4g}"),
        ],
        notes=list(found.notes),
        verdict=found.verdict(),
        numbers=[
            (
                each.words,
                each.before_words,
                f"{each.after:.4g}",
                f"{each.uncertainty:.2g}",
                each.unit,
                each.determined,
            )
            for each in found.numbers
        ],
        alike=[(one, other, f"{value:.2f}") for one, other, value in found.alike],
        summary=summary_rows(found),
        held_out=list(found.held_out),
        sides=[
            {
                "name": name,
                "background": background_pictures(side),
                "channels": channel_rows(side),
                "ratio": f"{side.realism.background.ratio:.1f}",
            }
            for name, side in (("Before", before), ("After", after))
        ],
        rows=[
            (*press_row(press), "held out" if press.name in found.held_out else "fitted")
            for press in after.realism.presses
        ]
        + [(*noise_row(after.realism), "")],
        presses=[
            {
                "name": after.photographs.presses[index].name,
                "held_out": after.photographs.presses[index].name in found.held_out,
                "before": press_section(before, index),
                "after": press_section(after, index),
            }
            for index in range(count)
        ],
        contrast=f"{CONTRAST:g}",
        patch=f"{PATCH:g}",
    )


def summary_rows(found: Calibration) -> list[tuple[str, ...]]:
    """Return medians before and after, of the presses that were fitted and of those held out, and
    those of a model without errors.
    """

    def sides(held_out: bool) -> list[Realism | None]:
        each = [
            found.of_presses(side.realism, held_out=held_out)
            for side in (found.before, found.after)
        ]
        return [side if side.presses else None for side in each]

    columns = [*sides(False), *sides(True)]
    after = found.after.realism
    rows: list[tuple[str, ...]] = []
    for name, words in FIGURES.items():
        noise = _noise(after, name)
        medians = ("" if each is None else f"{each.median(name):.3f}" for each in columns)
        rows.append((words, *medians, "" if noise is None else f"{noise:.3f}"))
    for name, words in READINGS.items():
        values = [math.nan if each is None else each.median_reading(name) for each in columns]
        if not all(map(math.isnan, values)):  # else there are too few presses for these readers
            text = radius_cell if name.startswith("radius") else "{:.2f}".format
            cells = ("" if math.isnan(value) else text(value) for value in values)
            rows.append((words, *cells, ""))
    ratios = [side.realism.background.ratio for side in (found.before, found.after)]
    rows.append(("background, dB", *(f"{ratio:.1f}" for ratio in ratios), "", "", ""))
    return rows


def _noise(found: Realism, name: str) -> float | None:
    """Return the median of one of the figures of a model without errors, or None if it is 0."""
    if name == "far":
        return found.median("far_real")
    return None if name == "far_smooth" else found.median_of_noise(name)

"""Request that fits a design to photographs of the real sensor."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

from optisense.calibration.families import FAMILIES, USUAL
from optisense.commands.comparing import CalibrateOptions
from optisense.engine.jobs import Job
from optisense.engine.protocol import Fields
from optisense.engine.rendering import DesignFields, design_of
from optisense.engine.requests import Lane, handles
from optisense.engine.session import Session


class Calibrate(DesignFields, CalibrateOptions):
    """Fields of the request "calibrate"; see docs/engine.md."""

    photos: str
    to: str


@handles("calibration_families", Fields, Lane.QUICK)
def calibration_families(session: Session, fields: Fields, job: Job) -> dict[str, Any]:
    """Return the families of parameters that a calibration fits by default, then the others."""
    names = [*USUAL, *(name for name in FAMILIES if name not in USUAL)]
    return {
        "families": [
            {"name": name, "words": FAMILIES[name].words, "usual": name in USUAL} for name in names
        ]
    }


@handles("calibrate", Calibrate, Lane.RENDER)
def calibrate(session: Session, fields: Calibrate, job: Job) -> dict[str, Any]:
    """Fit a design to photographs, and write the fitted design and its report."""
    from optisense.calibration import read_photographs
    from optisense.report.calibration import PAGE_FILE, calibrate_into

    design = design_of(session, fields, job)
    session.designs.require_valid(design)
    job.progress(0.0, "reading the photographs")
    photographs = read_photographs(Path(fields.photos), fields.ball)
    folder = Path(fields.to)

    def report(what: str, done: int, count: int) -> None:
        job.progress(min(done / max(count, 1), 1.0), what)

    variant = session.renderer.variant
    found = calibrate_into(folder, design, photographs, fields.settings(), variant, report)
    held = bool(found.held_out)
    return {
        "folder": str(folder),
        "page": str(folder / PAGE_FILE),
        "numbers": [asdict(each) for each in found.numbers],
        "held_out": list(found.held_out),
        "unexplained": [
            found.of_presses(side.realism, held_out=held).median("unexplained")
            for side in (found.before, found.after)
        ],
        "verdict": found.verdict(),
        "notes": [*found.before.notes, *found.notes],
    }

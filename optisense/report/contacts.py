"""Page for correcting the contacts that were found in photographs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from optisense.calibration.photographs import Photographs
from optisense.calibration.seen_contacts import SeenContact
from optisense.report._files import as_json, page, script
from optisense.report._pictures import data_uri
from optisense.report.comparison import CONTRAST, GREY, shown
from optisense.writing import write_text

USUAL_RADIUS = 0.1
"""Radius of the circle in a photograph without a contact, as a share of the picture's width;
about that of usual contacts, so that it needs little change."""

DOT = 0.006
"""Radius of the dot in a contact's middle, in widths of the picture; the handle's is twice that."""


def write_contacts(
    path: str | Path,
    title: str,
    photographs: Photographs,
    seen: Sequence[SeenContact | None],
    notes: Sequence[str] = (),
) -> None:
    """Write a self-contained HTML page with a circle for each contact, which can be dragged.

    Its button saves the circles as `presses.csv`, in pixels of the photographs as they were read.

    Args:
        title: name of the photographs' folder.
        seen: contacts in them; None where there is none.
        notes: doubtful findings, one sentence each.

    Raises:
        OutputError: the file can't be written.
    """
    real = photographs.background.astype(np.float64)
    width, height = (side / photographs.scale for side in photographs.size)
    rows, data = [], []
    for press, place in zip(photographs.presses, seen, strict=True):
        column, row = (0.5 * width, 0.5 * height) if place is None else place.centre
        radius = USUAL_RADIUS * width if place is None else place.radius
        scale = 1.0 if place is None else photographs.scale
        values = {"column": column / scale, "row": row / scale, "radius": radius / scale}
        response = GREY + CONTRAST * (press.picture.astype(np.float64) - real)
        rows.append(
            {
                "file": press.name,
                "picture": data_uri(shown(response)),
                "ball": f"{press.diameter:g}",
                "used": place is not None,
            }
        )
        data.append(
            {
                "file": press.name,
                "diameter": press.diameter,
                "used": place is not None,
                **{name: float(value) for name, value in values.items()},
            }
        )
    text = page(
        "contacts",
        title=title,
        notes=list(notes),
        presses=rows,
        width=f"{width:g}",
        height=f"{height:g}",
        dot=DOT * width,
        data=as_json(data),
        script=script("contacts.js"),
    )
    write_text(Path(path), text)

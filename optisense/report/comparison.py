"""Pages of photographs of a real sensor: a model beside them, and the contacts in them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import FloatArray
from optisense.calibration.comparing import Comparison
from optisense.calibration.photographs import Photographs
from optisense.calibration.realism import PATCH, PressRealism, Realism, distances, sees_no_curvature
from optisense.calibration.seen_contacts import SeenContact
from optisense.design import SensorDesign
from optisense.figures import new_figure
from optisense.report._files import as_json, page, script
from optisense.report._pictures import data_uri, figure_uri
from optisense.writing import write_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CONTRAST = 2.0
"""Factor on responses and errors in the pictures, which show them around a middle grey: they are
some tens of levels of 255.
"""

GREY = 128.0
"""Level of a response of 0 in the pictures: the middle of 255 levels."""

CUT = 2.4
"""Half of the side of the pictures of a press, in radii of the contact: it includes the ring, which
ends at 1.6 radii.
"""

LEAST_CUT = 24
"""Smallest half of the side of the pictures of a press, pixels; smaller ones show no detail."""

COLOURS = {"R": "#c0392b", "G": "#2e8b57", "B": "#1f6fb2"}
"""Colours of the curves of the channels."""


def write_comparison(path: str | Path, design: SensorDesign, found: Comparison) -> Path:
    """Write a comparison as one self-contained HTML page.

    Raises:
        OutputError: the file can't be written.
    """
    figures = found.realism
    width, height = found.photographs.size
    text = page(
        "comparison",
        title=design.name,
        description=design.description,
        headline=[
            ("presses", str(len(figures.presses))),
            ("compared at", f"{width} x {height} pixels"),
            ("unexplained", f"{figures.median('unexplained'):.2f}"),
            ("similarity", f"{figures.median('similarity'):.2f}"),
            ("background", f"{figures.background.ratio:.1f} dB"),
            ("exposure", f"{figures.exposure:.4g}"),
        ],
        notes=list(found.notes),
        background=background_pictures(found),
        channels=channel_rows(found),
        presses=[press_section(found, index) for index in range(len(figures.presses))],
        rows=[*(press_row(press) for press in figures.presses), noise_row(figures)],
        readings=reading_rows(figures),
        contrast=f"{CONTRAST:g}",
        patch=f"{PATCH:g}",
    )
    write_text(Path(path), text)
    return Path(path)


def background_pictures(found: Comparison) -> list[tuple[str, str]]:
    """Return caption and address of the pictures of the background."""
    real, model = found.photographs.background, found.pictures.background
    return [
        ("photograph", data_uri(real)),
        ("model", data_uri(shown(model))),
        ("model less photograph", data_uri(shown(GREY + model - real))),
    ]


def channel_rows(found: Comparison) -> list[tuple[str, str, str, str]]:
    """Return the figures of the background for R, G and B."""
    ground = found.realism.background

    def cells(values: tuple[float, float, float], digits: int) -> tuple[str, str, str]:
        red, green, blue = (f"{value:.{digits}f}" for value in values)
        return red, green, blue

    return [
        ("correlation of the pixels", *cells(ground.correlation, 2)),
        ("mean level of the photograph", *cells(ground.real, 1)),
        ("mean level of the model", *cells(ground.model, 1)),
        ("root mean square difference, levels", *cells(ground.error, 1)),
    ]


def press_row(press: PressRealism) -> tuple[str, ...]:
    """Return the figures of a press for the table."""
    return (
        press.name,
        f"{press.unexplained:.3f}",
        f"{press.contact:.2f}",
        f"{press.ring:.2f}",
        f"{press.similarity:.2f}",
        f"{press.far:.1f} / {press.far_real:.1f}",
        f"{press.far_smooth:.1f}",
        " / ".join(f"{turn:.0f}" for turn in press.turn),
        " / ".join(f"{gain:.2f}" for gain in press.gain),
    )


def noise_row(found: Realism) -> tuple[str, ...]:
    """Return the medians of a model without errors for the table of `press_row`."""
    return (
        "noise alone",
        f"{found.median_of_noise('unexplained'):.3f}",
        f"{found.median_of_noise('contact'):.2f}",
        f"{found.median_of_noise('ring'):.2f}",
        f"{found.median_of_noise('similarity'):.2f}",
        f"{found.median('far_real'):.1f}",
        "",
        "",
        "",
    )


def reading_rows(found: Realism) -> list[tuple[str, ...]]:
    """Return the readings of each contact by readers that were calibrated on the model, on the
    photographs, and on the other photographs if these are enough.
    """
    rows = []
    for each in found.readings:
        pairs = [(each.radius, each.degrees), (each.radius_back, each.degrees_back)]
        if each.radius_alone is not None and each.degrees_alone is not None:
            pairs.append((each.radius_alone, each.degrees_alone))
        cells = [text for one, other in pairs for text in (radius_cell(one), f"{other:.1f}")]
        rows.append((each.name, *cells))
    return rows


def radius_cell(radius: float) -> str:
    """Return the ratio of a read radius to the true one as text."""
    return "no curvature" if sees_no_curvature(radius) else f"{radius:.2f}"


def press_section(found: Comparison, index: int) -> dict[str, Any]:
    """Return the pictures and the profile of one press."""
    press, seen = found.photographs.presses[index], found.seen[index]
    real = press.picture.astype(np.float64) - found.photographs.background
    model = found.pictures.presses[index] - found.pictures.background
    box = _around(real.shape, seen.centre, max(CUT * seen.radius, LEAST_CUT))
    edge = np.abs(distances(real.shape[:2], seen) - 1.0) * seen.radius < 0.6
    outlined = press.picture.copy()
    outlined[edge] = 255
    column, row = seen.centre
    return {
        "name": press.name,
        "facts": f"ball of {press.diameter:g} mm; contact at column {column:.1f}, row {row:.1f}, "
        f"radius {seen.radius:.1f} pixels; pressed {found.pictures.contacts[index].depth:.2f} mm "
        "deep into the model",
        "pictures": [
            ("photograph, contact outlined", data_uri(outlined[box])),
            ("model", data_uri(shown(found.pictures.presses[index][box]))),
            ("response, photograph", data_uri(shown(GREY + CONTRAST * real[box]))),
            ("response, model", data_uri(shown(GREY + CONTRAST * model[box]))),
            ("difference of both", data_uri(shown(GREY + CONTRAST * (model - real)[box]))),
        ],
        "profile": figure_uri(profile_figure(real, model, seen.centre, seen.radius)),
    }


def shown(levels: FloatArray) -> NDArray[np.uint8]:
    """Return levels (h, w, 3), 0 to 255, as a picture (h, w, 3); others are clipped."""
    return np.clip(np.round(levels), 0, 255).astype(np.uint8)


def profile_figure(
    real: FloatArray, model: FloatArray, centre: tuple[float, float], radius: float
) -> Figure:
    """Draw the responses along the row and the column through a contact's middle.

    Args:
        real, model: responses (h, w, 3) of the photograph and of the model, levels of 255.
        centre: column and row of the middle, pixels.
        radius: radius of the contact, pixels.
    """
    figure = new_figure(10.0, 2.6)
    height, width = real.shape[:2]
    column, row = min(int(centre[0]), width - 1), min(int(centre[1]), height - 1)
    cuts = [
        ("columns from the contact's middle", real[row], model[row], np.arange(width) - column),
        ("rows from the contact's middle", real[:, column], model[:, column],
         np.arange(height) - row),
    ]  # fmt: skip
    for axes, (text, one, other, places) in zip(figure.subplots(1, 2), cuts, strict=True):
        near = np.abs(places) < CUT * radius
        for channel, (name, colour) in enumerate(COLOURS.items()):
            axes.plot(places[near], one[near, channel], color=colour, lw=0.8, alpha=0.55)
            axes.plot(places[near], other[near, channel], color=colour, lw=1.6, label=name)
        for side in (-radius, radius):
            axes.axvline(side, color="#aaa", lw=0.8, ls=":")
        axes.set_xlabel(text, fontsize=8)
        axes.set_ylabel("response, levels of 255", fontsize=8)
        axes.tick_params(labelsize=8)
    return figure


def _around(
    shape: tuple[int, ...], centre: tuple[float, float], reach: float
) -> tuple[slice, slice]:
    """Return the rows and columns of a square about a point, clipped to the picture."""
    column, row = centre
    rows = slice(max(0, int(row - reach)), min(shape[0], int(row + reach) + 1))
    return rows, slice(max(0, int(column - reach)), min(shape[1], int(column + reach) + 1))


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

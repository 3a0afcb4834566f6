"""Page of a verification: two sensors side by side, and the verdict which one reads better."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import FloatArray
from optisense.figures import AMBER, BLUE, GREY, RED, new_figure
from optisense.geometry.objects import OBJECTS
from optisense.report._files import page
from optisense.report._pictures import data_uri, figure_uri, legend_above, normal_colours
from optisense.tasks.paired_errors import BETTER, INCONCLUSIVE, WORSE, ErrorChange
from optisense.tasks.press_readings import PressPictures
from optisense.tasks.verification import Verification

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WORST_ANGLE = 30.0
"""Angle at the end of the colour scale for a normal's error, degrees; few are off by more."""

BESIDE = 1.0
"""Margin around a contact in pictures, as a share of the contact's size."""

SMALLEST_CROP = 40
"""Smallest side of a cut-out of a picture, in pixels."""


def render_verification(found: Verification, axes: tuple[FloatArray, FloatArray]) -> str:
    """Return a verification as one self-contained HTML page.

    Args:
        axes: rows (3, 3) of each sensor's camera: image right, image up and viewing direction.
    """
    settings = found.settings
    reading = settings.reading
    return page(
        "verify",
        first=found.names[0],
        second=found.names[1],
        verdict=found.verdict,
        kind={BETTER: "good", WORSE: "bad", INCONCLUSIVE: "open"}[found.verdict],
        in_words=found.in_words(),
        notes=found.notes(),
        same_places=found.same_places,
        headline=[
            ("objects", str(len(settings.objects))),
            ("places", str(settings.places)),
            ("balls to calibrate", str(reading.presses)),
            ("readers", f"{settings.readers} of the {reading.method}"),
            ("noise", f"{reading.camera_noise:g} of 255"),
        ],
        rows=_rows(found),
        flat=f"{found.flat[0]:.1f} degrees and {found.flat[1]:.3f} mm",
        figure=figure_uri(change_figure(found)),
        worst=f"{WORST_ANGLE:g}",
        objects=[_object(found, row, name, axes) for row, name in enumerate(settings.objects)],
        settings=[
            ("skin", reading.skin),
            ("photons", f"{reading.photons:,}"),
            ("balls", f"{reading.radius:g} mm, {reading.depth[0]:g} to {reading.depth[1]:g} deep"),
            ("seed", str(reading.seed)),
        ],
    )


def change_figure(found: Verification) -> Figure:
    """Draw the change of the normals' error for each object and place, and the mean of all."""
    before, after = (errors.mean(axis=2) for errors in found.normals)
    change = after - before
    names = list(found.settings.objects)
    figure = new_figure(9.5, 1.6 + 0.32 * (len(names) + 1))
    axes = figure.subplots()
    for row, values in enumerate(change):
        axes.plot(values, np.full(len(values), row), "o", ms=4, color=BLUE, alpha=0.45)
    axes.plot(change.mean(axis=1), range(len(names)), "D", ms=6, color=BLUE, label="object")
    mean = found.normal_change
    colour = {BETTER: "#2e8b57", WORSE: RED, INCONCLUSIVE: AMBER}[mean.verdict]
    label = "mean"
    if mean.ends is not None:
        axes.plot(mean.ends, [len(names)] * 2, color=colour, lw=3)
        label = "mean and 95 % interval"
    axes.plot(mean.change, len(names), "D", ms=8, color=colour, label=label)
    axes.axvline(0.0, color=GREY, lw=1.2, ls="--")
    axes.set_yticks(range(len(names) + 1), [*(OBJECTS[name].title for name in names), "all"])
    axes.invert_yaxis()
    axes.set_xlabel(
        f"change of the error of normals (degrees); where negative, {found.names[1]} reads better"
    )
    legend_above(axes)
    return figure


def _rows(found: Verification) -> list[list[str]]:
    """Return label, first sensor, second sensor, change and interval."""
    one, other = found.views
    return [
        _change("error of normals (degrees)", found.normal_change, 1),
        _change("error of depth (mm)", found.depth_change, 3),
        ["skin in view", f"{100 * one.coverage:.1f} %", f"{100 * other.coverage:.1f} %", "", ""],
        ["a pixel shows, longer side (mm)", f"{one.detail:.3f}", f"{other.detail:.3f}", "", ""],
        ["stretched, length by width", f"{one.stretching:.2f}", f"{other.stretching:.2f}", "", ""],
    ]


def _change(label: str, change: ErrorChange, digits: int) -> list[str]:
    return [
        label,
        f"{change.before:.{digits}f}",
        f"{change.after:.{digits}f}",
        f"{change.change:+.{digits}f}",
        change.interval(digits),
    ]


def _object(
    found: Verification, row: int, name: str, axes: tuple[FloatArray, FloatArray]
) -> dict[str, Any]:
    """Return an object's errors, and its first place as both sensors show it."""
    means = [errors[row].mean() for errors in found.normals]
    depths = [errors[row].mean() for errors in found.depths]
    sides = []
    for label, kept, camera, mean, depth in zip(
        found.names, found.pictures[name], axes, means, depths, strict=True
    ):
        sides.append(
            {
                "label": label,
                "summary": f"{mean:.1f} degrees, {depth:.3f} mm over all places",
                "pictures": _pictures(kept, camera),
            }
        )
    contact = found.contacts[name][0]
    return {
        "title": OBJECTS[name].title,
        "help": OBJECTS[name].help,
        "depth": f"{contact.depth:.2f} mm deep",
        "sides": sides,
    }


def _pictures(kept: PressPictures, axes: FloatArray) -> list[tuple[str, str]]:
    """Return caption and address of the cut-outs around a contact."""
    rows, columns = _around(np.isfinite(kept.angles))
    shown = {
        "picture": kept.picture,
        "true normals": normal_colours(kept.true_normals, axes),
        "read normals": normal_colours(kept.read_normals, axes),
        "error": _error_colours(kept.angles),
    }
    return [
        (caption, data_uri(np.ascontiguousarray(picture[rows, columns])))
        for caption, picture in shown.items()
    ]


def _around(mask: NDArray[np.bool_]) -> tuple[slice, slice]:
    """Return rows and columns of a contact and its surroundings; all if there is none."""
    if not mask.any():
        return slice(None), slice(None)
    found = []
    size = max(int(np.ptp(each)) + 1 for each in np.nonzero(mask))
    half = max(SMALLEST_CROP, round((1.0 + BESIDE) * size)) // 2
    for each, length in zip(np.nonzero(mask), mask.shape, strict=True):
        middle = int(each.min() + each.max()) // 2
        start = min(max(0, middle - half), max(0, length - 2 * half))
        found.append(slice(start, min(length, start + 2 * half)))
    return found[0], found[1]


def _error_colours(angles: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Return colours (h, w, 3): black is correct, yellow `WORST_ANGLE` or more, grey outside."""
    from matplotlib import colormaps

    share = np.clip(np.nan_to_num(angles) / WORST_ANGLE, 0.0, 1.0)
    colours: NDArray[np.uint8] = np.round(255 * colormaps["magma"](share)[..., :3]).astype(np.uint8)
    colours[~np.isfinite(angles)] = 110
    return colours

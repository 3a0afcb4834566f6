"""RGB2Normal: the linearity of colour as a function of the surface normal, on balls pressed in at
nine places (the OptiSense paper, "RGB2Normal mapping objective function").
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from optisense.array_types import FloatArray
from optisense.errors import ObjectiveError
from optisense.objectives import _figures
from optisense.objectives.press import Press, refuse_kind
from optisense.objectives.registry import objective
from optisense.objectives.settings import refuse_outside

if TYPE_CHECKING:
    from optisense.objectives.evaluation import Evaluation

DIRECTIONS = 8
"""Number of lines through a ball's middle: cardinal and ordinal, as in the OptiSense paper."""

COLOURS = "picture"
"""Kind of colours (see `Press.colours`) that the score reads: those of the stored picture."""

LEAST_PIXELS = 8
"""Smallest number of pixels on a line; a straight fit through fewer says little."""

MOST_LEAST_PIXELS = 10_000
"""Largest number of pixels that a line or press may be asked to have; none has as many."""

WIDTH_STEP = 40
"""Multiple of pixels to which a suggested width is rounded up; 120, 160, 240 and 320 are such."""

LINE, PRESS = "line", "press"
"""Pixels whose colours one principal component describes: those of a line (the OptiSense paper), or
those of all lines through a ball."""

MOST_DIRECTIONS = 360
"""Largest number of lines, one per degree: closer lines have the same pixels."""


@dataclass(frozen=True)
class Fit:
    """A straight line through (angle, dominant colour) points.

    Attributes:
        angles: (m,) signed angles, degrees.
        colours: (m,) dominant colour.
        slope, intercept: coefficients of colour over angle; the slope is at least 0.
        linearity: coefficient of determination R^2.
    """

    angles: FloatArray
    colours: FloatArray
    slope: float
    intercept: float
    linearity: float


def on_lines(
    press: Press, *, directions: int, half_lines: bool, least_pixels: int, **settings: object
) -> NDArray[np.bool_]:
    """Return a mask (h, w) of the pixels on the lines of a press, the only ones that are read; see
    `rgb2normal`.

    Raises:
        ObjectiveError: a setting is invalid or a line has too few pixels, as in `lines_of`.
    """
    return np.logical_or.reduce(
        list(lines_of(press, directions, half_lines, least_pixels).values())
    )


@objective(
    "rgb2normal",
    title="RGB2Normal",
    draw=_figures.draw_rgb2normal,
    beside=("worst_line",),
    reads=on_lines,
    range=(0.0, 1.0),
    usual=(0.72, 0.98),  # spherical ideal GelSight Mini, GelSight Mini
    numbers=("worst_line",),
)
def rgb2normal(
    evaluation: Evaluation,
    *,
    directions: int = DIRECTIONS,
    half_lines: bool = False,
    signed: bool = True,
    dominant: str = LINE,
    colours: str = COLOURS,
    least_pixels: int = LEAST_PIXELS,
) -> tuple[float, dict[str, Any], dict[str, Any]]:
    """The linearity of colour as a function of the surface normal on pressed balls: the mean R².

    1 is a perfect line, 0 none. The value is the mean, over compass directions and places, of the
    R² of dominant colour against signed angle along a line through the ball's centre.

    Args:
        directions: number of compass directions; two opposite ones share a diameter.
        half_lines: whether each direction's radius, from the centre outward, is fitted separately.
        signed: whether tilts on the two flanks of a ball have opposite signs.
        dominant: pixels of which the dominant colour is the first principal component: "line" or
            "press" (all lines through the ball).
        colours: kind of colours, "picture" or "response" (see `Press.colours`).
        least_pixels: smallest number of pixels of a line.
    """
    _refuse_directions(directions, half_lines)
    if dominant not in (LINE, PRESS):
        raise ObjectiveError(
            f"the setting 'dominant' is {dominant!r}", hint=f"Use {LINE} or {PRESS}"
        )
    refuse_outside("least_pixels", least_pixels, 3, MOST_LEAST_PIXELS)
    refuse_kind(colours)
    angles = np.arange(directions) * 360.0 / directions
    places: list[dict[str, Any]] = []
    lines = []
    for press in evaluation.presses:
        try:
            tilted = _tilts_on_lines(press, directions, half_lines, least_pixels)
        except ObjectiveError:
            # The shortest line of all presses tells which resolution they all need.
            presses = evaluation.presses
            raise _short_line(presses, directions, half_lines, least_pixels) from None
        read = {angle: press.colours(chosen, colours) for angle, (chosen, _) in tilted.items()}
        axis = principal_axis(np.concatenate(list(read.values()))) if dominant == PRESS else None
        fits = {
            angle: fit(tilts if signed else np.abs(tilts), read[angle], axis)
            for angle, (_, tilts) in tilted.items()
        }
        scores = {f"{angle:g}": fits[_line_of(angle, fits)].linearity for angle in angles}
        places.append(
            {
                "place": press.place,
                "score": float(np.mean(list(scores.values()))),
                "pixels": int(press.mask.sum()),
                "directions": scores,
            }
        )
        lines.append(fits)
    value = float(np.mean([place["score"] for place in places]))
    by_direction = {
        f"{angle:g}": float(np.mean([place["directions"][f"{angle:g}"] for place in places]))
        for angle in angles
    }
    worst = float(min(min(place["directions"].values()) for place in places))
    parts = {"worst_line": worst, "directions": by_direction, "places": places}
    return value, parts, {"lines": lines}


def lines_of(
    press: Press,
    directions: int = DIRECTIONS,
    half_lines: bool = False,
    least_pixels: int = LEAST_PIXELS,
) -> dict[float, NDArray[np.bool_]]:
    """Return the lines of a press as masks (h, w), by angle in degrees; see `rgb2normal` for the
    arguments.

    Raises:
        ObjectiveError: the directions have no opposite ones, or a line has too few pixels.
    """
    _refuse_directions(directions, half_lines)
    angles = np.arange(directions) * 360.0 / directions
    found = {}
    for angle in (angles if half_lines else angles[: directions // 2]).tolist():
        chosen = line(press, angle, half_lines)
        count = int(chosen.sum())
        if count < least_pixels:
            raise _short_line([press], directions, half_lines, least_pixels)
        found[angle] = chosen
    return found


def _short_line(
    presses: Sequence[Press], directions: int, half_lines: bool, least_pixels: int
) -> ObjectiveError:
    """Return the error about the shortest line of presses, with a resolution that suffices for it:
    lines are one pixel wide, so that their pixels grow in number with the image's width.

    If a line has no pixels and the contact has, the camera sees a part of the contact beside its
    middle, which all lines cross.
    """
    angles = np.arange(directions if half_lines else directions // 2) * 360.0 / directions
    count, number, angle = min(
        (int(line(press, angle, half_lines).sum()), number, angle)
        for number, press in enumerate(presses)
        for angle in angles.tolist()
    )
    press = presses[number]
    if count == 0 and np.count_nonzero(press.mask) >= least_pixels:
        return ObjectiveError(
            f"the middle of {press.name} is outside the camera's view or at its edge",
            hint="Move the place so that the camera sees the whole contact",
        )
    height, width = press.shown.height, press.shown.width
    needed = width * (least_pixels + 1) / max(count, 1)  # a pixel more or less is chance
    finer = WIDTH_STEP * math.ceil(needed / WIDTH_STEP)
    return ObjectiveError(
        f"{press.name} has {count} of the {least_pixels} pixels that the line at "
        f"{angle:g} degrees needs",
        hint=f"Use a higher resolution, such as {finer}x{round(finer * height / width)}",
    )


def _tilts_on_lines(
    press: Press, directions: int, half_lines: bool, least_pixels: int
) -> dict[float, tuple[NDArray[np.bool_], FloatArray]]:
    """Return the lines of a press, by angle, and the signed angles of the normals on each."""

    def tilts() -> dict[float, tuple[NDArray[np.bool_], FloatArray]]:
        return {
            angle: (chosen, signed_angles(press, angle, press.normals[chosen]))
            for angle, chosen in lines_of(press, directions, half_lines, least_pixels).items()
        }

    return press.derived(("tilts on lines", directions, half_lines, least_pixels), tilts)


def _refuse_directions(directions: int, half_lines: bool) -> None:
    if directions > MOST_DIRECTIONS:
        raise ObjectiveError(
            f"{directions} directions are too many", hint=f"Use up to {MOST_DIRECTIONS}"
        )
    if directions < 1 or (directions % 2 and not half_lines):
        raise ObjectiveError(
            f"{directions} directions have no opposite ones", hint="Use an even number from 2"
        )


def line(press: Press, angle: float, half: bool = False) -> NDArray[np.bool_]:
    """Return a mask (h, w) of the pixels of a contact on a line through the ball's centre.

    The line is the intersection of the surface with the plane through the centre that is spanned by
    the direction and the undisturbed normal. A pixel belongs to it if the true point that it sees
    is within half a pixel's footprint of that plane, so the line is one pixel wide in any camera,
    on any surface.

    Args:
        angle: direction, degrees from east towards north.
        half: whether the line is only the radius in that direction instead of the diameter.
    """
    box = press.box
    along = press.direction(angle)
    across = np.cross(press.inward, along)
    offset = press.points[box].astype(np.float64) - press.centre
    inside = press.mask[box]
    distance = np.where(inside, offset @ across, np.nan)
    footprint = np.fmax(_step(distance, 0), _step(distance, 1))
    near = inside & (np.abs(np.nan_to_num(distance, nan=np.inf)) <= footprint / 2)
    if half:
        near &= offset @ along >= 0.0
    chosen = np.zeros_like(press.mask)
    chosen[box] = near
    return chosen


def signed_angles(press: Press, angle: float, normals: ArrayLike) -> FloatArray:
    """Return the tilt (m,), degrees, of normals from the undisturbed normal towards the direction
    at `angle`.

    The tilt is signed, so that a line through the ball has tilts of both signs: along a whole
    diameter, even a perfect sensor's colour is no function of the unsigned angle.
    """
    n = np.asarray(normals, dtype=np.float64)
    tilt: FloatArray = np.degrees(np.arctan2(n @ press.direction(angle), n @ press.inward))
    return tilt


def fit(angles: ArrayLike, colours: ArrayLike, axis: FloatArray | None = None) -> Fit:
    """Fit the dominant colour of colours (m, 3), see `dominant_colour`, to angles (m,), degrees."""
    x, y = np.asarray(angles, dtype=np.float64), dominant_colour(colours, axis)
    if np.ptp(x) == 0.0 or np.ptp(y) == 0.0:  # constant values have no linear relation
        return Fit(x, y, 0.0, float(y.mean()), 0.0)
    across, up = x - x.mean(), y - y.mean()
    shared, spread = float(across @ up), float(across @ across)
    if shared < 0:
        y = -y
    slope = abs(shared) / spread
    return Fit(
        x, y, slope, float(y.mean() - slope * x.mean()), shared**2 / (spread * float(up @ up))
    )


def dominant_colour(colours: ArrayLike, axis: FloatArray | None = None) -> FloatArray:
    """Return the projection (m,) of colours (m, 3), about their mean, on an axis (3,): their own
    first principal component if None.
    """
    c = np.asarray(colours, dtype=np.float64)
    return (c - c.mean(axis=0)) @ (principal_axis(c) if axis is None else axis)


def principal_axis(colours: ArrayLike) -> FloatArray:
    """Return the first principal component (3,) of colours (m, 3), a unit vector (PCA)."""
    c = np.asarray(colours, dtype=np.float64)
    first: FloatArray = np.linalg.svd(c - c.mean(axis=0), full_matrices=False)[2][0]
    return first


def _line_of(angle: float, fits: dict[float, Fit]) -> float:
    """Return the line of a direction: its own radius, or its diameter."""
    return float(angle) if float(angle) in fits else float(angle) - 180.0


def _step(values: FloatArray, axis: int) -> FloatArray:
    """Return the change of values per pixel along an axis, the mean of both differences."""
    edge = np.full_like(values.take([0], axis), np.nan)
    change = np.concatenate([edge, np.abs(np.diff(values, axis=axis)), edge], axis)
    length = values.shape[axis]
    before, after = change.take(range(length), axis), change.take(range(1, length + 1), axis)
    one_side = np.fmax(before, after)  # the other neighbour is missing
    both = 0.5 * (before + after)
    return np.where(np.isnan(both), one_side, both)

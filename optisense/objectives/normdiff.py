"""NormDiff: the range of normals that noise makes indistinguishable (the OptiSense paper, "NormDiff
objective function").
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from optisense.array_types import FloatArray
from optisense.errors import ObjectiveError
from optisense.objectives import _figures
from optisense.objectives._colour_boxes import ranges_in_boxes
from optisense.objectives.press import Press, azimuths, refuse_kind
from optisense.objectives.registry import objective
from optisense.objectives.settings import refuse_outside

if TYPE_CHECKING:
    from optisense.objectives.evaluation import Evaluation

NOISE = 0.30
"""Noise of a colour, as a share of its value in each channel (the paper)."""

COLOURS = "response"
"""Kind of colours (see `Press.colours`) that the noise is relative to: the paper's noise is
proportional to the sensor's response."""

LEAST_NOISE = 1.0 / 255.0
"""Least noise of a channel, as a share of a full well. Relative noise alone would distinguish black
from nearly black; a real GelSight Mini has noise of 1 to 2 levels of 255 in the picture everywhere.
Of a linear camera, this is one of 255 levels; of a picture with the sRGB curve, it is 13 levels
near black and one at a linear value of 0.24. It exceeds `NOISE` below 0.013."""

THETA_WEIGHT = 1.0
"""Weight of the range of tilts, without a unit; equal to `PHI_WEIGHT`."""
PHI_WEIGHT = 1.0
"""Weight of the range of azimuths, without a unit. The paper adds both ranges with weights that it
does not state. Here both are degrees on the sphere of normals (see `azimuth_on_sphere`) and have
equal weights."""

LEAST_TILT = 1.0
"""Smallest change (degrees) of a pixel's normal with which the pixel counts as indented; a reader
can hardly tell smaller ones from the untouched surface.
"""

POLE = 2.0
"""Tilt (degrees) below which the azimuth of a normal counts as undefined: two such normals differ
by at most 4 degrees, whatever their azimuths.
"""

CELL = 3.0
"""Angle (degrees) between neighbouring normals of the grid on which the confusion is evaluated, far
below the confusion of the built-in sensors (31 degrees and more)."""

RING = 10_000
"""Multiplier of a ring's number in a normal's number, above the number of normals on a ring."""

LEAST_PIXELS = 50
"""Number of indented pixels below which a press has no score, as few differ by chance."""

MOST_WEIGHT = 100.0
"""Largest weight of a range in the sum; at this weight the other range hardly counts."""

MOST_LEAST_PIXELS = 1_000_000
"""Largest number of pixels that a press may be asked to have; no press has as many."""

LEAST_SHARE = 0.5
"""Least share of the steepest tilt seen in any direction that the camera must see towards every
direction. A press that the view's edge cuts half-way between its middle and its rim has this share,
and four fifths of its tilts; without the others, confusion would be lower. The skin and the
indenter scale all directions alike. On the built-in sensors, contacts on distant walls have the
lowest share, 0.75."""

DIRECTIONS = 8
"""Number of directions in which the tilts are checked, those of RGB2Normal."""

SAMPLE_SHARE = 0.75
"""Share of the camera samples of a pixel that is read together with many others. With all samples,
confusion is lower by less than a per cent, and the work is 1.5 times as much."""


class Confusion(NamedTuple):
    """Confusion over the sphere of normals.

    Attributes:
        theta, phi: (k,) polar angle and azimuth of the normals at which it is evaluated, degrees.
        confusion: (k,) confusion, degrees.
        theta_range, phi_range: (k,) its two unweighted parts, degrees.
        cells: (k,) numbers of the normals, the same for all presses.
    """

    theta: FloatArray
    phi: FloatArray
    confusion: FloatArray
    theta_range: FloatArray
    phi_range: FloatArray
    cells: NDArray[np.int64]


def sample_shares(press: Press, *, least_pixels: int, **settings: Any) -> FloatArray:
    """Return the share (h, w) of camera samples that the pixels of a press need; see `normdiff`.

    Raises:
        ObjectiveError: there are too few indented pixels, as in `indented_pixels`.
    """
    return np.where(indented_pixels(press, least_pixels), SAMPLE_SHARE, 0.0)


def bounds(*, theta_weight: float, phi_weight: float, **others: object) -> tuple[float, float]:
    """Return the lowest and the highest score; each range is 0 to 180 degrees."""
    return -180.0 * (theta_weight + phi_weight), 0.0


@objective(
    "normdiff",
    title="NormDiff",
    draw=_figures.draw_normdiff,
    beside=("theta_range", "phi_range"),
    reads=sample_shares,
    range=bounds,
    usual=(-74.0, -31.6),  # cylindrical GelSight Mini, GelBelt
    numbers=("theta_range", "phi_range"),
)
def normdiff(
    evaluation: Evaluation,
    *,
    noise: float = NOISE,
    theta_weight: float = THETA_WEIGHT,
    phi_weight: float = PHI_WEIGHT,
    nearest_only: bool = False,
    colours: str = COLOURS,
    least_pixels: int = LEAST_PIXELS,
) -> tuple[float, dict[str, Any], dict[str, Any]]:
    """Minus the mean range of normals that camera noise makes indistinguishable, in degrees.

    0 is best. For each normal found on a pressed ball, the range is that of the normals of all
    pixels whose colour lies within the noise; it is averaged over normals and places.

    Args:
        noise: half the width of the colour range, as a share of the value in each channel.
        theta_weight, phi_weight: weights of the two ranges in the sum.
        nearest_only: whether the confusion at a normal is that of the one pixel nearest to it,
            instead of the mean over all pixels that it is nearest to.
        colours: kind of colours with the noise, "response" or "picture" (see `Press.colours`).
        least_pixels: smallest number of indented pixels of a press.
    """
    refuse_outside("noise", noise, 0.0, 1.0)
    refuse_outside("theta_weight", theta_weight, 0.0, MOST_WEIGHT)
    refuse_outside("phi_weight", phi_weight, 0.0, MOST_WEIGHT)
    if theta_weight == phi_weight == 0.0:
        raise ObjectiveError(
            "both weights are 0, so every sensor would be perfect",
            hint="Give theta_weight or phi_weight a number above 0",
        )
    refuse_outside("least_pixels", least_pixels, 1, MOST_LEAST_PIXELS)
    refuse_kind(colours)
    places: list[dict[str, Any]] = []
    maps = []
    for press in evaluation.presses:
        indented, theta, phi = _indentation(press, least_pixels)
        found = confusion(
            press.colours(indented, colours),
            theta,
            phi,
            noise,
            theta_weight,
            phi_weight,
            nearest_only=nearest_only,
        )
        maps.append(found)
        places.append(
            {
                "place": press.place,
                "score": -float(found.confusion.mean()),
                "theta_range": float(found.theta_range.mean()),
                "phi_range": float(found.phi_range.mean()),
                "pixels": int(indented.sum()),
                "normals": len(found.cells),
            }
        )
    parts = {
        "theta_range": float(np.mean([place["theta_range"] for place in places])),
        "phi_range": float(np.mean([place["phi_range"] for place in places])),
        "places": places,
        "confusion_map": _mean_map(maps),
    }
    return float(np.mean([place["score"] for place in places])), parts, {}


def indented_pixels(press: Press, least: int = LEAST_PIXELS) -> NDArray[np.bool_]:
    """Return a mask (h, w) of the pixels of a press whose normals have changed (step 1).

    Raises:
        ObjectiveError: there are fewer than `least`.
    """
    turned = (press.normals * press.before).sum(axis=2) < np.cos(np.radians(LEAST_TILT))
    indented: NDArray[np.bool_] = press.mask & turned
    count = int(indented.sum())
    if count < least:
        raise ObjectiveError(
            f"{press.name} has {count} of the {least} indented pixels that it needs",
            hint="Use a higher resolution",
        )
    return indented


def _indentation(
    press: Press, least_pixels: int
) -> tuple[NDArray[np.bool_], FloatArray, FloatArray]:
    """Return the indented pixels of a press, and polar angles and azimuths there, degrees."""

    def indentation() -> tuple[NDArray[np.bool_], FloatArray, FloatArray]:
        indented = indented_pixels(press, least_pixels)
        theta, phi = azimuths(press, press.normals[indented])
        _refuse_cut(press, theta, phi)
        return indented, theta, phi

    return press.derived(("indentation", least_pixels), indentation)


def _refuse_cut(press: Press, theta: FloatArray, phi: FloatArray) -> None:
    """Refuse a press of which the camera sees only a part: one whose steepest tilt towards some
    direction is below `LEAST_SHARE` of the steepest one towards any.

    `theta` and `phi` are the polar angles and azimuths (n,) of its indented pixels, degrees.
    """
    angles = np.arange(DIRECTIONS) * 360.0 / DIRECTIONS
    towards = (theta * np.cos(np.radians(phi - angles[:, None]))).max(axis=1)
    least, most = towards.min(), towards.max()
    if least < LEAST_SHARE * most:
        raise ObjectiveError(
            f"the camera sees only a part of {press.name}: tilts of up to {max(least, 0.0):.0f} "
            f"degrees towards {angles[towards.argmin()]:g} degrees, and up to {most:.0f} towards "
            f"{angles[towards.argmax()]:g} degrees",
            hint="Move the place so that the camera sees the whole contact",
        )


def confusion(
    colours: ArrayLike,
    theta: ArrayLike,
    phi: ArrayLike,
    noise: float = NOISE,
    theta_weight: float = THETA_WEIGHT,
    phi_weight: float = PHI_WEIGHT,
    *,
    nearest_only: bool = False,
) -> Confusion:
    """Compute steps 2 to 6 of the paper for the indented pixels of one press.

    Args:
        colours: (n, 3) colours, 0 to 1.
        theta, phi: (n,) polar angle and azimuth of the true normal, degrees.
        noise, theta_weight, phi_weight, nearest_only: see `normdiff`.
    """
    c = np.asarray(colours, dtype=np.float64)
    polar, azimuth = np.asarray(theta, dtype=np.float64), np.asarray(phi, dtype=np.float64)
    # Steps 3 and 4: all pixels within the noise of each pixel's colour, and their normals.
    width = np.maximum(noise * c, LEAST_NOISE)
    theta_range, arc = ranges_in_boxes(c, c - width, c + width, polar, azimuth, polar >= POLE)
    phi_range = azimuth_on_sphere(arc, polar)
    total = theta_weight * theta_range + phi_weight * phi_range
    # Steps 2, 5 and 6: each normal of a grid takes the mean over the pixels nearest to it.
    cells, cell_theta, cell_phi = normal_cells(polar, azimuth)
    if nearest_only:
        apart = _angles_between(polar, azimuth, cell_theta, cell_phi)
        order = np.lexsort((apart, cells))
        chosen = order[np.unique(cells[order], return_index=True)[1]]
        cells, cell_theta, cell_phi = cells[chosen], cell_theta[chosen], cell_phi[chosen]
        total, theta_range, phi_range = total[chosen], theta_range[chosen], phi_range[chosen]
    found, first, member = np.unique(cells, return_index=True, return_inverse=True)
    number = np.bincount(member)

    def mean(values: FloatArray) -> FloatArray:
        averaged: FloatArray = np.bincount(member, values) / number
        return averaged

    return Confusion(
        cell_theta[first], cell_phi[first], mean(total), mean(theta_range), mean(phi_range), found
    )


def _angles_between(
    theta: FloatArray, phi: FloatArray, other_theta: FloatArray, other_phi: FloatArray
) -> FloatArray:
    """Return the angles (n,), degrees, between directions of these polar angles and azimuths."""
    one, other = np.radians(theta), np.radians(other_theta)
    cosine = np.cos(one) * np.cos(other)
    cosine += np.sin(one) * np.sin(other) * np.cos(np.radians(phi - other_phi))
    angles: FloatArray = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
    return angles


def azimuth_on_sphere(arc: ArrayLike, theta: ArrayLike) -> FloatArray:
    """Return the angles (...), degrees, between two normals of polar angle `theta` whose azimuths
    differ by `arc`, both (...), degrees.

    A range of azimuths has little effect on a normal of small tilt. It is therefore converted to
    the angle between the normals: sin(theta) * arc for small arcs, and at most 2 theta.
    """
    half = np.radians(np.minimum(np.asarray(arc, dtype=np.float64), 180.0)) / 2
    sine = np.sin(np.radians(np.asarray(theta, dtype=np.float64))) * np.sin(half)
    angle: FloatArray = 2.0 * np.degrees(np.arcsin(np.clip(sine, 0.0, 1.0)))
    return angle


def normal_cells(
    theta: ArrayLike, phi: ArrayLike, size: float = CELL
) -> tuple[NDArray[np.int64], FloatArray, FloatArray]:
    """Return the nearest of the normals of a grid on the sphere, with rings `size` degrees apart.

    Returns:
        The number (n,), polar angle (n,) and azimuth (n,), degrees, of the grid's normal.
    """
    polar, azimuth = np.asarray(theta, dtype=np.float64), np.asarray(phi, dtype=np.float64)
    ring = np.round(polar / size).astype(np.int64)
    around = 360.0 * np.sin(np.radians(ring * size)) / size
    sectors = np.maximum(1, np.round(around)).astype(np.int64)
    sector = np.round(azimuth / 360.0 * sectors).astype(np.int64) % sectors
    return ring * RING + sector, ring.astype(np.float64) * size, sector * 360.0 / sectors


def _mean_map(maps: list[Confusion]) -> dict[str, FloatArray]:
    """Return the confusion at each normal, averaged over the presses that have it."""
    cells = np.concatenate([each.cells for each in maps])
    _, first, member = np.unique(cells, return_index=True, return_inverse=True)
    number = np.bincount(member)
    columns = {
        "theta": np.concatenate([each.theta for each in maps])[first],
        "phi": np.concatenate([each.phi for each in maps])[first],
    }
    for name in ("confusion", "theta_range", "phi_range"):
        values = np.concatenate([getattr(each, name) for each in maps])
        columns[name] = np.round(np.bincount(member, values) / number, 3)
    return columns

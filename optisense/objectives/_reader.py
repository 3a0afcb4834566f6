"""Leave-one-out readings: each press is read by a reader that is calibrated with all the others."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import FloatArray
from optisense.errors import ObjectiveError
from optisense.objectives.press import Press
from optisense.objectives.settings import refuse_outside
from optisense.reading.camera_noise import MEASURED_NOISE
from optisense.reading.lookup import (
    Pixels,
    PressTable,
    TiltLookup,
    normals_to_tilts,
    tilt_grid,
    tilt_kernel,
)

if TYPE_CHECKING:
    from optisense.objectives.evaluation import Evaluation

CAMERA_NOISE = MEASURED_NOISE

MOST_NOISE = 128.0
"""Upper bound on the camera noise (levels of 255): half of the range makes pictures useless."""

PIXELS_A_PRESS = 600
"""Approximate number of pixels of a contact that are read: every second one along rows and columns
on GelSight Mini at a width of 640. With all pixels the error differs by less than a per cent and
takes four times as long."""

LEAST_PIXELS = 50
"""Number of pixels of a contact below which a press has no score, as in NormDiff."""

LEAST_PRESSES = 4
"""Smallest number of presses: a fourth is read from three others, the fewest that determine the
change of colours along two directions."""

NUMBERS = ("reading_nothing", "worst_place", "mean_of_places")
"""Names of the numbers of a summary of places."""

_CAMERA = 11
"""Number that is hashed with the seed of the camera's noise, so that it is independent of other
random draws. It is unique among the modules that use the same seed."""


@dataclass(frozen=True)
class ReadPress:
    """The true and the read normals of one press, on a grid of its pixels.

    Attributes:
        press: the press.
        grid: rows and columns of its images that are read.
        mask: (h, w) mask of the contact, over which errors are averaged.
        seen: (h, w) mask of all pixels that were read; those outside the contact show flat skin.
        normals: (h, w, 3) read unit normals in the design's frame; the untouched ones elsewhere.
        true_normals: (h, w, 3) true unit normals; the untouched ones outside the contact.
    """

    press: Press
    grid: tuple[slice, slice]
    mask: NDArray[np.bool_]
    seen: NDArray[np.bool_]
    normals: FloatArray
    true_normals: FloatArray


def pixels_to_read(press: Press, **settings: object) -> NDArray[np.bool_]:
    """Return the mask (h, w) of the pixels of a contact that are read.

    Raises:
        ObjectiveError: the contact has too few pixels.
    """
    rows, columns = grid_of(press)
    chosen = np.zeros_like(press.mask)
    chosen[rows, columns] = press.mask[rows, columns]
    return chosen


def grid_of(press: Press) -> tuple[slice, slice]:
    """Return the rows and columns that are read: every k-th of the box around the contact.

    Raises:
        ObjectiveError: the contact has too few pixels.
    """
    count = int(press.mask.sum())
    if count < LEAST_PIXELS:
        raise ObjectiveError(
            f"{press.name} has {count} of the {LEAST_PIXELS} pixels that it needs",
            hint="Use a higher resolution",
        )
    step = max(1, round((count / PIXELS_A_PRESS) ** 0.5))
    rows, columns = press.box
    return slice(rows.start, rows.stop, step), slice(columns.start, columns.stop, step)


def read_presses(evaluation: Evaluation, camera_noise: float = CAMERA_NOISE) -> list[ReadPress]:
    """Read each press of a sensor with a reader that is calibrated with the other presses.

    Args:
        evaluation: the sensor; it keeps the readings for other objectives.
        camera_noise: standard deviation of the noise of all pictures, levels of 255.

    Raises:
        ObjectiveError: there are too few presses, or one cannot be scored.
    """
    refuse_outside("camera_noise", camera_noise, 0.0, MOST_NOISE)
    return evaluation.shared(
        f"presses read with noise {camera_noise!r}",
        partial(_read, evaluation, camera_noise),
    )


def summarise_places(places: Sequence[Mapping[str, Any]]) -> tuple[float, dict[str, Any]]:
    """Return the median of the places' errors, and a summary of the places.

    Args:
        places: for each place its `error`, and in `reading_nothing` the error of a reader that
            always reads a flat surface, in the same unit.
    """
    errors = [place["error"] for place in places]
    parts = {
        "reading_nothing": float(np.mean([place["reading_nothing"] for place in places])),
        "worst_place": max(errors),
        "mean_of_places": float(np.mean(errors)),
        "places": places,
    }
    return float(np.median(errors)), parts


def _read(evaluation: Evaluation, noise: float) -> list[ReadPress]:
    presses = evaluation.calibration_presses
    if len(presses) < LEAST_PRESSES:
        raise ObjectiveError(
            f"{len(presses)} presses are too few to calibrate a reader and to test it",
            hint=f"Press at {LEAST_PRESSES} places or more",
        )
    known = [press.derived("pixels to read", partial(_KnownPress.of, press)) for press in presses]
    steepest = max(each.steepest for each in known)
    grid = tilt_grid(steepest)
    pixels, tables = [], []
    for press, each in zip(presses, known, strict=True):
        kernel = press.derived(
            ("kernel of tilts", steepest), partial(tilt_kernel, each.tilts, grid)
        )
        pixels.append(each.pixels(press, noise, evaluation.settings.seed))
        tables.append(PressTable.of(pixels[-1][: len(each.tilts)], kernel))
    found = []
    for number, (press, each) in enumerate(zip(presses, known, strict=True)):
        reader = TiltLookup([*tables[:number], *tables[number + 1 :]], grid, noise)
        found.append(each.read(press, reader.normals(pixels[number])))
    return found


@dataclass(frozen=True)
class _KnownPress:
    """Data of a press that do not depend on the light.

    Attributes:
        grid, mask, seen, true_normals: as in `ReadPress`.
        order: (n,) order of the pixels seen in which the m pixels of the contact come first.
        frames: (n, 3, 3) frame of each pixel: unit tangents of the untouched surface, and normal.
        tilts: (m, 2) true tilts, degrees (see `optisense.reading.lookup.tilt_grid`).
    """

    grid: tuple[slice, slice]
    mask: NDArray[np.bool_]
    seen: NDArray[np.bool_]
    true_normals: FloatArray
    order: NDArray[np.intp]
    frames: FloatArray
    tilts: FloatArray

    @classmethod
    def of(cls, press: Press) -> _KnownPress:
        """Collect the data of a press from its images."""
        grid = grid_of(press)
        before = press.before[grid].astype(np.float64)
        seen = np.linalg.norm(before, axis=2) > 0.5  # normals are 0 where a ray misses the skin
        mask = np.logical_and(press.mask[grid], seen)
        true = np.where(mask[..., None], press.normals[grid].astype(np.float64), before)
        order = np.argsort(~mask[seen], kind="stable")
        untouched = before[seen][order]
        first = press.east - (untouched @ press.east)[:, None] * untouched
        first /= np.linalg.norm(first, axis=1, keepdims=True)
        frames = np.stack([first, np.cross(first, untouched), untouched], axis=1)
        local = np.einsum("nij,nj->ni", frames, true[seen][order])
        tilts = normals_to_tilts(local[: np.count_nonzero(mask)])
        return cls(grid, mask, seen, true, order, frames, tilts)

    @property
    def steepest(self) -> float:
        """The largest tilt, degrees."""
        return float(np.linalg.norm(self.tilts, axis=1).max())

    def pixels(self, press: Press, noise: float, seed: int) -> Pixels:
        """Return the camera's stored values of the pixels seen, those of the contact first."""

        def chosen(images: NDArray[np.floating]) -> FloatArray:
            return images[self.grid][self.seen][self.order].astype(np.float64)

        picture = 255.0 * press.camera.curve(chosen(press.response))
        if noise > 0:
            random = np.random.default_rng([seed, press.number, _CAMERA])
            picture = picture + random.normal(0.0, noise, picture.shape)
        untouched = 255.0 * press.camera.curve(chosen(press.untouched))
        stored = np.clip(np.round(picture), 0.0, 255.0)
        return Pixels(stored, untouched, chosen(press.picture_places))

    def read(self, press: Press, local: FloatArray) -> ReadPress:
        """Return the reading of the press from read normals (n, 3) in its pixels' frames."""
        normals = self.true_normals.copy()
        ordered = np.empty_like(local)
        ordered[self.order] = np.einsum("nij,ni->nj", self.frames, local)
        normals[self.seen] = ordered
        return ReadPress(press, self.grid, self.mask, self.seen, normals, self.true_normals)

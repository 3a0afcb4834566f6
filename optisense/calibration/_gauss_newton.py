"""Fit of a layered model to photographs by damped Gauss-Newton steps.

The residuals are those of the background and of each press's response near its contact. Each is
divided by the error that is expected at its pixel from the noise of the photographs and of the
model's light, and by the usual ratio of the errors of its set, background or responses, to the
expected ones. Each set counts as many times as it contains independent errors. All these are
estimated anew before each descent. So the background, whose errors are larger and smoother, does
not outweigh the contacts, and neither do dark places, where a tone curve amplifies the noise of the
light. Priors of the plausible ranges are added. Huber's weights limit the influence of dust and
scratches.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from copy import copy
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from optisense.array_types import FloatArray
from optisense.calibration._covered_view import outline_of, with_smooth_outline
from optisense.calibration._error_scales import HUBER, Pixels, Scales, expected_errors
from optisense.calibration._far_field import without_drift
from optisense.calibration._least_squares import (
    LinearEquations,
    Solution,
    jackknife_covariance,
    noise_energy,
    normal_equations,
    slope_reduction,
)
from optisense.calibration.model_pictures import (
    LayeredPictures,
    PictureSlopes,
    contact_slopes,
    levels_of,
)
from optisense.calibration.photographs import Photographs
from optisense.calibration.quantities import chain_with, power_factors
from optisense.calibration.quantity import FitQuantity
from optisense.calibration.realism import distances
from optisense.calibration.seen_contacts import SeenContact

NEAR = 2.2
"""Radius within which the response of a press counts, in its radii; beyond, there is noise."""

LEVELS = 12.0, 253.0
"""Smallest and largest level that is compared. Above, pictures are clipped; below, a usual tone
curve is so steep that the noise of the light outweighs everything else."""

STEP = 0.002
"""Step of a number's difference quotient, in plausible ranges: far above the rounding of pictures,
which are not rounded to levels, and small enough for the levels of dark places to change linearly.
With ten times this step, fits to dark pictures stop before the minimum."""

CONTACT_SPREAD = (2.0, 2.0, 0.1)
"""Plausible ranges of a contact's column and row, in pixels at a width of 320, and of the logarithm
of its radius: the errors of hand labels.
"""

BLOCKS = 4
"""Number of square blocks across a picture whose errors are regarded as independent of each other
in the estimate of uncertainties: the errors of the light are correlated over smaller ones. Errors
at one place of all pictures are not independent, as they have the same light and background."""

MOST_STEPS = 20
"""Largest number of damped steps of one descent; several times as many as a fit needs."""

MOST_DESCENTS = 4
"""Largest number of descents, each with the scales of the residuals that the one before leaves."""

SMALL_GAIN = 0.02
"""Decrease of the sum of squares that ends a descent. A number off by its uncertainty adds 1."""

LARGEST_STEP = 1.0
"""Largest change of a number in one step, in plausible ranges; the model is nearly linear there."""

TRUST = 2.5
"""Largest change over which layers are extrapolated by their difference quotients, in plausible
ranges; the next round renders them anew.
"""


class _Point(NamedTuple):
    """Steps of the numbers, changes of the contacts, and their pictures by `LayeredFit`."""

    steps: FloatArray
    contacts: FloatArray
    pictures: list[FloatArray]


class LayeredFit:
    """Photographs, and the layers of a model with their slopes."""

    def __init__(
        self,
        photographs: Photographs,
        seen: Sequence[SeenContact],
        layers: LayeredPictures,
        chosen: Sequence[FitQuantity],
        exposure: float,
        start: FloatArray,
        slopes: dict[int, PictureSlopes],
        noise: LayeredPictures | None = None,
        kept: Sequence[int] = (),
        pixels: float | None = None,
        blur: float = 0.0,
    ) -> None:
        """Prepare a round.

        Args:
            layers: layers of the model at `start`.
            exposure: factor on the radiance.
            start: steps (n,) of the quantities at which the layers were rendered.
            slopes: slopes of quantities that need a rendering, by index.
            noise: errors of the layers by the noise of the light, a sample of them; None if they
                are not known. Noisy slopes are then reduced to their true part.
            kept: indices of quantities that are not changed.
            pixels: number of pixels for which there is one independent error in a rough round; None
                estimates it from the errors.
            blur: standard deviation, pixels, by which pictures are blurred: details of blurred
                pictures fit over larger displacements.
        """
        self._noise = noise
        self._kept = list(kept)
        self._pixels, self._blur = pixels, blur
        self._layers, self._chosen, self._exposure = layers, list(chosen), exposure
        self._start, self._slopes = start, slopes
        self._seen = seen
        self._noisy = [number for number, each in slopes.items() if each.noise]
        self._reduction = np.zeros((len(chosen) + 3 * len(seen), len(self._noisy)))
        self._outline = None
        if layers.coverage is not None:
            others = [each.coverage for each in slopes.values() if each.coverage is not None]
            self._outline = outline_of(layers.coverage, *(layers.coverage + d for d in others))
        limits = np.array([each.limits() for each in chosen]).reshape(-1, 2)
        self._low, self._high = limits[:, 0], limits[:, 1]
        self._real = self._compared(photographs.background)
        shape = self._real.shape[:2]
        away = [distances(shape, place) for place in seen]
        self._responses = [
            without_drift(self._compared(press.picture) - self._real, distance)
            for press, distance in zip(photographs.presses, away, strict=True)
        ]
        self._masks: list[Pixels] = [slice(None), *(distance <= NEAR for distance in away)]
        scale = shape[1] / 320.0
        self._contact_spread = np.array(CONTACT_SPREAD) * (scale, scale, 1.0)
        self._contact_slopes = [
            contact_slopes(layers, index, place) for index, place in enumerate(seen)
        ]

    @property
    def count(self) -> int:
        """Number of quantities."""
        return len(self._chosen)

    def pictures(
        self, steps: FloatArray, contacts: FloatArray, noise: LayeredPictures | None = None
    ) -> list[FloatArray]:
        """Return the levels (h, w, 3) of the background and of each press, within those that are
        compared, for steps (n,) of the quantities, in plausible ranges from their starts, and
        changes (presses, 3) of the contacts' column, row (pixels) and logarithm of the radius.
        """
        steps, contacts = self._reduced(steps, contacts)
        return [self._shown(-1, steps, None, noise)] + [
            self._shown(index, steps, contacts[index], noise) for index in range(len(self._seen))
        ]

    def _reduced(self, steps: FloatArray, contacts: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the unknowns whose pictures by noisy slopes are those by the estimated true ones,
        see `slope_reduction`.
        """
        moved = self._reduction @ (steps - self._start)[self._noisy]
        change = moved[self.count :].reshape(-1, 3) * self._contact_spread
        return steps + moved[: self.count], contacts + change

    def _shown(
        self,
        index: int,
        steps: FloatArray,
        contact: FloatArray | None,
        noise: LayeredPictures | None = None,
    ) -> FloatArray:
        """Return the levels of a press, or of the background (index -1), with added noise."""
        moved = self._layers.pictures[index + 1]
        if noise is not None:
            moved = moved + noise.pictures[index + 1]
        coverage = self._layers.coverage
        for number, slopes in self._slopes.items():
            off = float(np.clip(steps[number] - self._start[number], -TRUST, TRUST))
            if off:
                moved = moved + off * slopes.layers[index + 1]
                if coverage is not None and slopes.coverage is not None:
                    coverage = coverage + off * slopes.coverage
        if contact is not None and index >= 0:
            for amount, slope in zip(contact, self._contact_slopes[index], strict=True):
                if amount:
                    moved = moved + np.float32(amount) * slope
        factors = power_factors(self._layers.groups, self._chosen, steps)
        radiance = np.tensordot(factors.astype(np.float32), moved, axes=1)
        chain = chain_with(self._layers.chain, self._chosen, steps)
        levels = levels_of(np.maximum(radiance, 0.0), chain, self._exposure)
        if coverage is not None and self._outline is not None:
            share = np.clip(coverage, 0.0, 1.0)
            (levels,) = with_smooth_outline(levels[None], share, self._outline)
        return self._compared(levels)

    def _compared(self, levels: NDArray[Any]) -> FloatArray:
        """Return the levels of a picture that are compared: within limits, and blurred."""
        found = np.clip(levels.astype(np.float64), *LEVELS)
        if self._blur:
            found = gaussian_filter(found, (self._blur, self._blur, 0.0))
        return np.asarray(found)

    def solve(self, steps: FloatArray, contacts: FloatArray) -> Solution:
        """Run damped Gauss-Newton steps from a start, as in `pictures`, until the sum of squares
        stops falling.
        """
        point = self._point(steps, contacts)
        for _ in range(MOST_DESCENTS):
            scales = self._scales(point)
            point = self._descend(self._without_noise(point, scales), scales)
            # The errors are smaller now, and so are the scales of the residuals.
            if self._scales(point).like(scales):
                break
        spread = self._covariance(point, scales)
        ground, *presses = (
            self._root_mean_square(point.pictures, index) for index in range(-1, len(self._seen))
        )
        return Solution(
            point.steps,
            point.contacts,
            spread[: self.count, : self.count],
            (ground, float(np.sqrt(np.mean(np.square(presses))))),
            np.array(presses),
        )

    def _point(self, steps: FloatArray, contacts: FloatArray) -> _Point:
        return _Point(steps, contacts, self.pictures(steps, contacts))

    def _without_noise(self, point: _Point, scales: Scales) -> _Point:
        """Return the point with pictures by slopes that are reduced by their noise there."""
        if not self._noisy or self._noise is None:
            return point
        self._reduction[:] = 0.0
        point = self._point(point.steps, point.contacts)
        half = self._half(self._noise)
        energy = noise_energy(
            self._linear(point, scales),
            half._linear(half._point(point.steps, point.contacts), scales),
            len(self._reduction),
        )
        matrix, _ = self._normal(point, scales)
        self._reduction = slope_reduction(matrix, energy, self._noisy)
        return self._point(point.steps, point.contacts)

    def _half(self, noise: LayeredPictures) -> LayeredFit:
        """Return the fit to one of the two renderings whose mean this fit has."""
        half = copy(self)
        half._layers = self._layers.plus(noise.pictures)
        half._slopes = {number: each.half() for number, each in self._slopes.items()}
        half._contact_slopes = [
            contact_slopes(half._layers, index, place) for index, place in enumerate(self._seen)
        ]
        return half

    def _descend(self, point: _Point, scales: Scales) -> _Point:
        """Return the point of the least cost that is found from another one."""
        cost = self._cost(point, scales)
        damping = 1e-3
        for _ in range(MOST_STEPS):
            matrix, gradient = self._normal(point, scales)
            fell = False
            free = self._free(point.steps, gradient)
            for _ in range(6):
                damped = (matrix + damping * np.diag(np.diag(matrix)))[np.ix_(free, free)]
                move = np.zeros(len(gradient))
                move[free] = -np.linalg.solve(damped, gradient[free])
                move *= min(1.0, LARGEST_STEP / max(float(np.abs(move).max()), 1e-12))
                moves = move[self.count :].reshape(-1, 3)
                new = self._point(
                    np.clip(point.steps + move[: self.count], self._low, self._high),
                    point.contacts + moves * self._contact_spread,
                )
                new_cost = self._cost(new, scales)
                if new_cost < cost:
                    fell = True
                    damping = max(0.3 * damping, 1e-9)
                    break
                damping = 10.0 * max(damping, 1e-6)
            if not fell:
                break
            gain = cost - new_cost
            point, cost = new, new_cost
            if gain < SMALL_GAIN:
                break
        return point

    def _free(self, steps: FloatArray, gradient: FloatArray) -> NDArray[np.bool_]:
        """Return which unknowns may move: all but those that are kept, and numbers at a limit that
        would leave it.
        """
        slope = gradient[: self.count]
        stuck = (steps <= self._low) & (slope > 0.0) | (steps >= self._high) & (slope < 0.0)
        stuck[self._kept] = True
        return np.concatenate([~stuck, np.ones(len(gradient) - self.count, dtype=bool)])

    def _error(self, pictures: list[FloatArray], index: int) -> FloatArray:
        """Return the error (h, w, 3) of the background (index -1), or of a press's response."""
        if index < 0:
            return pictures[0] - self._real
        return pictures[index + 1] - pictures[0] - self._responses[index]

    def _root_mean_square(self, pictures: list[FloatArray], index: int) -> float:
        """Return the root mean square of the error of the background or near a contact, levels."""
        error = self._error(pictures, index)[self._masks[index + 1]]
        return float(np.sqrt((error**2).mean()))

    def _scales(self, point: _Point) -> Scales:
        """Return the sizes of the errors, unaffected by dust."""
        expected = expected_errors(point.pictures[0], self._noise_of(point), self._outline)
        errors = [self._error(point.pictures, index) for index in range(-1, len(self._seen))]
        return Scales.of_errors(errors, expected, self._masks, self._pixels)

    def _noise_of(self, point: _Point) -> list[FloatArray]:
        """Return a sample of the light's noise, levels (h, w, 3), in background and responses; 0 in
        a rough round.
        """
        steps, contacts, pictures = point
        if self._noise is None or self._pixels is not None:
            return [np.zeros_like(shown) for shown in pictures]
        noisy = self.pictures(steps, contacts, self._noise)
        ground, *pressed = (one - two for one, two in zip(noisy, pictures, strict=True))
        return [ground] + [each - ground for each in pressed]

    def _residuals(self, pictures: list[FloatArray], index: int, scales: Scales) -> FloatArray:
        """Return the residuals (h, w, 3) of the background (index -1), or those (k, 3) of the k
        pixels near a contact.
        """
        size = scales.of(index).size * scales.expected[index + 1]
        mask = self._masks[index + 1]
        return np.asarray(self._error(pictures, index)[mask] / size[mask])

    def _cost(self, point: _Point, scales: Scales) -> float:
        total = float((self._prior(point) ** 2).sum())
        for index in range(-1, len(self._seen)):
            size = np.abs(self._residuals(point.pictures, index, scales))
            loss = np.where(size < HUBER, size**2, HUBER * (2.0 * size - HUBER))
            total += float(loss.sum()) / scales.of(index).pixels
        return total

    def _normal(self, point: _Point, scales: Scales) -> tuple[FloatArray, FloatArray]:
        """Return matrix and gradient of the normal equations."""
        size, whole = self.count + 3 * len(self._seen), np.zeros(self._real.shape[:2], np.int64)
        (matrix,), (gradient,) = normal_equations(self._linear(point, scales), size, whole)
        return matrix + np.eye(size), gradient + self._prior(point)

    def _prior(self, point: _Point) -> FloatArray:
        """Return all unknowns (n,) in plausible ranges, which are their residuals of the prior."""
        return np.concatenate([point.steps, (point.contacts / self._contact_spread).ravel()])

    def _linear(self, point: _Point, scales: Scales) -> Iterator[LinearEquations]:
        """Yield the linear equations of the background and of each press."""
        steps, contacts, pictures = point
        n = self.count
        moved = [self._moved(steps, contacts, k) for k in range(n)]
        for index in range(-1, len(self._seen)):
            residual = self._residuals(pictures, index, scales)
            unknowns = list(range(n))
            if not unknowns and index < 0:
                continue
            slopes = [(self._residuals(m, index, scales) - residual) / by for by, m in moved]
            if index >= 0:
                unknowns += range(n + 3 * index, n + 3 * index + 3)
                slopes += [
                    (self._residuals(m, index, scales) - residual) / STEP
                    for m in self._contact_moved(point, index)
                ]
            weight = np.minimum(1.0, HUBER / np.maximum(np.abs(residual), 1e-12))
            weight /= scales.of(index).pixels
            yield unknowns, np.stack(slopes, axis=-1), weight, residual, self._masks[index + 1]

    def _covariance(self, point: _Point, scales: Scales) -> FloatArray:
        """Return the covariance of the unknowns, from the errors of blocks of the pictures."""
        height, width = self._real.shape[:2]
        rows, columns = (BLOCKS * np.mgrid[:height, :width] / width).astype(np.int64)
        blocks = BLOCKS * rows + columns
        size = self.count + 3 * len(self._seen)
        return jackknife_covariance(*normal_equations(self._linear(point, scales), size, blocks))

    def _moved(
        self, steps: FloatArray, contacts: FloatArray, number: int
    ) -> tuple[float, list[FloatArray]]:
        """Return a small step of a number, away from its upper limit, and the pictures after it."""
        by = -STEP if steps[number] + STEP > self._high[number] else STEP
        other = steps.copy()
        other[number] += by
        return by, self.pictures(other, contacts)

    def _contact_moved(self, point: _Point, index: int) -> list[list[FloatArray]]:
        steps, contacts = self._reduced(point.steps, point.contacts)
        found = []
        for axis in range(3):
            other = contacts[index].copy()
            other[axis] += STEP * self._contact_spread[axis]
            changed = list(point.pictures)
            changed[index + 1] = self._shown(index, steps, other)
            found.append(changed)
        return found

"""Fit of a layered model to photographs by damped Gauss-Newton steps.

The residuals are those of the background, divided by its usual error, and of each press's response
near its contact, divided by the usual error of all responses; both are estimated anew before each
round. So the background, which differs more, does not outweigh the contacts. Priors of the
plausible ranges are added. Huber's weights limit the influence of dust and scratches.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from optisense.calibration.layered_pictures import LayeredPictures, contact_slopes
from optisense.calibration.model_pictures import levels_of
from optisense.calibration.photographs import Photographs
from optisense.calibration.quantities import chain_with, power_factors
from optisense.calibration.quantity import FitQuantity
from optisense.calibration.realism import distances
from optisense.calibration.seen_contacts import SeenContact

FloatArray = NDArray[np.float64]

NEAR = 2.2
"""Radius within which the response of a press counts, in radii of its contact; beyond, there is
noise.
"""

LEAST_ERROR = 2.0
"""Smallest error by which residuals are divided, in levels: the noise of a photograph."""

INDEPENDENT = 36.0
"""Number of pixels of a photograph for which there is one independent error: errors of the model
extend over some six pixels in each direction.
"""

HUBER = 2.0
"""Residual, in units of the root mean square, beyond which it counts linearly instead of
quadratically (Huber 1964).
"""

TO_DEVIATION = 1.4826
"""Ratio of the standard deviation of a normal distribution to the median of its absolute values."""

STEP = 0.02
"""Step of a number's difference quotient, in plausible ranges."""

CONTACT_SPREAD = (2.0, 2.0, 0.1)
"""Plausible ranges of a contact's column and row, in pixels at a width of 320, and of the logarithm
of its radius: the errors of hand labels.
"""

TILE = 16
"""Side of tiles whose errors are assumed to be independent in the estimate of uncertainties, in
pixels.
"""

MOST_STEPS = 20
"""Largest number of damped steps of one descent; several times as many as a fit needs."""

SMALL_GAIN = 0.02
"""Decrease of the sum of squares below which a descent ends. A number that is off by its
uncertainty adds 1.
"""

LARGEST_STEP = 1.0
"""Largest change of a number in one step, in plausible ranges; the model is nearly linear there."""

TRUST = 2.5
"""Largest change over which layers are extrapolated by their difference quotients, in plausible
ranges.
"""


@dataclass(frozen=True)
class Solution:
    """Solution of one round of the fit.

    Attributes:
        steps: steps (n,) of the quantities, in plausible ranges from their starts.
        contacts: changes (presses, 3) of column and row, pixels, and of the logarithm of the
            radius.
        covariance: covariance (n, n) of the steps: that of the posterior, with one independent
            error for 36 pixels, plus that of errors which are correlated within tiles.
        errors: root mean square errors of the background and of the responses, levels.
        outlying: root mean square error of each press's response, levels.
    """

    steps: FloatArray
    contacts: FloatArray
    covariance: FloatArray
    errors: tuple[float, float]
    outlying: FloatArray


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
        slopes: dict[int, list[NDArray[np.float32]]],
    ) -> None:
        """Prepare a round.

        Args:
            photographs: photographs to fit.
            seen: contacts in the photographs.
            layers: layers of the model at `start`.
            chosen: quantities to fit.
            exposure: factor on the radiance.
            start: steps (n,) of the quantities at which the layers were rendered.
            slopes: slopes of quantities that need a rendering, by index: changes of the layers of
                the background and of each press per plausible range.
        """
        self._layers, self._chosen, self._exposure = layers, list(chosen), exposure
        self._start, self._slopes = start, slopes
        self._real = photographs.background.astype(np.float64)
        self._responses = [p.picture.astype(np.float64) - self._real for p in photographs.presses]
        shape = self._real.shape[:2]
        self._masks = [distances(shape, place) <= NEAR for place in seen]
        scale = shape[1] / 320.0
        self._contact_spread = np.array(CONTACT_SPREAD) * (scale, scale, 1.0)
        self._contact_slopes = [
            contact_slopes(layers, index, place) for index, place in enumerate(seen)
        ]
        rows, columns = np.mgrid[: shape[0], : shape[1]] // TILE
        self._tiles = rows * (shape[1] // TILE + 1) + columns

    @property
    def count(self) -> int:
        """Number of quantities."""
        return len(self._chosen)

    def pictures(self, steps: FloatArray, contacts: FloatArray) -> list[FloatArray]:
        """Return the levels of the background and of each press."""
        return [self._shown(-1, steps, None)] + [
            self._shown(index, steps, contacts[index]) for index in range(len(self._masks))
        ]

    def _shown(self, index: int, steps: FloatArray, contact: FloatArray | None) -> FloatArray:
        """Return the levels of a press, or of the background (index -1)."""
        layers = self._layers.background if index < 0 else self._layers.presses[index]
        moved = layers
        for number, slopes in self._slopes.items():
            off = float(np.clip(steps[number] - self._start[number], -TRUST, TRUST))
            if off:
                moved = moved + off * slopes[index + 1]
        if contact is not None and index >= 0:
            for amount, slope in zip(contact, self._contact_slopes[index], strict=True):
                if amount:
                    moved = moved + np.float32(amount) * slope
        factors = power_factors(self._layers.groups, self._chosen, steps)
        radiance = np.tensordot(factors.astype(np.float32), moved, axes=1)
        chain = chain_with(self._layers.chain, self._chosen, steps)
        return levels_of(np.maximum(radiance, 0.0), chain, self._exposure)

    def solve(
        self,
        steps: FloatArray,
        contacts: FloatArray,
        progress: Callable[[], None] = lambda: None,
    ) -> Solution:
        """Run damped Gauss-Newton steps until the sum of squares stops falling."""
        steps, contacts, pictures, _ = self._descend(steps, contacts, progress)
        # The errors are smaller now, and so are the scales of the residuals.
        steps, contacts, pictures, scales = self._descend(steps, contacts, progress)
        matrix, _, tiles = self._normal(pictures, steps, contacts, scales)
        inverse = np.linalg.inv(matrix)
        # The first term comes from noise and priors, the second from errors correlated within
        # tiles.
        spread = np.asarray(inverse + inverse @ tiles @ inverse, dtype=np.float64)
        return Solution(
            steps,
            contacts,
            spread[: self.count, : self.count],
            self._errors(pictures),
            self._press_errors(pictures),
        )

    def _descend(
        self, steps: FloatArray, contacts: FloatArray, progress: Callable[[], None]
    ) -> tuple[FloatArray, FloatArray, list[FloatArray], tuple[float, float]]:
        """Return steps, contacts, their pictures and the scales of the residuals at the least
        cost.
        """
        pictures = self.pictures(steps, contacts)
        scales = self._scales(pictures)
        cost = self._cost(pictures, steps, contacts, scales)
        damping = 1e-3
        for _ in range(MOST_STEPS):
            progress()
            matrix, gradient, _ = self._normal(pictures, steps, contacts, scales)
            fell = False
            for _ in range(6):
                damped = matrix + damping * np.diag(np.diag(matrix))
                move = -np.linalg.solve(damped, gradient)
                move *= min(1.0, LARGEST_STEP / max(float(np.abs(move).max()), 1e-12))
                new_steps = steps + move[: self.count]
                new_contacts = contacts + move[self.count :].reshape(-1, 3) * self._contact_spread
                shown = self.pictures(new_steps, new_contacts)
                new_cost = self._cost(shown, new_steps, new_contacts, scales)
                if new_cost < cost:
                    fell = True
                    damping = max(0.3 * damping, 1e-9)
                    break
                damping = 10.0 * max(damping, 1e-6)
            if not fell:
                break
            gain = cost - new_cost
            steps, contacts, pictures, cost = new_steps, new_contacts, shown, new_cost
            if gain < SMALL_GAIN:
                break
        return steps, contacts, pictures, scales

    def _errors(self, pictures: list[FloatArray]) -> tuple[float, float]:
        ground = float(np.sqrt(((pictures[0] - self._real) ** 2).mean()))
        pressed = self._press_errors(pictures)
        return ground, float(np.sqrt((pressed**2).mean()))

    def _press_errors(self, pictures: list[FloatArray]) -> FloatArray:
        return np.array(
            [
                np.sqrt(((shown - pictures[0] - real)[mask] ** 2).mean())
                for shown, real, mask in zip(
                    pictures[1:], self._responses, self._masks, strict=True
                )
            ]
        )

    def _scales(self, pictures: list[FloatArray]) -> tuple[float, float]:
        """Return robust estimates of the error of the background and of responses, unaffected by
        dust.
        """
        ground = pictures[0] - self._real
        pressed = [
            (shown - pictures[0] - real)[mask].ravel()
            for shown, real, mask in zip(pictures[1:], self._responses, self._masks, strict=True)
        ]
        return (
            max(TO_DEVIATION * float(np.median(np.abs(ground))), LEAST_ERROR),
            max(TO_DEVIATION * float(np.median(np.abs(np.concatenate(pressed)))), LEAST_ERROR),
        )

    def _residuals(
        self, pictures: list[FloatArray], index: int, scales: tuple[float, float]
    ) -> FloatArray:
        """Return the residuals (k, 3) of the background (index -1), or of a press's pixels near its
        contact.
        """
        if index < 0:
            return ((pictures[0] - self._real) / scales[0]).reshape(-1, 3)
        error = pictures[index + 1] - pictures[0] - self._responses[index]
        return np.asarray(error[self._masks[index]] / scales[1])

    def _cost(
        self,
        pictures: list[FloatArray],
        steps: FloatArray,
        contacts: FloatArray,
        scales: tuple[float, float],
    ) -> float:
        total = float((steps**2).sum() + ((contacts / self._contact_spread) ** 2).sum())
        for index in range(-1, len(self._masks)):
            size = np.abs(self._residuals(pictures, index, scales))
            loss = np.where(size < HUBER, size**2, HUBER * (2.0 * size - HUBER))
            total += float(loss.sum()) / INDEPENDENT
        return total

    def _normal(
        self,
        pictures: list[FloatArray],
        steps: FloatArray,
        contacts: FloatArray,
        scales: tuple[float, float],
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return matrix and gradient of the normal equations, and the covariance of the tiles'
        gradients.
        """
        n, count = self.count, len(self._masks)
        size = n + 3 * count
        matrix, tiles = np.zeros((size, size)), np.zeros((size, size))
        gradient = np.zeros(size)
        moved = [self._moved(steps, contacts, k) for k in range(n)]
        for index in range(-1, count):
            residual = self._residuals(pictures, index, scales)
            columns = list(range(n))
            if not columns and index < 0:
                continue
            slopes = [(self._residuals(m, index, scales) - residual) / STEP for m in moved]
            if index >= 0:
                columns += range(n + 3 * index, n + 3 * index + 3)
                slopes += [
                    (self._residuals(m, index, scales) - residual) / STEP
                    for m in self._contact_moved(pictures, steps, contacts, index)
                ]
            jacobian = np.stack(slopes, axis=-1)  # (k, 3, columns)
            weight = np.minimum(1.0, HUBER / np.maximum(np.abs(residual), 1e-12)) / INDEPENDENT
            flat = jacobian.reshape(-1, len(columns))
            weighted = flat * weight.reshape(-1, 1)
            place = np.ix_(columns, columns)
            matrix[place] += weighted.T @ flat
            scores = (jacobian * (weight * residual)[..., None]).sum(axis=1)
            gradient[columns] += scores.sum(axis=0)
            where = self._tiles.ravel() if index < 0 else self._tiles[self._masks[index]]
            sums = np.zeros((int(self._tiles.max()) + 1, len(columns)))
            np.add.at(sums, where, scores)
            tiles[place] += sums.T @ sums
        prior = np.concatenate([steps, (contacts / self._contact_spread).ravel()])
        return matrix + np.eye(size), gradient + prior, tiles

    def _moved(self, steps: FloatArray, contacts: FloatArray, number: int) -> list[FloatArray]:
        other = steps.copy()
        other[number] += STEP
        return self.pictures(other, contacts)

    def _contact_moved(
        self, pictures: list[FloatArray], steps: FloatArray, contacts: FloatArray, index: int
    ) -> list[list[FloatArray]]:
        found = []
        for axis in range(3):
            other = contacts[index].copy()
            other[axis] += STEP * self._contact_spread[axis]
            changed = list(pictures)
            changed[index + 1] = self._shown(index, steps, other)
            found.append(changed)
        return found

"""Least squares of a fit: normal equations, slopes without their noise, and uncertainties.

Linear equations of a picture are: the indices of the n unknowns on which they depend, the
derivatives (k, 3, n) of the residuals, their weights (k, 3), the residuals (k, 3), and the mask
(h, w) of the k pixels. The background has (h, w) in place of (k), and a slice of all rows as mask.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import FloatArray
from optisense.calibration._error_scales import Pixels

LinearEquations = tuple[list[int], FloatArray, FloatArray, FloatArray, Pixels]

SIGNAL = 0.5
"""Smallest share of a slope's energy that is no noise, beyond what other numbers explain; a slope
with less of it counts as unknown. The slopes of two seeds then have a correlation below a third,
and the noise that they share with the layers could move the number more than the photographs do."""

MEDIAN_SQUARE = 0.455
"""Median of the square of a normally distributed number of variance 1 (0.6745 squared)."""


@dataclass(frozen=True)
class Solution:
    """Solution of one round of the fit.

    Attributes:
        steps: steps (n,) of the quantities, in plausible ranges from their starts.
        contacts: changes (presses, 3) of column, row (pixels) and the logarithm of the radius.
        covariance: covariance (n, n) of the steps: that of the posterior, plus that of the
            jackknife over blocks of the pictures, plus that of the changes since an earlier
            solution.
        errors: root mean square errors of the background and of the responses, levels.
        outlying: root mean square error of each press's response, levels.
    """

    steps: FloatArray
    contacts: FloatArray
    covariance: FloatArray
    errors: tuple[float, float]
    outlying: FloatArray

    def with_changes(self, changes: FloatArray) -> Solution:
        """Return the solution with the variance of the changes (n,) of its steps since an earlier
        one, whose light had other noise: it shows what noise does, and how far the fit is from its
        end.

        A single change may be small by chance. If most changes are larger than the stated
        deviations explain, all deviations are enlarged by their typical ratio (Birge 1932).
        """
        moved = changes != 0.0  # the others are at a limit
        if not moved.any():
            return self
        ratios = changes[moved] ** 2 / np.diag(self.covariance)[moved]
        scale = max(float(np.median(ratios)) / (2.0 * MEDIAN_SQUARE), 1.0)
        return replace(self, covariance=scale * self.covariance + np.diag(changes**2))

    def without_last(self) -> Solution:
        """Return the solution without its last quantity, whose uncertainty the others keep."""
        return replace(self, steps=self.steps[:-1], covariance=self.covariance[:-1, :-1])


def normal_equations(
    equations: Iterable[LinearEquations], size: int, blocks: NDArray[np.int64]
) -> tuple[FloatArray, FloatArray]:
    """Return the matrices (blocks, n, n) and gradients (blocks, n) of `size` unknowns, without
    priors, for blocks of the pictures; each pixel belongs to the block of a number (h, w).
    """
    count = int(blocks.max()) + 1
    matrices, gradients = np.zeros((count, size, size)), np.zeros((count, size))
    for unknowns, jacobian, weight, residual, mask in equations:
        inside = blocks[mask]
        for block in np.unique(inside):
            own = inside == block
            flat = jacobian[own].reshape(-1, len(unknowns))
            weighted = flat * weight[own].reshape(-1, 1)
            matrices[block][np.ix_(unknowns, unknowns)] += weighted.T @ flat
            gradients[block, unknowns] += weighted.T @ residual[own].ravel()
    return matrices, gradients


def noise_energy(
    mean: Iterable[LinearEquations], half: Iterable[LinearEquations], size: int
) -> FloatArray:
    """Return the part (n, n) of the normal matrix that is due to the noise of its derivatives, from
    the equations of the mean of two renderings and those of one of the two.
    """
    energy = np.zeros((size, size))
    for (unknowns, one, weight, _, _), (_, other, _, _, _) in zip(mean, half, strict=True):
        noise = (other - one).reshape(-1, len(unknowns))
        energy[np.ix_(unknowns, unknowns)] += (noise * weight.reshape(-1, 1)).T @ noise
    return energy


def slope_reduction(matrix: FloatArray, energy: FloatArray, noisy: list[int]) -> FloatArray:
    """Return the change (n, m) of all unknowns for each unit of the m noisy ones, which turns noisy
    slopes into the best estimates of the true ones.

    A difference of two renderings contains the noise of their light, whose square would count as
    information. The best estimate of a true slope is a noisy one times the share of its energy that
    is no noise ("regression calibration", Carroll et al. 2006). Changes that other numbers explain
    are left as they are, because noise hardly looks like them. The matrix (n, n) is the normal
    matrix with priors of unit variance, and the energy (n, n) the part of it that is due to noise.
    """
    count = len(noisy)
    others = np.setdiff1d(np.arange(len(matrix)), noisy)
    found = np.zeros((len(matrix), count))
    across = matrix[others][:, noisy]
    found[others] = np.linalg.solve(matrix[np.ix_(others, others)], across)
    rest = -found
    rest[noisy] = np.eye(count)
    alone = rest.T @ (matrix - np.eye(len(matrix))) @ rest
    sizes, axes = np.linalg.eigh(alone)
    roots = np.sqrt(np.maximum(sizes, 1e-12 * max(float(sizes.max()), 1e-12)))
    white = (axes / roots) @ axes.T
    shares, axes_of_noise = np.linalg.eigh(np.eye(count) - white @ (rest.T @ energy @ rest) @ white)
    shares = np.where(shares < SIGNAL, 0.0, shares)
    true = white @ (axes_of_noise * shares) @ axes_of_noise.T @ (axes * roots) @ axes.T
    lost = np.eye(count) - true
    found[others] = found[others] @ lost
    found[noisy] = -lost
    return found


def jackknife_covariance(matrices: FloatArray, scores: FloatArray) -> FloatArray:
    """Return the covariance (n, n) of the unknowns of a least-squares fit with priors, from the
    normal matrix (n, n) and the gradient (n,) of each cluster at the solution.

    The fit is repeated without each of the clusters, in one step, and the unknowns scatter. Errors
    may be correlated within clusters, but not between them. Residuals are smaller than errors where
    a cluster dominates the fit; the jackknife takes this into account (Bell and McCaffrey 2002,
    estimator CR3). The covariance of the posterior is added: it contains the priors, and is a lower
    limit where the scatter of a few clusters is small by chance.
    """
    count, size = scores.shape
    total = matrices.sum(axis=0) + np.eye(size)
    changes = np.linalg.solve(total - matrices, scores[..., None])[..., 0]
    return np.asarray((count - 1) / count * changes.T @ changes + np.linalg.inv(total))

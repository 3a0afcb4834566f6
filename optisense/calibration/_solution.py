"""Solution of one round of a fit, and the uncertainty of its numbers."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from optisense.array_types import FloatArray

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


def jackknife_covariance(matrices: FloatArray, scores: FloatArray) -> FloatArray:
    """Return the covariance (n, n) of the unknowns of a least-squares fit with priors.

    The fit is repeated without each of the clusters, in one step, and the unknowns scatter. Errors
    may be correlated within clusters, but not between them. Residuals are smaller than errors where
    a cluster dominates the fit; the jackknife takes this into account (Bell and McCaffrey 2002,
    estimator CR3). The covariance of the posterior is added: it contains the priors, and is a lower
    limit where the scatter of a few clusters is small by chance.

    Args:
        matrices: (clusters, n, n) normal matrix of each cluster; the priors add a unit matrix.
        scores: (clusters, n) gradient of each cluster at the solution.
    """
    count, size = scores.shape
    total = matrices.sum(axis=0) + np.eye(size)
    changes = np.linalg.solve(total - matrices, scores[..., None])[..., 0]
    return np.asarray((count - 1) / count * changes.T @ changes + np.linalg.inv(total))

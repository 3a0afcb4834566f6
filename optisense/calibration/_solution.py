"""Solution of one round of a fit, and the uncertainty of its numbers."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

MEDIAN_SQUARE = 0.455
"""Median of the square of a normally distributed number of variance 1 (0.6745 squared)."""


@dataclass(frozen=True)
class Solution:
    """Solution of one round of the fit.

    Attributes:
        steps: steps (n,) of the quantities, in plausible ranges from their starts.
        contacts: changes (presses, 3) of column and row, pixels, and of the logarithm of the
            radius.
        covariance: covariance (n, n) of the steps: that of the posterior, plus that of errors which
            are correlated within tiles, plus that of the changes since an earlier solution.
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

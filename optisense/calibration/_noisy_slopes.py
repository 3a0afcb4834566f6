"""Slopes of pictures without the part of them that is noise.

A difference of two renderings contains the noise of their light. Its square would count as
information, like that of a true slope: the number would stay near its start, with a small
uncertainty. The best estimate of a true slope is a noisy one times the share of its energy that is
no noise ("regression calibration", Carroll et al. 2006). Changes that other numbers explain are
left as they are, because noise hardly looks like them: only the rest of the slope is reduced.
"""

from __future__ import annotations

import numpy as np

from optisense.array_types import FloatArray

SIGNAL = 0.5
"""Smallest share of a slope's energy that is no noise, beyond what other numbers explain; a slope
with less of it counts as unknown. The slopes of two seeds then have a correlation below a third,
and the noise that they share with the layers could move the number more than the photographs do."""


def slope_reduction(matrix: FloatArray, energy: FloatArray, noisy: list[int]) -> FloatArray:
    """Return the change (n, m) of all unknowns for each unit of the noisy ones, which turns noisy
    slopes into the best estimates of the true ones.

    Without any noise it is 0. For slopes of noise alone, it undoes the change of the number, and
    leaves only what other numbers can do as well.

    Args:
        matrix: (n, n) normal matrix of the slopes, with priors of unit variance.
        energy: (n, n) the part of it that is due to noise.
        noisy: indices of the m unknowns with noisy slopes.
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

"""Sums of the linear equations of pictures: normal matrices, gradients, and the energy of noise.

Linear equations of a picture are: the indices of the n unknowns on which they depend, the
derivatives (k, 3, n) of the residuals, their weights (k, 3), the residuals (k, 3), and the mask
(h, w) of the k pixels.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import FloatArray

LinearEquations = tuple[list[int], FloatArray, FloatArray, FloatArray, NDArray[np.bool_]]


def normal_equations(
    equations: Iterable[LinearEquations], size: int, blocks: NDArray[np.int64]
) -> tuple[FloatArray, FloatArray]:
    """Return matrices (blocks, n, n) and gradients (blocks, n) of blocks of the pictures, without
    priors.

    Args:
        size: number of all unknowns, n.
        blocks: number (h, w) of the block to which each pixel belongs.
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
    """Return the part (n, n) of the normal matrix that is due to the noise of its derivatives.

    Args:
        mean: equations whose derivatives are those of the mean of two renderings.
        half: equations of one of the two.
        size: number of all unknowns, n.
    """
    energy = np.zeros((size, size))
    for (unknowns, one, weight, _, _), (_, other, _, _, _) in zip(mean, half, strict=True):
        noise = (other - one).reshape(-1, len(unknowns))
        energy[np.ix_(unknowns, unknowns)] += (noise * weight.reshape(-1, 1)).T @ noise
    return energy

"""The model-free signal-to-noise ratio of the OptiSense paper (section "Signal-to-noise ratio").

    SNR = sigma^2_global / E[sigma^2_local]

The global variance is that of the target over all samples; the local variance is that among the
nearest neighbours of a sample in feature space. If the features determine the target, neighbours
have similar targets and the ratio is large; if they do not, neighbours differ as much as any
samples and the ratio is 1.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.neighbors import NearestNeighbors

from optisense.errors import TaskError

NEIGHBOURS = 5
"""Number k of nearest neighbours: scikit-learn's default, as the OptiSense paper states none."""


def signal_to_noise(features: ArrayLike, targets: ArrayLike, neighbours: int = NEIGHBOURS) -> float:
    """Return the ratio of the targets' variance to their mean variance among neighbours.

    Several targets are added up in both variances, so they should share a unit. Neighbours are the
    `neighbours` other samples at the smallest Euclidean distance in feature space; features are not
    normalised (camera levels share a unit and a noise level), and both variances are unbiased
    (divided by the number minus one). Noise of variance s^2 on a target that is otherwise a smooth
    function of densely sampled features gives 1 + signal variance / s^2.

    Args:
        features: (n, f) features, or (n,) for one.
        targets: (n, t) targets, or (n,) for one.
        neighbours: number k of neighbours, at least 2 and less than n.

    Returns:
        The ratio; infinite if neighbours agree exactly.

    Raises:
        TaskError: too few samples for k, numbers of samples that differ, or a not finite number.
    """
    x, y = _columns(features), _columns(targets)
    if len(x) != len(y):
        raise TaskError(f"there are {len(x)} samples of features but {len(y)} of targets")
    if neighbours < 2:
        raise TaskError(f"{neighbours} neighbours have no variance", hint="Use 2 or more")
    if len(x) <= neighbours:
        raise TaskError(
            f"{len(x)} samples are too few for {neighbours} neighbours",
            hint="Make more samples or use fewer neighbours",
        )
    if not (np.isfinite(x).all() and np.isfinite(y).all()):
        raise TaskError("a feature or a target is not a finite number")
    whole = y.var(axis=0, ddof=1).sum()
    # In a search among the fitted samples, a sample is not its own neighbour.
    near = NearestNeighbors(n_neighbors=neighbours).fit(x).kneighbors(return_distance=False)
    local = y[near].var(axis=1, ddof=1).sum(axis=1).mean()
    with np.errstate(divide="ignore", invalid="ignore"):
        return float(np.divide(whole, local))


def _columns(values: ArrayLike) -> NDArray[np.float64]:
    array = np.asarray(values, dtype=np.float64)
    return array.reshape(len(array), -1)

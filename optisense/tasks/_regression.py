"""Cross-validated accuracy of a random forest that reads a quantity from features."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from sklearn.ensemble import RandomForestRegressor
from sklearn.model_selection import KFold

from optisense.array_types import FloatArray
from optisense.errors import TaskError

TREES = 100
"""Number of trees of a forest: scikit-learn's default, as the OptiSense paper states none."""
FOLDS = 5
"""Number of folds of the cross-validation, which is scikit-learn's default."""


@dataclass(frozen=True)
class ForestReading:
    """Cross-validated predictions of a random forest.

    Attributes:
        predictions: (n, t) predicted targets.
        error: mean absolute error over samples and targets.
        spread: standard deviation of the error among folds.
        guess: mean absolute error of the baseline that predicts the mean of the fitted targets.
    """

    predictions: FloatArray
    error: float
    spread: float
    guess: float


def read_by_forest(features: FloatArray, targets: FloatArray, seed: int = 0) -> ForestReading:
    """Cross-validate a random forest regression.

    The samples are shuffled into FOLDS folds. Forests have TREES full-grown trees with bootstrap
    and all features at each split (scikit-learn's defaults). The OptiSense paper names the model
    and the mean absolute error, but neither the number of trees nor the folds.

    Args:
        features: (n, f) features.
        targets: (n, t) targets, all of one unit.

    Raises:
        TaskError: there are fewer than two samples per fold.
    """
    count = len(features)
    if count < 2 * FOLDS:
        raise TaskError(
            f"{count} samples are too few to cross-validate", hint=f"Make at least {2 * FOLDS}"
        )
    predictions = np.empty_like(targets)
    errors, guesses = [], []
    for fitted, held_out in KFold(FOLDS, shuffle=True, random_state=seed).split(features):
        forest = RandomForestRegressor(n_estimators=TREES, random_state=seed)
        # scikit-learn expects a vector for one target and a matrix for several.
        known = targets[fitted] if targets.shape[1] > 1 else targets[fitted, 0]
        forest.fit(features[fitted], known)
        predictions[held_out] = forest.predict(features[held_out]).reshape(len(held_out), -1)
        errors.append(np.abs(predictions[held_out] - targets[held_out]).mean())
        guesses.append(np.abs(targets[fitted].mean(axis=0) - targets[held_out]).mean())
    return ForestReading(
        predictions=predictions,
        error=float(np.abs(predictions - targets).mean()),
        spread=float(np.std(errors, ddof=1)),
        guess=float(np.mean(guesses)),
    )

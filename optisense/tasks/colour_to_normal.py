"""Readers of the surface's tilt from colours: the table and the network that users fit to real
sensors, fitted here to simulated ball presses.

Both map the difference of a picture from that of the untouched sensor to the *tilt*: the two
components of the unit normal along the tangents of the untouched surface (the sines of the slopes).
They are 0 where nothing touches, on curved sensors too.
"""

from __future__ import annotations

import warnings
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from sklearn.exceptions import ConvergenceWarning
from sklearn.neural_network import MLPRegressor
from sklearn.pipeline import Pipeline, make_pipeline
from sklearn.preprocessing import StandardScaler

from optisense.errors import TaskError

FloatArray = NDArray[np.float64]

BIN = 4.0
"""Levels of 255, the width of a bin of the table."""

LAYERS = (32, 32)
"""Neurons of the network's hidden layers. Larger networks learned the presses by heart: in trials
on presses kept aside they read worse."""

EPOCHS = 30
"""Number of passes over the samples in the fit of the network, which ends there by intent: more of
them learn the presses by heart."""
WEIGHT_PENALTY = 0.03
"""Weight of the squared weights in the loss of the network (scikit-learn's `alpha`), for the same
reason."""

METHODS = ("network", "table")


class TiltReader(Protocol):
    """Reads tilts from colours."""

    def tilts(self, colours: FloatArray, places: FloatArray) -> FloatArray:
        """Tilts (n, 2) of colour differences (n, 3), levels of 255, at places (n, 2) in the picture
        (-1 to 1 across its width and height).
        """
        ...


class ColourTable:
    """The lookup table of Yuan, Dong and Adelson ("GelSight: high-resolution robot tactile sensors
    for estimating geometry and force", Sensors 2017): one tilt for each colour, wherever it is.

    Colours fall in bins of BIN levels; a colour whose bin is empty takes the nearest filled one.
    """

    def __init__(self, colours: FloatArray, places: FloatArray, tilts: FloatArray) -> None:
        """Args: as `TiltReader.tilts`, and the tilts (n, 2) known there."""
        bins, which = np.unique(np.round(colours / BIN), axis=0, return_inverse=True)
        which = which.reshape(-1)
        count = np.bincount(which)
        self._tree = cKDTree(bins)
        self._tilts = np.stack([np.bincount(which, column) / count for column in tilts.T], axis=1)

    def tilts(self, colours: FloatArray, places: FloatArray) -> FloatArray:
        """See `TiltReader`; the places are not read."""
        return self._tilts[self._tree.query(colours / BIN)[1]]


class ColourNetwork:
    """A small network that reads colour and place, as current GelSight software does.

    Standardised inputs, two layers of 32 rectified neurons, Adam for EPOCHS epochs, and a penalty
    on large weights.
    """

    def __init__(
        self, colours: FloatArray, places: FloatArray, tilts: FloatArray, seed: int = 0
    ) -> None:
        """Args: as `TiltReader.tilts`, the tilts (n, 2) known there, and a seed."""
        network = MLPRegressor(
            hidden_layer_sizes=LAYERS,
            alpha=WEIGHT_PENALTY,
            batch_size=min(256, len(colours)),
            learning_rate_init=5e-3,
            max_iter=EPOCHS,
            random_state=seed,
        )
        self._network: Pipeline = make_pipeline(StandardScaler(), network)
        with warnings.catch_warnings():
            # It is meant to stop after so many epochs.
            warnings.simplefilter("ignore", ConvergenceWarning)
            self._network.fit(np.hstack([colours, places]), tilts)

    def tilts(self, colours: FloatArray, places: FloatArray) -> FloatArray:
        """See `TiltReader`."""
        read: FloatArray = self._network.predict(np.hstack([colours, places]))
        return read


def fit_reader(
    method: str, colours: FloatArray, places: FloatArray, tilts: FloatArray, seed: int = 0
) -> TiltReader:
    """Fit one of METHODS.

    Raises:
        TaskError: there is no such method.
    """
    if method == "table":
        return ColourTable(colours, places, tilts)
    if method == "network":
        return ColourNetwork(colours, places, tilts, seed)
    raise TaskError(f"there is no method '{method}'", hint="Use one of " + ", ".join(METHODS))

"""Readers of the surface's tilt from colours: the lookup table and the network that are used with
real sensors, fitted to simulated ball presses.

Both map the difference of a picture from that of the untouched sensor to the *tilt*: the two
components of the unit normal along the tangents of the untouched surface (the sines of the slopes).
They are 0 where nothing touches, also on curved sensors.
"""

from __future__ import annotations

import warnings
from typing import Protocol

import numpy as np
from scipy.spatial import cKDTree
from sklearn.exceptions import ConvergenceWarning
from sklearn.neural_network import MLPRegressor
from sklearn.pipeline import Pipeline, make_pipeline
from sklearn.preprocessing import StandardScaler

from optisense.array_types import FloatArray

BIN = 4.0
"""Width of a bin of the table, levels of 255: a few times the noise of the camera (1 to 2 levels),
so that noise moves a colour by at most one bin.
"""

LAYERS = (32, 32)
"""Numbers of neurons of the network's hidden layers. Larger networks overfit: their errors on
held-out presses were larger."""

BATCH = 256
"""Largest number of samples of a step of the optimiser."""

STEPS = 2400
"""Number of steps of the optimiser in the fit of the network: 30 passes over 20,000 samples, after
which more passes overfit. With fewer samples and as many passes, the network would underfit."""

MOST_EPOCHS = 200
"""Largest number of passes over few samples; more do nothing with 20 balls, overfit with 10."""

WEIGHT_PENALTY = 0.03
"""Weight of the squared weights in the loss of the network (scikit-learn's `alpha`), which also
limits overfitting."""


class TiltReader(Protocol):
    """A reader of tilts from colours."""

    def tilts(self, colours: FloatArray, places: FloatArray) -> FloatArray:
        """Return the tilts (n, 2) of colour differences (n, 3), levels of 255, at places (n, 2) in
        the picture (-1 to 1 across its width and height).
        """
        ...


class ColourTable:
    """The lookup table of Yuan, Dong and Adelson ("GelSight: high-resolution robot tactile sensors
    for estimating geometry and force", Sensors 2017): one tilt for each colour, regardless of its
    place.

    Colours fall in bins of BIN levels; a colour whose bin is empty uses the nearest filled bin.
    """

    def __init__(
        self, colours: FloatArray, places: FloatArray, tilts: FloatArray, seed: int = 0
    ) -> None:
        """Fit the table as `fit_reader` does; the places and the seed have no effect."""
        bins, which = np.unique(np.round(colours / BIN), axis=0, return_inverse=True)
        which = which.reshape(-1)
        count = np.bincount(which)
        self._tree = cKDTree(bins)
        self._tilts = np.stack([np.bincount(which, column) / count for column in tilts.T], axis=1)

    def tilts(self, colours: FloatArray, places: FloatArray) -> FloatArray:
        """Return the tilts (n, 2); see `TiltReader.tilts`."""
        return self._tilts[self._tree.query(colours / BIN)[1]]


class ColourNetwork:
    """A small network with colour and place as inputs, as in current GelSight software.

    Standardised inputs, two layers of 32 rectified neurons, Adam for STEPS steps and at most
    MOST_EPOCHS epochs, and a penalty on large weights.
    """

    def __init__(
        self, colours: FloatArray, places: FloatArray, tilts: FloatArray, seed: int = 0
    ) -> None:
        """Fit the network as `fit_reader` does."""
        batch = min(BATCH, len(colours))
        epochs = min(MOST_EPOCHS, round(STEPS * batch / len(colours)))
        network = MLPRegressor(
            hidden_layer_sizes=LAYERS,
            alpha=WEIGHT_PENALTY,
            batch_size=batch,
            learning_rate_init=5e-3,
            max_iter=epochs,
            n_iter_no_change=epochs,
            random_state=seed,
        )
        self._network: Pipeline = make_pipeline(StandardScaler(), network)
        with warnings.catch_warnings():
            # Stopping after this number of epochs is intended.
            warnings.simplefilter("ignore", ConvergenceWarning)
            self._network.fit(np.hstack([colours, places]), tilts)

    def tilts(self, colours: FloatArray, places: FloatArray) -> FloatArray:
        """Return the tilts (n, 2); see `TiltReader.tilts`."""
        read: FloatArray = self._network.predict(np.hstack([colours, places]))
        return read


METHODS: dict[str, type[ColourNetwork | ColourTable]] = {
    "network": ColourNetwork,
    "table": ColourTable,
}
"""Kinds of readers by the name of their method."""


def fit_reader(
    method: str, colours: FloatArray, places: FloatArray, tilts: FloatArray, seed: int = 0
) -> TiltReader:
    """Fit a reader by one of METHODS.

    Args:
        colours: colour differences (n, 3), levels of 255.
        places: places (n, 2) in the picture, -1 to 1 across its width and height.
        tilts: known tilts (n, 2).
    """
    return METHODS[method](colours, places, tilts, seed)

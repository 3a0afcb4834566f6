"""Renderings of a calibration that are kept in its folder until it has ended."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from optisense.design import SensorDesign
from optisense.design.difference import fingerprint
from optisense.geometry import Contact
from optisense.kept_arrays import KeptArrays

FOLDER = "renderings"
"""Subfolder of a calibration in which the renderings are kept while it runs."""

FloatArray = NDArray[np.float32]


class KeptRenderings(KeptArrays):
    """Store of layers of pictures in a folder, or a dummy that stores nothing."""

    def __init__(self, folder: str | Path | None = None) -> None:
        """Set the folder.

        Args:
            folder: folder of the calibration, whose lock is held; None keeps nothing.
        """
        super().__init__(None if folder is None else Path(folder) / FOLDER)

    def layers(
        self,
        design: SensorDesign,
        contacts: Sequence[Contact],
        settings: Sequence[object],
        render: Callable[[], dict[str, FloatArray]],
    ) -> dict[str, FloatArray]:
        """Return layers (h, w, 3) by light group: stored ones, or else new ones, which are stored.

        Args:
            contacts: contacts to press into it.
            settings: all other inputs of the picture.

        Raises:
            OutputError: the layers can't be written.
        """
        inputs = [fingerprint(design), *contacts, *settings]
        return self.arrays(inputs, render, list(design.lights))


KEPT_NOWHERE = KeptRenderings()
"""Store of calibrations without a folder, which repeat every rendering."""

"""Renderings of a calibration that are kept in its folder until it has ended.

A calibration that was interrupted or killed finds them again when the same command is run: each is
stored under a hash of all its inputs, so that one of another design, of other photographs or of
another release is never used for it.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from optisense.design import SensorDesign
from optisense.design.difference import fingerprint
from optisense.errors import CalibrationError
from optisense.geometry import Contact
from optisense.untrusted_arrays import read_arrays
from optisense.version import __version__
from optisense.writing import written_whole

FOLDER = "renderings"
"""Subfolder of a calibration in which the renderings are kept while it runs."""

MOST_BYTES = 1 << 30
"""Largest size of one rendering's layers, bytes; those of 320 x 240 pixels have a few million."""

FloatArray = NDArray[np.float32]


class KeptRenderings:
    """Store of layers of pictures in a folder, or a dummy that stores nothing."""

    def __init__(self, folder: str | Path | None = None) -> None:
        """Set the folder.

        Args:
            folder: folder of the calibration, whose lock is held; None keeps nothing.
        """
        self._folder = None if folder is None else Path(folder) / FOLDER

    def layers(
        self,
        design: SensorDesign,
        contacts: Sequence[Contact],
        settings: Sequence[object],
        render: Callable[[], dict[str, FloatArray]],
    ) -> dict[str, FloatArray]:
        """Return layers (h, w, 3) by light group: stored ones, or else new ones, which are stored.

        Args:
            design: design to render.
            contacts: contacts to press into it.
            settings: all other inputs of the picture.
            render: function that makes the layers.

        Raises:
            OutputError: the layers can't be written.
        """
        if self._folder is None:
            return render()
        pressed = [asdict(contact) for contact in contacts]
        said = json.dumps([__version__, fingerprint(design), pressed, *settings], default=str)
        path = self._folder / f"{hashlib.sha256(said.encode()).hexdigest()[:32]}.npz"
        if path.is_file():
            with contextlib.suppress(CalibrationError):  # a damaged one is made again
                found = read_arrays(path, CalibrationError, MOST_BYTES)
                if list(found) == list(design.lights):
                    return found
        layers = render()
        with written_whole(path, "the rendering") as temporary, temporary.open("wb") as file:
            np.savez(file, allow_pickle=False, **layers)
        return layers

    def remove(self) -> None:
        """Remove all stored renderings, and their folder."""
        if self._folder is None:
            return
        with contextlib.suppress(OSError):
            for path in self._folder.glob("*.npz"):
                path.unlink()
            self._folder.rmdir()


KEPT_NOWHERE = KeptRenderings()
"""Store of calibrations without a folder, which repeat every rendering."""

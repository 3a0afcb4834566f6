"""Intermediate results of a long command, kept in its folder until the command has ended.

A command that was interrupted or killed finds them again when it is run once more: each is stored
under a hash of all its inputs, so that one of another design, of other settings or of another
release is never used for it.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
from collections.abc import Callable, Collection, Sequence
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optisense.errors import OptiSenseError
from optisense.untrusted_arrays import read_arrays
from optisense.version import __version__
from optisense.writing import written_whole

MOST_BYTES = 1 << 30
"""Largest size of the arrays of one result, bytes; the layers of a picture of 320 x 240 pixels have
a few million."""


class KeptArrays:
    """Store of arrays in a folder, or a dummy that stores nothing."""

    def __init__(self, folder: Path | None = None) -> None:
        """Set the folder; None stores nothing.

        Args:
            folder: folder of the arrays alone, made when needed, in a folder whose lock is held.
        """
        self._folder = folder

    def arrays(
        self,
        inputs: Sequence[object],
        make: Callable[[], dict[str, NDArray[Any]]],
        names: Collection[str],
    ) -> dict[str, NDArray[Any]]:
        """Return arrays by name: stored ones, or else new ones, which are stored.

        Args:
            inputs: all values that determine the arrays: numbers, texts, paths, arrays, and
                sequences, dictionaries and dataclasses of these.
            names: names that stored arrays must have, in their order.

        Raises:
            OutputError: the arrays can't be written.
        """
        if self._folder is None:
            return make()
        text = json.dumps([__version__, *inputs], default=_in_text)
        path = self._folder / f"{hashlib.sha256(text.encode()).hexdigest()[:32]}.npz"
        if path.is_file():
            with contextlib.suppress(OptiSenseError):  # damaged arrays are made again
                found = read_arrays(path, OptiSenseError, MOST_BYTES)
                if list(found) == list(names):
                    return found
        made = make()
        with written_whole(path, "the arrays") as temporary, temporary.open("wb") as file:
            np.savez(file, allow_pickle=False, **made)
        return made

    def remove(self) -> None:
        """Remove all stored arrays, and their folder."""
        if self._folder is None:
            return
        with contextlib.suppress(OSError):
            for path in self._folder.glob("*.npz"):
                path.unlink()
            self._folder.rmdir()


NOTHING_KEPT = KeptArrays()
"""Store of commands without a folder, which repeat all work."""


def _in_text(value: object) -> object:
    """Return a value that JSON does not know as one that it knows."""
    if isinstance(value, np.ndarray):
        return [str(value.dtype), value.shape, hashlib.sha256(value.tobytes()).hexdigest()]
    if isinstance(value, np.generic):
        return value.item()
    if is_dataclass(value):
        return [
            type(value).__name__,
            {each.name: getattr(value, each.name) for each in fields(value)},
        ]
    if isinstance(value, Path):
        return str(value)
    raise TypeError(f"{type(value).__name__} can't identify a stored result")

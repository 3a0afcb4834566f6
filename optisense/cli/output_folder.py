"""The folder that a command writes into."""

from __future__ import annotations

import tempfile
from pathlib import Path

from optisense.errors import OutputError


def ensure_writable(folder: Path) -> None:
    """Make the folder if need be, and try whether a file can be written into it.

    Raises:
        OutputError: it can't, found out before the work instead of after it.
    """
    if folder.exists() and not folder.is_dir():
        raise OutputError(
            "the output folder is a file", where=str(folder), hint="Name a folder after --out"
        )
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder) as trial:
            trial.write(bytes(4096))
            trial.flush()
    except OSError as error:
        raise OutputError(
            f"the output folder can't be written: {error.strerror or error}",
            where=str(folder),
            hint="Choose another folder after --out, or free space on this disk",
        ) from error

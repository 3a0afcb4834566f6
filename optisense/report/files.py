"""Templates to read and pages to write."""

from __future__ import annotations

import os
import tempfile
from importlib.resources import files
from pathlib import Path

from optisense.errors import OutputError


def template(name: str) -> str:
    """A file of the package's templates as text."""
    return (files("optisense.report") / "templates" / name).read_text(encoding="utf-8")


def write_whole(path: Path, text: str) -> None:
    """Write to a temporary file beside the wanted one, then rename it.

    Raises:
        OutputError: it can't be written; nothing is left behind.
    """
    try:
        handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
        try:
            with os.fdopen(handle, "w", encoding="utf-8") as file:
                file.write(text)
            Path(temporary).chmod(0o644)
            Path(temporary).replace(path)
        except BaseException:
            Path(temporary).unlink(missing_ok=True)
            raise
    except OSError as error:
        raise OutputError(
            f"the file can't be written: {error.strerror or error}",
            where=str(path),
            hint="Free space on this disk or choose another folder",
        ) from error

"""Folder that a command writes into."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable
from pathlib import Path

from optisense.cli.console import on_exit
from optisense.earlier_results import refuse_to_replace
from optisense.errors import OutputError
from optisense.folders import hold
from optisense.writing import remedy


def take_folder(
    folder: Path, files: Iterable[str] = (), mark: tuple[str, str] | None = None
) -> None:
    """Create the folder if needed, and hold its lock against other processes until the command
    ends.

    Args:
        files, mark: files that the command writes, and the mark of its earlier results; see
            `refuse_to_replace`. Without a mark, nothing is refused.

    Raises:
        FolderInUseError: another process is writing to the folder.
        OutputError: the folder can't be written, or files of the user are in it; raised before the
            work begins.
    """
    if mark is not None:
        refuse_to_replace(folder, files, mark)
    on_exit(hold(folder))


def ensure_writable(folder: Path) -> None:
    """Create the folder if needed, and check that a file can be written into it.

    This is for single pages written into folders that another process may use, such as that of a
    running study.

    Raises:
        OutputError: the folder can't be created or written; raised before the work begins.
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
            hint=remedy(error, "Choose another folder after --out"),
        ) from error

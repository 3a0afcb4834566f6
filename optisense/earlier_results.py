"""Folders of earlier results, whose files may be replaced, and files of the user, which may not."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterable
from pathlib import Path

from optisense.errors import OutputError

DESIGN = "design.yaml"
"""File by which the folder of a design is recognised."""

MOST_OF_MARK = 1 << 24
"""Largest number of bytes of a file in which the mark of earlier results is searched; the largest
tables of scores have a tenth of it.
"""


def holds_earlier_results(folder: str | Path, mark: tuple[str, str]) -> bool:
    """Return whether a folder holds earlier results of a command.

    Args:
        folder: folder of the results; it need not exist.
        mark: a file of the results (one of those that match, if it has a `*`) and a text in it, by
            which they are recognised.
    """
    file, text = mark
    with contextlib.suppress(OSError):
        for place in Path(folder).glob(file):
            with contextlib.suppress(OSError), place.open("rb") as opened:
                if text.encode() in opened.read(MOST_OF_MARK):
                    return True
    return False


def refuse_to_replace(folder: str | Path, files: Iterable[str], mark: tuple[str, str]) -> None:
    """Refuse to write results into the folder of a design, or over files of the user.

    Args:
        folder: folder of the results; it need not exist.
        files: files that will be written, relative to the folder.
        mark: see `holds_earlier_results`; if the folder does, its files may be replaced.

    Raises:
        OutputError: the folder holds a design, or one of the files exists and is not of such
            results.
    """
    place = Path(folder)
    if (place / DESIGN).exists():
        raise OutputError(
            "this is the folder of a design", where=str(folder), hint="Name another one after --out"
        )
    if holds_earlier_results(folder, mark):
        return
    for name in files:
        if os.path.lexists(place / name):
            raise OutputError(
                "the file exists already, and is not of earlier results of this command",
                where=str(place / name),
                hint="Name another folder after --out, or remove the file",
            )

"""Errors of a study's store: those of SQLite, and unexpected content."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from optisense.errors import OptiSenseError, OutputError, SearchError

REMEDIES = {
    "disk I/O error": "The disk is full, was disconnected or fails: free space on it and check it",
    "unable to open": "Check that the file may be read, and its folder be written to for a search",
    "readonly": "Copy the study to a folder that may be written to",
    "locked": "End the other program that has the file open",
    "Permission denied": "Ask its owner for the right to read it",
}
"""Hints for other errors of SQLite, by words in their message."""


def damaged(what: str, path: Path | None, why: str) -> SearchError:
    """Return the error for a store with unexpected content."""
    return SearchError(
        f"{what} can't be read: {why}",
        where=None if path is None else str(path),
        hint="The file is damaged: use a copy of it, or begin a new study",
    )


@contextmanager
def translated_errors(path: Path | None) -> Iterator[None]:
    """Turn errors of SQLite and of the file system into errors of this package."""
    try:
        yield
    except (sqlite3.Error, OSError, MemoryError, UnicodeDecodeError) as error:
        raise _error(error, path) from error


def _error(error: Exception, path: Path | None) -> OptiSenseError:
    where = None if path is None else str(path)
    text = str(error)
    if isinstance(error, MemoryError | UnicodeDecodeError):
        # SQLite also reports pages with impossible content like this.
        return damaged("the study's store", path, text or "its pages have no valid content")
    if "full" in text:
        return OutputError("the disk is full", where=where, hint="Free some space on it")
    if any(sign in text for sign in ("not a database", "malformed", "no such table")):
        return SearchError(
            f"this is not a study's store, or it is damaged: {text}",
            where=where,
            hint="Use a copy of it, or begin a new study",
        )
    hint = next((hint for sign, hint in REMEDIES.items() if sign in text), None)
    return OutputError(f"the store can't be used: {text}", where=where, hint=hint)

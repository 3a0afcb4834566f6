"""Which Python files of a study may be run: those that this user has named on this machine.

A study's folder may come from a stranger, and its `study.json` names the Python files of its
objectives and rules. Such a file is run only if the user has named it: when the study was begun,
by naming it again, or by saying that the study is trusted. What was named is noted outside the
study, in `optisense/trusted-files.txt` of the user's state folder ($XDG_STATE_HOME, or
~/.local/state): FILE:FUNCTION and the SHA-256 of the file, so that an edited file is a new one.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from optisense.errors import SearchError
from optisense.untrusted_files import MOST_PROGRAM, read_bytes


def file_of(reference: str) -> Path | None:
    """The Python file of an objective or rule as a study names it; None for other names."""
    path = reference.rpartition(":")[0] if not reference.endswith(".py") else reference
    return Path(path) if path.endswith(".py") else None


def not_trusted(references: Iterable[str]) -> list[str]:
    """Those that name a Python file that the user has not named yet, or not as it is now."""
    try:
        known = set(_notes().read_text(encoding="utf-8").splitlines())
    except (OSError, ValueError):
        known = set()
    return [each for each in references if file_of(each) and _note(each) not in known]


def trust(references: Iterable[str]) -> None:
    """Note that the user has named these files.

    Where nothing can be noted, the user is asked again another time.
    """
    lines = [_note(each) + "\n" for each in not_trusted(references)]
    if not lines:
        return
    with suppress(OSError):
        _notes().parent.mkdir(parents=True, exist_ok=True)
        with _notes().open("a", encoding="utf-8") as file:
            file.write("".join(lines))


def _note(reference: str) -> str:
    """A line: the print of the file as it is now, and the reference without line breaks."""
    file = file_of(reference)
    try:
        content = b"" if file is None else read_bytes(file, MOST_PROGRAM, SearchError)
    except SearchError:
        content = b""
    return f"{hashlib.sha256(content).hexdigest()} {reference!r}"


def _notes() -> Path:
    state = os.environ.get("XDG_STATE_HOME")
    base = Path(state) if state else Path.home() / ".local" / "state"
    return base / "optisense" / "trusted-files.txt"

"""Trust in the Python files of a study: only files that this user has named on this machine are
run.

A study's folder may come from a stranger, and its `study.json` names the Python files of its
objectives and rules. Such a file is run only if the user has named it: when the study was begun, by
naming it again, or by confirming that the study is trusted. Trusted files are recorded outside the
study, in `optisense/trusted-files.txt` of the user's state folder ($XDG_STATE_HOME, or
~/.local/state), as FILE:FUNCTION and the SHA-256 of the file, so that an edited file is a new one.
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
    """Return the Python file of an objective or rule in a study, or None for other names."""
    path = reference.rpartition(":")[0] if not reference.endswith(".py") else reference
    return Path(path) if path.endswith(".py") else None


def not_trusted(references: Iterable[str]) -> list[str]:
    """Return the references to Python files not named by the user in their present content."""
    try:
        known = set(_notes().read_text(encoding="utf-8").splitlines())
    except (OSError, ValueError):
        known = set()
    return [each for each in references if file_of(each) and _note(each) not in known]


def trust(references: Iterable[str]) -> None:
    """Record that the user has named these files.

    If the record can't be written, the user is asked again the next time.
    """
    lines = [_note(each) + "\n" for each in not_trusted(references)]
    if not lines:
        return
    with suppress(OSError):
        _notes().parent.mkdir(parents=True, exist_ok=True)
        with _notes().open("a", encoding="utf-8") as file:
            file.write("".join(lines))


def _note(reference: str) -> str:
    """Return a line with the hash of the file's present content, and the reference in one line."""
    file = file_of(reference)
    try:
        found = "" if file is None else _sha256(file)
    except SearchError:
        found = ""
    return f"{found} {reference!r}"


def file_prints(references: Iterable[str]) -> dict[str, str]:
    """Return the SHA-256 of each user's Python file that is named, by its path."""
    files = filter(None, map(file_of, references))
    return {str(file): _sha256(file) for file in files if file.is_file()}


def _sha256(file: Path) -> str:
    return hashlib.sha256(read_bytes(file, MOST_PROGRAM, SearchError)).hexdigest()


def _notes() -> Path:
    state = os.environ.get("XDG_STATE_HOME")
    base = Path(state) if state else Path.home() / ".local" / "state"
    return base / "optisense" / "trusted-files.txt"

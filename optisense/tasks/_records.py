"""Folders that grow sample by sample and stay valid if the process is killed at any moment.

Three rules ensure this: one process at a time writes to a folder (see `optisense.folders`), a file
is written under a temporary name and renamed when it is complete, and a sample exists once its row
does, which is written last. `generation` and the samples of perception tasks follow them.
"""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from optisense.design.difference import plain_differences
from optisense.design.problems import listed
from optisense.errors import OutputError, TaskError
from optisense.untrusted_files import COPY_AGAIN, read_json, read_table
from optisense.writing import remedy, written_whole

KEPT = "Finished samples are kept"


def write_whole(path: Path, writer: Callable[[Path], object]) -> None:
    """Call `writer` to write a file under a temporary name beside `path`, then rename it; a file
    that cannot be written raises OutputError.
    """
    with written_whole(path, "the results", kept=KEPT) as temporary:
        writer(temporary)


def read_object(path: Path) -> dict[str, Any]:
    """Read a JSON object from a file; TaskError is raised if the file is missing or holds none."""
    values = read_json(path, TaskError)
    if not isinstance(values, dict):
        raise TaskError("this JSON file holds no object", where=str(path), hint=COPY_AGAIN)
    return values


class CsvTable:
    """A CSV file with named columns that grows row by row; its folder's lock must be held."""

    def __init__(self, path: Path, columns: Sequence[str]) -> None:
        """Open the file, or create it with its header. An incomplete last row is dropped.

        Raises:
            TaskError: the file has other columns, or is a link.
            OutputError: the file cannot be written.
        """
        self.path = path
        self.columns = list(columns)
        heading = _line(self.columns)
        try:
            if path.is_symlink():  # appending rows would write to another place
                raise TaskError(
                    "the table is a link", where=str(path), hint="Put the file itself there"
                )
            if not path.exists():
                write_whole(path, lambda file: file.write_text(heading, "utf-8"))
            # Without a buffer, which would keep what a full disk refuses, to be written later.
            self._file = path.open("r+b", buffering=0)
            content = self._file.read()
            whole = content[: content.rfind(b"\n") + 1]
            self._file.truncate(len(whole))
            self._file.seek(len(whole))
        except OSError as error:
            raise _cannot_write(path, error) from error
        if not whole.startswith(heading.encode("utf-8")):
            raise TaskError(
                "the table has other columns than expected",
                where=str(path),
                hint="Another release may have written it; name another folder",
            )
        self.rows = read_table(path, TaskError)

    def add(self, row: Mapping[str, object]) -> None:
        """Append a row completely or not at all; OutputError is raised if it cannot be written."""
        text = {name: _text(row[name]) for name in self.columns}
        before = self._file.tell()
        left = _line(list(text.values())).encode("utf-8")
        try:
            while left:  # a disk that becomes full takes a part of it, and refuses the next call
                left = left[self._file.write(left) :]
            os.fsync(self._file.fileno())
        except BaseException as error:  # also Ctrl-C
            self._file.truncate(before)
            self._file.seek(before)
            if isinstance(error, OSError):
                raise _cannot_write(self.path, error) from error
            raise
        self.rows.append(text)

    def close(self) -> None:
        """Close the file."""
        self._file.close()


def refuse_differences(
    what: str, folder: Path, before: Mapping[str, Any], now: Mapping[str, Any]
) -> None:
    """Raise TaskError if a folder was begun with other settings; the message lists them."""
    found = plain_differences(before, now)
    if found:
        raise TaskError(
            f"the folder holds {what} with other settings:\n{listed(found)}",
            where=str(folder),
            hint="Name another folder, or repeat the settings of this one to continue it",
        )


def _text(value: object) -> str:
    # repr returns the shortest digits that give the same float.
    return repr(float(value)) if isinstance(value, float) else str(value)


def _line(values: Sequence[str]) -> str:
    buffer = io.StringIO()
    csv.writer(buffer, lineterminator="\n").writerow(values)
    return buffer.getvalue()


def _cannot_write(path: Path, error: OSError) -> OutputError:
    return OutputError(
        f"the results can't be written: {error.strerror or error}",
        where=str(path),
        hint=remedy(error, kept=KEPT),
    )

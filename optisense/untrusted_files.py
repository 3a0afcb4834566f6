"""Reader of files from untrusted sources: all designs, meshes, studies and the like are read here.

A file is read in this order: it must be a regular file and no larger than a given bound, which is
checked before it is read; then it is parsed, with finite numbers only; then its values are checked
against a schema. Paths in a file must stay inside its folder after links are resolved. A failure at
any step is an `OptiSenseError` of the caller's class, which names the file, the place in it, and
the remedy.
"""

from __future__ import annotations

import csv
import io
import json
import math
import os
import re
import stat
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from optisense.errors import OptiSenseError
from optisense.text import brief, lone_surrogate

MEBIBYTE = 2**20
"""Number of bytes of a mebibyte, in which the bounds below are given."""

MOST_MESH = 128 * MEBIBYTE
"""Largest size of a mesh file, bytes. A binary STL file of this size has 2.7 million triangles,
more than a sensor is simulated with; the largest mesh of the built-in sensors has 4 MiB.
"""

MOST_STEP = 64 * MEBIBYTE
"""Largest size of a STEP file, bytes: the CAD models of sensors have up to some 20 MiB."""

MOST_DATA = 16 * MEBIBYTE
"""Largest size of a file of measured values that a kind of emitter, material or camera names,
bytes: the IES file of a lamp that was measured at every half degree has 2 MiB."""

MOST_TEXT = 16 * MEBIBYTE
"""Largest size of a YAML file, bytes: a design whose cages have 8000 control points has 1 MiB."""

MOST_JSON = 16 * MEBIBYTE
"""Largest size of a JSON file, bytes: a study that varies a thousand parameters has 1 MiB."""

MOST_BOARD = 16 * MEBIBYTE
"""Largest size of a pick-and-place file, bytes: a board with 10,000 parts has 1 MiB."""

MOST_PROGRAM = 16 * MEBIBYTE
"""Largest size of a user's Python file, bytes; such files have some KiB."""

MOST_TABLE = 512 * MEBIBYTE
"""Largest size of a CSV table, bytes: a dataset of a million samples has 300 MiB."""

MOST_PICTURE = 512 * MEBIBYTE
"""Largest size of a PNG file, bytes: one of 100 million pixels, the largest made, has less."""

MOST_STORE = 1024 * MEBIBYTE
"""Largest size of a study's store, bytes: a trial has some 2 KiB, this is half a million."""

LARGEST_INTEGER = 2**63 - 1
"""Largest integer that is accepted in JSON: NumPy and SQLite hold no larger one."""

_SURROGATE = re.compile(r"\\u[dD][89a-fA-F]")
"""A surrogate as JSON escapes it; a high and a low one after another are one character."""

SEPARATORS = ",", ";", "\t"
"""Characters that separate values of tables: spreadsheet programs write semicolons in countries
with decimal commas, and tabs into text files."""

COPY_AGAIN = "Check that this is the right file, and copy or make it again"

Error = type[OptiSenseError]


def read_bytes(path: Path, most: int, error: Error, what: str = "the file") -> bytes:
    """Return the content of a regular file that is not too large.

    Args:
        most: largest size, bytes; a larger file is refused before it is read.
        error: class of the error that is raised.
        what: name of the file in messages, such as "the mesh file".

    Raises:
        error: the file is missing, not regular, too large, or can't be read.
    """
    try:
        # Without O_NONBLOCK, a pipe without a writer would block.
        descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
        with open(descriptor, "rb") as file:  # noqa: PTH123 - it is open already
            found = os.fstat(descriptor)
            if not stat.S_ISREG(found.st_mode):
                kind = "a folder" if stat.S_ISDIR(found.st_mode) else "no regular file"
                raise error(f"{what} is {kind}", where=str(path), hint="Name a file")
            refuse_size(found.st_size, most, path, error, what)
            content = file.read(most + 1)
    except (OSError, ValueError) as failed:
        reason = failed.strerror if isinstance(failed, OSError) else None
        raise error(
            f"can't read {what}: {reason or failed}", where=str(path), hint="Check the path"
        ) from None
    except MemoryError:
        raise error(f"{what} does not fit into memory", where=str(path), hint=COPY_AGAIN) from None
    refuse_size(len(content), most, path, error, what)  # it may have grown meanwhile
    return content


def check_size(path: Path, most: int, error: Error, what: str = "the file") -> None:
    """Raise `error` if a file which another library reads is missing, not regular, or too large."""
    try:
        found = path.stat()
    except (OSError, ValueError) as failed:
        reason = failed.strerror if isinstance(failed, OSError) else None
        raise error(
            f"can't read {what}: {reason or failed}", where=str(path), hint="Check the path"
        ) from None
    if not stat.S_ISREG(found.st_mode):
        raise error(f"{what} is no regular file", where=str(path), hint="Name a file")
    refuse_size(found.st_size, most, path, error, what)


def read_text(path: Path, most: int, error: Error, what: str = "the file") -> str:
    """Return the content of a UTF-8 text file; a byte order mark at its start is dropped.

    Raises:
        error: see `read_bytes`; or the file is not UTF-8.
    """
    return as_text(read_bytes(path, most, error, what), str(path), error, what)


def as_text(data: bytes, source: str, error: Error, what: str = "the file") -> str:
    """Decode bytes as UTF-8 text.

    Raises:
        error: the bytes are not UTF-8; the message names the line.
    """
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as found:
        line = data[: found.start].count(b"\n") + 1
        raise error(
            f"{what} is not UTF-8 text", where=f"{source}:{line}", hint=COPY_AGAIN
        ) from None


def read_json(path: Path, error: Error, most: int = MOST_JSON, what: str = "the file") -> Any:
    """Return the values in a JSON file; all its numbers are finite.

    Raises:
        error: see `read_text` and `parse_json`.
    """
    return parse_json(read_text(path, most, error, what), str(path), error, what)


def parse_json(text: str, source: str, error: Error, what: str = "the file") -> Any:
    """Return the values in a JSON text; all its numbers are finite.

    Args:
        text: JSON; NaN and Infinity are refused, and so are numbers too large for a float or a
            64-bit integer, and duplicate keys.
        source: name of the text in messages.
        error: class of the error that is raised.
        what: word for the text in messages.

    Raises:
        error: the text is not such JSON; the message names the line if it is known.
    """
    try:
        found: Any = json.loads(
            text,
            parse_constant=_refused_constant,
            parse_float=_finite,
            parse_int=_integer,
            object_pairs_hook=_object,
        )
    except json.JSONDecodeError as wrong:
        raise error(
            f"{what} is not JSON: {wrong.msg}",
            where=f"{source}:{wrong.lineno}",
            hint=COPY_AGAIN,
        ) from None
    except RecursionError:
        raise error(f"{what} is nested too deeply", where=source, hint=COPY_AGAIN) from None
    except (ValueError, MemoryError) as wrong:
        raise error(f"{what} is not JSON: {wrong}", where=source, hint=COPY_AGAIN) from None
    if _SURROGATE.search(text) and (half := lone_surrogate(found)):
        raise error(
            f"{what} holds {half} alone, which is half of a character",
            where=source,
            hint=COPY_AGAIN,
        )
    return found


def read_table(path: Path, error: Error, by_hand: bool = False) -> list[dict[str, str]]:
    """Return the rows of a CSV file as text, by column.

    A last line without a line break is left out of a table that is not written by hand: this
    program was writing it, or could not finish it. Its first line is always whole.

    Args:
        error: class of the exception to raise.
        by_hand: whether the table may be written by hand or by a spreadsheet program: its values
            may be separated by semicolons or tabs, whichever is most frequent in its first line,
            and a row may have fewer values than there are columns; the others are empty.

    Raises:
        error: the file can't be read, as in `read_text`, or is no such table; it names the line.
    """
    data = read_bytes(path, MOST_TABLE, error, "the table")
    whole = data if by_hand else data[: data.rfind(b"\n") + 1]
    if data and not whole:
        raise error("the table has no line break", where=str(path), hint=COPY_AGAIN)
    text = as_text(whole, str(path), error, "the table")
    separator = max(SEPARATORS, key=text.partition("\n")[0].count) if by_hand else ","
    reader = csv.DictReader(
        io.StringIO(text, newline=""),
        restval="" if by_hand else None,
        delimiter=separator,
        strict=not by_hand,  # a value whose quotes are open at the end of the table is an error
    )
    rows = []
    try:
        for row in reader:
            if None in row or None in row.values():
                count = len(reader.fieldnames or ())
                raise csv.Error(
                    f"the row has {'more' if None in row else 'fewer'} than {count} values"
                )
            rows.append(row)
        return rows
    except csv.Error as found:
        where = f"{path}:{reader.line_num}"
        raise error(f"can't read the table: {found}", where=where, hint=COPY_AGAIN) from None


def inside(folder: Path, relative: str) -> Path | None:
    """Return the path of a file that a file of the folder names, or None if it is outside of the
    folder.

    Links are resolved; a link that refers to itself stays as it is.
    """
    if "\0" in relative:
        return None
    try:
        path = Path(os.path.realpath(folder / relative))
    except (OSError, ValueError):
        return None
    return path if path.is_relative_to(os.path.realpath(folder)) else None


def is_file(path: Path) -> bool:
    """Return whether a path is a regular file; False also for an invalid path."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def is_folder(path: Path) -> bool:
    """Return whether a path is a folder; False also for an invalid path."""
    try:
        return path.is_dir()
    except (OSError, ValueError):
        return False


Stamp = tuple[str, int, int]
"""Path, time of the last change (ns) and size (bytes) of a file; time and size of a missing file
are -1."""


def file_stamp(path: Path) -> Stamp:
    """Return a value that changes if a file changes."""
    try:
        found = path.stat()
    except (OSError, ValueError):
        return str(path), -1, -1
    return str(path), found.st_mtime_ns, found.st_size


def first_problem(error: ValidationError) -> str:
    """Return the first problem of values that a pydantic model refuses, with its place."""
    report = error.errors(include_url=False, include_context=False)[0]
    place = ".".join(brief(str(step)) for step in report["loc"])
    if report["type"] == "missing":
        return f"'{place}' is missing"
    if report["type"] in ("extra_forbidden", "unexpected_keyword_argument"):  # of a dataclass
        return f"'{place}' is not known"
    given = report.get("input")
    plain = isinstance(given, str | int | float | bool | None)
    shown = f" = {brief(repr(given))}" if plain else ""
    text = report["msg"].removeprefix("Value error, ").replace("Input should be", "should be")
    more = f" (and {error.error_count() - 1} more)" if error.error_count() > 1 else ""
    return f"'{place}'{shown}: {text}{more}"


def damaged(path: Path, error: Error, what: str, found: Exception) -> OptiSenseError:
    """Return the error for a file whose content can't be parsed."""
    return error(
        f"can't read {what}: the file is cut off or damaged ({found or type(found).__name__})",
        where=str(path),
        hint=COPY_AGAIN,
    )


def refuse_size(size: int, most: int, path: Path, error: Error, what: str) -> None:
    """Raise an error if a size in bytes is larger than `most`."""
    if size > most:
        raise error(
            f"{what} has {size / MEBIBYTE:,.0f} MiB; at most {most // MEBIBYTE:,} MiB are read",
            where=str(path),
            hint="Check that this is the right file",
        )


def _refused_constant(word: str) -> float:
    raise ValueError(f"{word} is no number in JSON")


def _finite(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(f"the number {text[:40]} is too large")
    return value


def _integer(text: str) -> int:
    # Python itself refuses to parse integers of some thousand digits.
    value = int(text)
    if abs(value) > LARGEST_INTEGER:
        raise ValueError(f"the whole number {text[:40]} is too large")
    return value


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        names = [name for name, _ in pairs]
        twice = next(name for name in found if names.count(name) > 1)
        raise ValueError(f"'{twice[:40]}' appears twice")
    return found

"""Files that are written whole or not at all: under a temporary name first, then renamed."""

from __future__ import annotations

import contextlib
import csv
import errno
import io
import json
import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from uuid import uuid4

from optisense.errors import OutputError

TEMPORARY = re.compile(r"\..+\.(?P<process>[0-9]{1,9})-[0-9a-f]{8}(\.[^.]+)?")
"""Pattern of the names of temporary files, which contain the id of the process that writes them."""

FREE_SPACE = "Free space on this disk or choose another folder"


def remedy(error: OSError, hint: str | None = None, kept: str | None = None) -> str:
    """Return the remedy for an error of writing: to free space on a full disk, else the caller's
    `hint` or the one for its reason; and `kept`, a sentence on what is not lost.
    """
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        found = FREE_SPACE
    else:
        found = hint or OutputError.of(error).hint or "Choose another folder"
    return found if kept is None else f"{found}. {kept}"


def inside(folder: Path, relative: str) -> Path:
    """Return the path for a file of a folder, and create its subfolder.

    Args:
        folder: folder that the user named, which may be a link itself.
        relative: path of the file in it.

    Raises:
        OutputError: a link in the folder leads out of it, or its subfolder can't be created.
    """
    final = folder / relative
    if not Path(os.path.realpath(final.parent)).is_relative_to(os.path.realpath(folder)) or (
        final.is_symlink() and final.is_dir()
    ):
        raise OutputError(
            f"'{relative}' leads out of the folder through a link",
            where=str(folder),
            hint="Remove the link, or name another folder",
        )
    try:
        final.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(
            f"the folder can't be made: {error.strerror or error}",
            where=str(final.parent),
            hint=remedy(error),
        ) from error
    return final


@contextmanager
def written_together(
    what: str, hint: str | None = None, kept: str | None = None
) -> Iterator[Callable[[Path], Path]]:
    """Context for files that appear all at once, when the block has ended without an error.

    Yields:
        A function that takes where a file shall be, makes its folder, and returns the temporary
        path to write to, in the same folder and with the same suffix.

    Args:
        what: word for the files in messages, such as "the design".
        hint: remedy if it fails for another reason than a full disk (see `remedy`); by default, the
            one for the reason.
        kept: sentence that follows the remedy, on what is not lost.

    Raises:
        OutputError: in place of any `OSError`; no temporary file is left behind.
    """
    staged: list[tuple[Path, Path]] = []

    def stage(final: Path) -> Path:
        final.parent.mkdir(parents=True, exist_ok=True)
        staged.append((_temporary(final), final))
        return staged[-1][0]

    try:
        yield stage
        for temporary, final in staged:
            temporary.replace(final)
    except OSError as error:
        # A failed rename names the temporary file; the user knows only the other.
        names = {str(temporary): str(final) for temporary, final in staged}
        named = str(error.filename or (staged[-1][0] if staged else ""))
        raise OutputError(
            f"{what} can't be written: {error.strerror or error}",
            where=names.get(named, named) or None,
            hint=remedy(error, hint, kept),
        ) from error
    finally:
        for temporary, _ in staged:
            with contextlib.suppress(OSError):
                temporary.unlink(missing_ok=True)


@contextmanager
def removed_together() -> Iterator[Callable[[Path], None]]:
    """Context for files that are gone if the block ends without an error, and stay otherwise.

    Yields:
        A function that takes a file, which need not exist, and moves it to a temporary name in the
        same folder.

    Raises:
        OSError: raised by that function if the file can't be moved.
    """
    moved: list[tuple[Path, Path]] = []

    def remove(path: Path) -> None:
        temporary = _temporary(path)
        with contextlib.suppress(FileNotFoundError):
            path.replace(temporary)
            moved.append((temporary, path))

    try:
        yield remove
    except BaseException:
        for temporary, path in moved:
            with contextlib.suppress(OSError):
                temporary.replace(path)
        raise
    for temporary, _ in moved:
        with contextlib.suppress(OSError):
            temporary.unlink()


def _temporary(path: Path) -> Path:
    """Return a temporary path for a file, in the same folder and with the same suffix."""
    return path.with_name(f".{path.stem}.{os.getpid()}-{uuid4().hex[:8]}{path.suffix}")


@contextmanager
def written_whole(
    path: Path, what: str = "the file", hint: str | None = None, kept: str | None = None
) -> Iterator[Path]:
    """Context for one file, as `written_together`; yields the temporary path to write to.

    Raises:
        OutputError: see `written_together`.
    """
    with written_together(what, hint, kept) as stage:
        yield stage(path)


def csv_table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a table (RFC 4180) with a line of headings."""
    text = io.StringIO()
    csv.writer(text).writerows([head, *rows])
    return text.getvalue()


def write_text(path: Path, text: str, what: str = "the file", hint: str | None = None) -> None:
    """Write a text file (UTF-8), whole.

    Raises:
        OutputError: see `written_together`.
    """
    with written_whole(path, what, hint) as temporary:
        temporary.write_text(text, encoding="utf-8")


HEAD = 4096
"""Number of bytes at the start of an HTML page in which its head is searched."""


def is_own_page(path: Path, kind: str) -> bool:
    """Return whether a file is an HTML page that this program has written.

    Args:
        kind: kind of the page, which its head names: "render", "scores", "search", "tolerance",
            "compare" or "calibrate".
    """
    try:
        with path.open("rb") as file:
            head = file.read(HEAD)
    except OSError:
        return False
    mark = rf'<meta name="generator" content="OptiSense [^"]*; {re.escape(kind)}">'
    return re.search(mark.encode(), head) is not None


def remove_own_page(path: Path, kind: str) -> None:
    """Remove a page that this program wrote about results which others now replace.

    Any other file of that name belongs to the user, and is kept.

    Args:
        kind: see `is_own_page`.

    Raises:
        OutputError: the page can't be removed.
    """
    if not is_own_page(path, kind):
        return
    try:
        path.unlink()
    except OSError as error:
        raise OutputError(
            f"the page of earlier results can't be removed: {error.strerror}",
            where=str(path),
            hint="Remove it, or choose another folder",
        ) from error


def write_json(
    path: Path, values: Mapping[str, Any], what: str = "the file", hint: str | None = None
) -> None:
    """Write a JSON file, whole; NaN and infinity, which JSON does not have, are a defect.

    Raises:
        OutputError: see `written_together`.
    """
    text = json.dumps(values, indent=2, ensure_ascii=False, allow_nan=False)
    write_text(path, text + "\n", what, hint)

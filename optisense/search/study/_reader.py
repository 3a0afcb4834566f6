"""Reader of a SQLite file in write-ahead mode that writes nothing beside it.

SQLite's own read-only mode creates the files FILE-wal and FILE-shm if they are missing, and fails
on a disk that is read-only. So a file without a writer is read into memory, one with a writer is
read through SQLite's read-only mode, and one whose writer was killed and that lies on a read-only
disk is copied to the folder of temporary files and merged there. Errors of SQLite become errors of
this package.
"""

from __future__ import annotations

import shutil
import sqlite3
import tempfile
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

from optisense.errors import OptiSenseError, OutputError, SearchError
from optisense.writing import FREE_SPACE

Stamp = tuple[int, int, int]
"""Time of change (ns) and size (bytes) of the file, and size (bytes) of its write-ahead log."""

FORMAT_VERSIONS = slice(18, 20)
"""Range of the bytes in the file's header that hold 2 in write-ahead mode and 1 in the older mode,
which a database in memory can have.
"""

REMEDIES = {
    "disk I/O error": f"The disk is full, was disconnected or fails: check it. {FREE_SPACE}",
    "unable to open": "Check that the file may be read, and its folder be written to for a search",
    "readonly": "Copy the study to a folder that may be written to",
    "locked": "End the other program that has the file open",
    "Permission denied": "Ask its owner for the right to read it",
}
"""Hints for other errors of SQLite, by words in their message."""


class Reader:
    """Source of connections that read one file; each sees the commits before it was requested."""

    def __init__(self, path: Path) -> None:
        """Store the path; nothing is read yet."""
        self._path = path
        self._log = path.with_name(path.name + "-wal")
        self._memory: tuple[Stamp, sqlite3.Connection] | None = None

    @contextmanager
    def connected(self) -> Iterator[sqlite3.Connection]:
        """Yield a connection for the duration of the block."""
        stamp = self._stamp()
        while self._memory is None or self._memory[0] != stamp:
            if stamp[2] == 0:
                self._memory = stamp, _in_memory(self._path.read_bytes())
                stamp = self._stamp()  # another one if somebody has begun to write meanwhile
                continue
            try:
                live = self._live()
            except sqlite3.OperationalError:
                self._memory = stamp, self._merged()
                break
            with closing(live):
                yield live
            return
        yield self._memory[1]

    def _stamp(self) -> Stamp:
        """Return the state of the file."""
        found = self._path.stat()
        try:
            log = self._log.stat().st_size
        except FileNotFoundError:
            log = 0
        return found.st_mtime_ns, found.st_size, log

    def _live(self) -> sqlite3.Connection:
        """Return a read-only connection, while another process may write."""
        address = f"{self._path.absolute().as_uri()}?mode=ro"
        db = sqlite3.connect(address, uri=True, check_same_thread=False)
        try:
            db.execute("select count(*) from sqlite_master")
        except BaseException:
            db.close()
            raise
        return db

    def _merged(self) -> sqlite3.Connection:
        """Return the file merged with its log, in memory."""
        with tempfile.TemporaryDirectory(prefix="optisense-") as folder:
            copy = Path(folder) / self._path.name
            shutil.copyfile(self._path, copy)
            shutil.copyfile(self._log, copy.with_name(self._log.name))
            memory = sqlite3.connect(":memory:", check_same_thread=False)
            with closing(sqlite3.connect(copy)) as db:
                db.backup(memory)
        return memory


def _in_memory(content: bytes) -> sqlite3.Connection:
    """Return a connection to a copy of a file's content."""
    data = bytearray(content)
    if len(data) >= FORMAT_VERSIONS.stop:
        data[FORMAT_VERSIONS] = b"\x01\x01"
    memory = sqlite3.connect(":memory:", check_same_thread=False)
    memory.deserialize(bytes(data))
    return memory


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
        return OutputError("the disk is full", where=where, hint=FREE_SPACE)
    if any(sign in text for sign in ("not a database", "malformed", "no such table")):
        return SearchError(
            f"this is not a study's store, or it is damaged: {text}",
            where=where,
            hint="Use a copy of it, or begin a new study",
        )
    hint = next((hint for sign, hint in REMEDIES.items() if sign in text), None)
    return OutputError(f"the store can't be used: {text}", where=where, hint=hint)

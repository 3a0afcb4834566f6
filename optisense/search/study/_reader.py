"""Reader of a SQLite file in write-ahead mode that writes nothing beside it.

SQLite's own read-only mode creates the files FILE-wal and FILE-shm if they are missing, and fails
on a disk that is read-only. So a file without a writer is read into memory, one with a writer is
read through SQLite's read-only mode, and one whose writer was killed and that lies on a read-only
disk is copied to the folder of temporary files and merged there.
"""

from __future__ import annotations

import shutil
import sqlite3
import tempfile
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

Stamp = tuple[int, int, int]
"""Time of change (ns) and size (bytes) of the file, and size (bytes) of its write-ahead log."""

FORMAT_VERSIONS = slice(18, 20)
"""Range of the bytes in the file's header that hold 2 in write-ahead mode and 1 in the older mode,
which a database in memory can have.
"""


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
        while (stamp := self._stamp())[2] == 0:
            if self._memory is not None and self._memory[0] == stamp:
                yield self._memory[1]
                return
            memory = _in_memory(self._path.read_bytes())
            if self._stamp() == stamp:  # else somebody has begun to write to it meanwhile
                self._memory = stamp, memory
        if self._memory is not None and self._memory[0] == stamp:
            yield self._memory[1]
            return
        try:
            live = self._live()
        except sqlite3.OperationalError:
            self._memory = stamp, self._merged()
            yield self._memory[1]
            return
        with closing(live):
            yield live

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

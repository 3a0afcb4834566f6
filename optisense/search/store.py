"""The trials of a study in one SQLite file.

A generation is written when it is proposed and each of its trials when it is finished, so that a
search that is killed at any moment has lost nothing but what was being worked on. In write-ahead
mode such a commit costs a few hundredths of a millisecond: the file is synchronised with the disk
now and then, and after a power cut the last trials may have to run again.
"""

from __future__ import annotations

import json
import math
import sqlite3
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optisense.errors import OptiSenseError, OutputError, SearchError
from optisense.search.outcome import Outcome

FloatArray = NDArray[np.float64]

STORE_VERSION = 1

START = -1
"""The generation of the start, which is scored first."""

_TABLES = """
create table facts (name text primary key, value text not null) without rowid;
create table trials (
    number integer primary key,
    generation integer not null,
    place integer not null,
    vector blob not null,
    done integer not null default 0,
    scores blob,
    failure text,
    parts text,
    gradient blob,
    seconds real,
    worker text,
    finished real,
    unique (generation, place)
);
create table fresh_scores (
    number integer not null,
    seed integer not null,
    scores blob not null,
    failure text,
    primary key (number, seed)
) without rowid;
"""


@dataclass(frozen=True)
class Row:
    """A trial as it is stored; `outcome` is None until it is finished."""

    number: int
    generation: int
    place: int
    vector: FloatArray
    outcome: Outcome | None
    finished: float | None


class Store:
    """The trials of one study. Only one process may write to it (see `lock`)."""

    def __init__(self, path: Path | None, objectives: Sequence[str], *, new: bool) -> None:
        """Open a store.

        Args:
            path: of the file; None keeps everything in memory.
            objectives: in the order of the stored scores.
            new: whether it is made now.

        Raises:
            SearchError: the file is no store, or one of a newer version.
            OutputError: it can't be written.
        """
        self.path = path
        self.objectives = list(objectives)
        name = ":memory:" if path is None else str(path)
        with _told(path):
            # Progress and reports may ask from another thread; calls never overlap.
            self._db = sqlite3.connect(name, isolation_level=None, check_same_thread=False)
            self._db.execute("pragma journal_mode = wal")
            self._db.execute("pragma synchronous = normal")
            if new:
                with self._together():
                    for statement in _TABLES.split(";"):
                        self._db.execute(statement)
                    self._db.execute(f"pragma user_version = {STORE_VERSION}")
            version = self._db.execute("pragma user_version").fetchone()[0]
        if version != STORE_VERSION:
            self._db.close()
            newer = version > STORE_VERSION
            raise SearchError(
                f"the store has version {version}; this release reads {STORE_VERSION}",
                where=name,
                hint="A newer release wrote it: update OptiSense Studio" if newer else None,
            )

    def close(self) -> None:
        """Close the file; the write-ahead log is merged into it."""
        self._db.close()

    def set_fact(self, name: str, value: object) -> None:
        """Keep a JSON-ready value under a name."""
        with _told(self.path):
            self._db.execute(
                "insert or replace into facts values (?, ?)", (name, json.dumps(value))
            )

    def fact(self, name: str) -> Any:
        """The value under a name, or None."""
        row = self._db.execute("select value from facts where name = ?", (name,)).fetchone()
        return None if row is None else json.loads(row[0])

    def propose(self, generation: int, vectors: FloatArray, place: int = 0) -> None:
        """Write the points (k, n) of a generation, all in one commit.

        Args:
            generation: its number.
            vectors: the points.
            place: of the first of them in the generation.
        """
        first = self._count("select coalesce(max(number) + 1, 0) from trials")
        rows = [
            (first + k, generation, place + k, np.ascontiguousarray(vector, "<f8").tobytes())
            for k, vector in enumerate(vectors)
        ]
        with _told(self.path), self._together():
            self._db.executemany(
                "insert into trials (number, generation, place, vector) values (?, ?, ?, ?)", rows
            )

    def finish(self, number: int, outcome: Outcome) -> None:
        """Write what came of a trial, which must not be finished already."""
        values = (
            self._packed(outcome.scores),
            outcome.failure,
            json.dumps(outcome.parts) if outcome.parts else None,
            None if outcome.gradient is None else outcome.gradient.astype("<f8").tobytes(),
            outcome.seconds,
            outcome.worker or None,
            time.time(),
            number,
        )
        with _told(self.path):
            changed = self._db.execute(
                "update trials set done = 1, scores = ?, failure = ?, parts = ?, gradient = ?, "
                "seconds = ?, worker = ?, finished = ? where number = ? and done = 0",
                values,
            ).rowcount
        if changed != 1:
            raise SearchError(f"trial {number} was finished twice", where=str(self.path))

    def finish_fresh(self, number: int, seed: int, outcome: Outcome) -> None:
        """Write what a trial scores with another seed."""
        with _told(self.path):
            self._db.execute(
                "insert or replace into fresh_scores values (?, ?, ?, ?)",
                (number, seed, self._packed(outcome.scores), outcome.failure),
            )

    def rows(self, generation: int | None = None) -> list[Row]:
        """All trials, or those of one generation, in the order in which they were proposed."""
        query = (
            "select number, generation, place, vector, done, scores, failure, parts, gradient, "
            "seconds, worker, finished from trials"
        )
        chosen = () if generation is None else (generation,)
        where = "" if generation is None else " where generation = ?"
        found = self._db.execute(f"{query}{where} order by number", chosen)
        return [self._row(row) for row in found]

    def fresh_scores(self) -> dict[int, dict[int, Outcome]]:
        """What trials score with other seeds, by number and seed."""
        found: dict[int, dict[int, Outcome]] = {}
        rows = self._db.execute("select number, seed, scores, failure from fresh_scores")
        for number, seed, scores, failure in rows:
            found.setdefault(number, {})[seed] = Outcome(self._unpacked(scores), failure)
        return found

    def last_generation(self) -> int:
        """The number of the last generation; `START` - 1 where there is none."""
        return self._count(f"select coalesce(max(generation), {START - 1}) from trials")

    def proposed_before(self, generation: int) -> int:
        """How many trials the generations before this one have, without the start."""
        return self._count(
            f"select count(*) from trials where generation >= 0 and generation < {generation:d}"
        )

    def _count(self, query: str) -> int:
        return int(self._db.execute(query).fetchone()[0])

    def _row(self, row: Sequence[Any]) -> Row:
        number, generation, place, vector, done, scores, failure, parts, gradient = row[:9]
        outcome = None
        if done:
            outcome = Outcome(
                scores=self._unpacked(scores),
                failure=failure,
                parts=json.loads(parts) if parts else {},
                seconds=row[9],
                gradient=None if gradient is None else np.frombuffer(gradient, "<f8").copy(),
                worker=row[10] or "",
            )
        point = np.frombuffer(vector, "<f8").copy()
        return Row(number, generation, place, point, outcome, row[11])

    def _packed(self, scores: Mapping[str, float]) -> bytes:
        values = [scores.get(name, math.nan) for name in self.objectives]
        return np.array(values, dtype="<f8").tobytes()

    def _unpacked(self, blob: bytes) -> dict[str, float]:
        return dict(zip(self.objectives, np.frombuffer(blob, "<f8").tolist(), strict=True))

    @contextmanager
    def _together(self) -> Iterator[None]:
        """One transaction: all or nothing."""
        self._db.execute("begin immediate")
        try:
            yield
        except BaseException:
            if self._db.in_transaction:  # SQLite has rolled back already where the disk is full
                self._db.execute("rollback")
            raise
        self._db.execute("commit")


class Lock:
    """Held by the one process that runs a study; it is free again when that process ends."""

    def __init__(self, path: Path) -> None:
        """Take it.

        Raises:
            SearchError: another process has it.
            OutputError: the folder can't be written.
        """
        with _told(path):
            self._db = sqlite3.connect(path, timeout=0.0, isolation_level=None)
        try:
            self._db.execute("begin exclusive")
        except sqlite3.OperationalError as error:
            self._db.close()
            if "locked" not in str(error):
                raise _error(error, path) from error
            raise SearchError(
                "another process is running this study",
                where=str(path.parent),
                hint="Wait for it, or end it: nothing that it has finished is lost",
            ) from None

    def release(self) -> None:
        """Give it back."""
        self._db.close()


@contextmanager
def _told(path: Path | None) -> Iterator[None]:
    """SQLite's errors as ours."""
    try:
        yield
    except sqlite3.Error as error:
        raise _error(error, path) from error


def _error(error: sqlite3.Error, path: Path | None) -> OptiSenseError:
    where = None if path is None else str(path)
    text = str(error)
    if "full" in text:
        return OutputError(
            "the disk is full",
            where=where,
            hint="Free some space and go on with --resume: all finished trials are kept",
        )
    if "not a database" in text or "malformed" in text:
        return SearchError(f"this is not a study's store: {text}", where=where)
    return OutputError(f"the store can't be used: {text}", where=where)

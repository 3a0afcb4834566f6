"""Store of a study's trials in one SQLite file.

A generation is written when it is proposed and each of its trials when it is finished, so that a
search that is killed at any moment loses only the trials in progress. In write-ahead mode such a
commit costs a few hundredths of a millisecond: the file is synchronised with the disk from time to
time, and after a power cut the last trials may have to run again.
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

from optisense.array_types import FloatArray
from optisense.errors import OutputError, SearchError
from optisense.objectives.registry import CONDITIONS
from optisense.search.evaluation.outcome import Outcome
from optisense.search.study._reader import Reader, damaged, translated_errors
from optisense.search.study.settings import refuse_other_version
from optisense.untrusted_files import MOST_STORE, check_size

STORE_VERSION = 1
"""Version of the tables of trials; it is increased when an older program can't read them."""

START = -1
"""Generation number of the start, which is scored before the first generation, 0."""

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
    conditions text,
    primary key (number, seed)
) without rowid;
"""

_STRANGE = (
    "select type from sqlite_master where type not in ('table', 'index') "
    "or tbl_name not in ('facts', 'trials', 'fresh_scores') or sql like '%generated%' limit 1"
)
"""Query for a table, view or trigger that a store does not have."""


@dataclass(frozen=True)
class Row:
    """Trial as it is stored; `outcome` is None until it is finished."""

    number: int
    generation: int
    place: int
    vector: FloatArray
    outcome: Outcome | None
    finished: float | None


class Store:
    """Trials of one study.

    A store that was opened is only read: nothing is written in its folder, and commits of another
    process are seen. `open_writer` opens it for writing, by one process at a time.
    """

    def __init__(self, path: Path | None, objectives: Sequence[str]) -> None:
        """Store the arguments; use `create` or `open` instead."""
        self.path = path
        self.objectives = list(objectives)
        self._db: sqlite3.Connection | None = None
        self._reader = None if path is None else Reader(path)

    @staticmethod
    def create(path: Path | None, objectives: Sequence[str]) -> Store:
        """Create a store at a path where there is no file, or in memory, open for writing; scores
        are stored in the order of the names of the objectives.
        """
        store = Store(path, objectives)
        with translated_errors(path):
            store._connect("rwc")
            with store._transaction() as db:
                for statement in _TABLES.split(";"):
                    db.execute(statement)
                db.execute(f"pragma user_version = {STORE_VERSION}")
        return store

    @staticmethod
    def open(path: Path, objectives: Sequence[str]) -> Store:
        """Open a store for reading; SearchError if the file is no store, or of a newer version."""
        check_size(path, MOST_STORE, SearchError, "the study's store")
        store = Store(path, objectives)
        with store._read() as db:
            version = db.execute("pragma user_version").fetchone()[0]
            strange = db.execute(_STRANGE).fetchone()
        refuse_other_version("store", version, STORE_VERSION, path)
        if strange is not None:
            # For example a view in place of a table, which may compute for ever.
            raise damaged("the store", path, f"it has a {strange[0]} that is none of a study's")
        return store

    def open_writer(self) -> None:
        """Open the store for writing; the caller holds the lock of the folder."""
        if self._db is None:
            if self.path is not None and self.path.is_symlink():
                raise OutputError(
                    "the store is a link",
                    where=str(self.path),
                    hint="Put the file itself into the study's folder",
                )
            with translated_errors(self.path):
                self._connect("rw")
                if not _has_conditions(self._writer):
                    self._writer.execute("alter table fresh_scores add column conditions text")

    def close(self) -> None:
        """Close the file for writing, into which its write-ahead log is merged; the content of a
        store in memory is lost.
        """
        if self._db is not None:
            with translated_errors(self.path):
                self._db.close()
            self._db = None

    def _connect(self, mode: str) -> None:
        """Open the file for writing; `mode` as in a URI of SQLite."""
        name = ":memory:" if self.path is None else f"{self.path.absolute().as_uri()}?mode={mode}"
        # Progress and reports may read from another thread; calls never overlap.
        self._db = sqlite3.connect(name, uri=True, isolation_level=None, check_same_thread=False)
        self._db.execute("pragma journal_mode = wal")
        self._db.execute("pragma synchronous = normal")

    @property
    def _writer(self) -> sqlite3.Connection:
        assert self._db is not None, "the store is not open for writing"
        return self._db

    @contextmanager
    def _read(self) -> Iterator[sqlite3.Connection]:
        """Yield a connection for reading."""
        with translated_errors(self.path):
            if self._db is not None:
                yield self._db
            else:
                assert self._reader is not None
                with self._reader.connected() as db:
                    yield db

    def set_fact(self, name: str, value: object) -> None:
        """Store a JSON-ready value under a name."""
        with translated_errors(self.path):
            self._writer.execute(
                "insert or replace into facts values (?, ?)", (name, json.dumps(value))
            )

    def fact(self, name: str) -> Any:
        """Return the value under a name, or None."""
        with self._read() as db:
            row = db.execute("select value from facts where name = ?", (name,)).fetchone()
            with self._readable(f"the fact '{name}'"):
                return None if row is None else json.loads(row[0])

    def propose(self, generation: int, vectors: FloatArray, place: int = 0) -> None:
        """Write the points (k, n) of a generation, the first of which has the index `place` in it,
        all in one commit.
        """
        first = self._count("select coalesce(max(number) + 1, 0) from trials")
        rows = [
            (first + k, generation, place + k, np.ascontiguousarray(vector, "<f8").tobytes())
            for k, vector in enumerate(vectors)
        ]
        with translated_errors(self.path), self._transaction() as db:
            db.executemany(
                "insert into trials (number, generation, place, vector) values (?, ?, ?, ?)", rows
            )

    def finish(self, number: int, outcome: Outcome) -> None:
        """Write the outcome of a trial, which must not be finished already."""
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
        with translated_errors(self.path):
            changed = self._writer.execute(
                "update trials set done = 1, scores = ?, failure = ?, parts = ?, gradient = ?, "
                "seconds = ?, worker = ?, finished = ? where number = ? and done = 0",
                values,
            ).rowcount
        if changed != 1:
            raise SearchError(f"trial {number} was finished twice", where=str(self.path))

    def add_parts(self, number: int, parts: Mapping[str, Any]) -> None:
        """Replace the parts of a finished trial by others that contain them."""
        row = json.dumps(parts), number
        with translated_errors(self.path):
            self._writer.execute("update trials set parts = ? where number = ?", row)

    def finish_fresh(self, number: int, seed: int, outcome: Outcome) -> None:
        """Write the outcome of a trial with another seed."""
        with translated_errors(self.path):
            self._writer.execute(
                "insert or replace into fresh_scores (number, seed, scores, failure, conditions) "
                "values (?, ?, ?, ?, ?)",
                (
                    number,
                    seed,
                    self._packed(outcome.scores),
                    outcome.failure,
                    json.dumps(dict(outcome.conditions)) if outcome.conditions else None,
                ),
            )

    def rows(self, generation: int | None = None) -> list[Row]:
        """Return all trials, or those of one generation, in the order of their proposal."""
        query = (
            "select number, generation, place, vector, done, scores, failure, parts, gradient, "
            "seconds, worker, finished from trials"
        )
        chosen = () if generation is None else (generation,)
        where = "" if generation is None else " where generation = ?"
        with self._read() as db:
            found = db.execute(f"{query}{where} order by number", chosen).fetchall()
        return [self._row(row) for row in found]

    def fresh_scores(self) -> dict[int, dict[int, Outcome]]:
        """Return the outcomes of trials with other seeds, by number and seed."""
        found: dict[int, dict[int, Outcome]] = {}
        with self._read() as db:
            conditions = "conditions" if _has_conditions(db) else "null"
            rows = db.execute(
                f"select number, seed, scores, failure, {conditions} from fresh_scores"
            ).fetchall()
        for number, seed, scores, failure, kept in rows:
            with self._readable(f"a fresh score of trial {number}"):
                why = None if failure is None else str(failure)
                parts = _objects({CONDITIONS: json.loads(kept)}) if kept else {}
                outcome = Outcome(self._unpacked(scores), why, parts)
                found.setdefault(number, {})[int(seed)] = outcome
        return found

    def check_points(self, size: int) -> None:
        """Raise SearchError if a trial has no point of `size` numbers."""
        with self._read() as db:
            wrong = db.execute(
                "select number from trials where typeof(vector) != 'blob' or length(vector) != ? "
                "limit 1",
                (8 * size,),
            ).fetchone()
        if wrong is not None:
            why = f"its point is not of {size} numbers"
            raise damaged(f"trial {wrong[0]}", self.path, why)

    def last_generation(self) -> int:
        """Return the number of the last generation; `START` - 1 if there is none."""
        return self._count(f"select coalesce(max(generation), {START - 1}) from trials")

    def proposed_before(self, generation: int) -> int:
        """Return the number of trials in the generations before this one, without the start."""
        return self._count(
            f"select count(*) from trials where generation >= 0 and generation < {generation:d}"
        )

    def _count(self, query: str) -> int:
        with self._read() as db:
            return int(db.execute(query).fetchone()[0])

    def _row(self, row: Sequence[Any]) -> Row:
        number, generation, place, vector, done, scores, failure, parts, gradient = row[:9]
        with self._readable(f"trial {number}"):
            if number < 0:
                raise ValueError("its number is negative")
            outcome = None
            if done:
                outcome = Outcome(
                    scores=self._unpacked(scores),
                    failure=None if failure is None else str(failure),
                    parts=_objects(json.loads(parts)) if parts else {},
                    seconds=float(row[9]),
                    gradient=None if gradient is None else np.frombuffer(gradient, "<f8").copy(),
                    worker=str(row[10] or ""),
                )
            point = np.frombuffer(vector, "<f8").copy()
            if not np.isfinite(point).all():
                raise ValueError("its point has numbers that are not finite")
            finished = None if row[11] is None else float(row[11])
            return Row(number, int(generation), int(place), point, outcome, finished)

    @contextmanager
    def _readable(self, what: str) -> Iterator[None]:
        """Turn errors by values that this class does not write into one that names the place."""
        try:
            yield
        except (ValueError, TypeError, RecursionError, MemoryError, OverflowError) as error:
            raise damaged(what, self.path, str(error) or type(error).__name__) from error

    def _packed(self, scores: Mapping[str, float]) -> bytes:
        values = [scores.get(name, math.nan) for name in self.objectives]
        return np.array(values, dtype="<f8").tobytes()

    def _unpacked(self, blob: bytes) -> dict[str, float]:
        return dict(zip(self.objectives, np.frombuffer(blob, "<f8").tolist(), strict=True))

    @contextmanager
    def _transaction(self) -> Iterator[sqlite3.Connection]:
        """Run the block as one transaction, which is committed whole or not at all."""
        db = self._writer
        db.execute("begin immediate")
        try:
            yield db
            db.execute("commit")
        except BaseException:
            if db.in_transaction:  # on a full disk SQLite has rolled back already
                db.execute("rollback")
            raise


def _has_conditions(db: sqlite3.Connection) -> bool:
    """Return whether fresh scores have a column for conditions, which stores of 0.2.0 lack."""
    return any(
        column[1] == "conditions" for column in db.execute("pragma table_info(fresh_scores)")
    )


def _objects(parts: Any) -> dict[str, Any]:
    """Return the parts of scores that were read from JSON; TypeError if they have another form."""
    if not isinstance(parts, dict) or not all(isinstance(each, dict) for each in parts.values()):
        raise TypeError("the parts of its scores are no objects")
    for value in parts.get(CONDITIONS, {}).values():
        if value is not None and not isinstance(value, int | float):
            raise TypeError("a condition's value is no number")
    return parts

"""Killing of a command, checks of the files that it left, and its repetition."""

from __future__ import annotations

import os
import random
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from optisense.errors import OptiSenseError

from .agreement import agrees, same_values
from .cluster import Cluster
from .work import GOALS, WORK, half_files, whole_files

LONGEST = 1800.0
"""Time (s) after which a command counts as hanging; on a busy machine the slowest takes minutes."""

POLL = 0.002
"""Time (s) between two checks whether a command has begun to write."""


@dataclass
class Report:
    """What came of killing one command again and again.

    Attributes:
        killed: kills that came before the command's end.
        late: kills that came after it.
        wrong: what was not as it must be, with the moment of the kill.
    """

    killed: int = 0
    late: int = 0
    wrong: list[str] = field(default_factory=list)


class Target:
    """A command, with its result where nothing kills it."""

    def __init__(self, name: str, home: Path) -> None:
        """Run it once without a kill, in a folder of its own.

        Raises:
            RuntimeError: it has failed.
        """
        self.work, self._home, self._runs = WORK[name], home, 0
        home.mkdir(parents=True, exist_ok=True)
        (home / "goals.py").write_text(GOALS)
        self.work.prepare(home)
        self._cluster = Cluster(home) if self.work.cluster else None
        out = home / "whole"
        process = self._begin(out)
        _until_it_writes(process, out)
        began = time.monotonic()
        said = process.communicate(timeout=LONGEST)[0]
        self.writes_for = time.monotonic() - began
        if process.returncode:
            raise RuntimeError(f"{name} has failed: {said}")
        self._result = self.work.result(out)
        self._files = whole_files(out, self.work.varying)

    def kill_once(self, chance: random.Random, report: Report) -> None:
        """Kill it, one time in eight while it starts, else while it writes; then give it again.

        Of a command with workers one kill in two takes only the command, so that its workers are
        left; of one on a Dask cluster one in two takes only the worker, another comes in its
        place, and the command ends as if nothing had been.
        """
        self._runs += 1
        out = self._home / str(self._runs)
        process = self._begin(out)
        starting = chance.random() < 1 / 8
        if not starting:
            _until_it_writes(process, out)
        moment = chance.uniform(0.0, self.writes_for)
        began = time.monotonic()
        with suppress(subprocess.TimeoutExpired):
            process.wait(moment)
            self.writes_for = time.monotonic() - began  # it was over sooner than the others
        half = chance.random() < 0.5
        when = f"{'start' if starting else 'writing'} + {moment:.3f} s"
        if self._cluster is not None and half:
            late = process.poll() is not None
            self._cluster.replace_worker()
            said = process.communicate(timeout=LONGEST)[0]
            other = self._difference(out)
            if process.returncode or other:
                code = process.returncode
                report.wrong.append(
                    f"{when}, of a worker: ends with {code}, {other}: {said[-300:]}"
                )
        else:
            alone = bool(self.work.workers) and half
            (process.kill if alone else lambda: _kill_group(process))()
            process.communicate()
            late = process.returncode == 0
            wrong = half_files(out, self._files) if out.is_dir() else []
            report.wrong += [f"{when}: {each}" for each in wrong]
            if not late:
                amiss = self._again(out)
                report.wrong += [f"{when}: {amiss}"] if amiss else []
        report.late += late
        report.killed += not late
        shutil.rmtree(out, ignore_errors=True)

    def end(self) -> None:
        """End the cluster, if there is one."""
        if self._cluster is not None:
            self._cluster.end()

    def _again(self, out: Path) -> str:
        """Repeat the command; return what is wrong with its end."""
        process = self._begin(out, *(self.work.again if (out / "study.json").exists() else ()))
        said = process.communicate(timeout=LONGEST)[0]
        other = self._difference(out)
        if process.returncode and other:
            return f"given again, it ends with {process.returncode} ({other}): {said[-300:]}"
        return f"given again, it ends with another result: {other}" if other else ""

    def _difference(self, out: Path) -> str:
        """In what a result is another one than that of the command that was not killed."""
        try:
            found = self.work.result(out)
        except (OptiSenseError, OSError) as error:
            return str(error)
        if left := strays(out):
            return f"files of nobody: {left}"
        names = sorted({*found, *self._result})
        return ", ".join(name for name in names if not self._same(name, found))

    def _same(self, name: str, found: dict[str, Any]) -> bool:
        if name not in found or name not in self._result:
            return False
        one, other = self._result[name], found[name]
        if isinstance(one, bytes):
            return agrees(name, one, other)
        return same_values(one, other) if self.work.fits else bool(one == other)

    def _begin(self, out: Path, *more: str) -> subprocess.Popen[str]:
        stand = {"@OUT": str(out), "@GOALS": str(self._home / "goals.py")}
        if self._cluster is not None:
            stand["@CLUSTER"] = self._cluster.address
        words = [*self.work.words, *more]
        for name, value in stand.items():
            words = [word.replace(name, value) for word in words]
        return subprocess.Popen(
            [sys.executable, "-m", "optisense", *words],
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
            start_new_session=True, cwd=self._home,
        )  # fmt: skip


def strays(folder: Path) -> list[str]:
    """Return temporary files that no later command removes."""
    return [path.name for path in folder.rglob(".*") if path.name.startswith(".")]


def _until_it_writes(process: subprocess.Popen[str], out: Path) -> None:
    until = time.monotonic() + LONGEST
    while process.poll() is None and time.monotonic() < until:
        if out.exists() or any(out.parent.glob(f".{out.name}*")):
            return
        time.sleep(POLL)


def _kill_group(process: subprocess.Popen[str]) -> None:
    try:
        os.killpg(process.pid, signal.SIGKILL)
    except ProcessLookupError:
        process.kill()


def kill_repeatedly(
    name: str, kills: int, seed: int, home: Path, told: Callable[[Report], None] = lambda _: None
) -> Report:
    """Kill a command at so many moments before its end; what came of it.

    Where every second kill comes after the end, there are fewer.
    """
    chance, report = random.Random(f"{seed} {name}"), Report()
    target = Target(name, home)
    try:
        while report.killed < kills and report.killed + report.late < 2 * kills:
            target.kill_once(chance, report)
            told(report)
    finally:
        target.end()
    return report

"""``python -m tests.fuzz --minutes 60``: malformed input of every kind, for as long as asked.

Each kind has a process of its own, which is ended where one case takes too long or too much
memory. The kinds come in turn, a few minutes at a time, and each one's time counts from its first
case. The table that is printed counts, for each kind, the cases, how many were read as they are,
refused in words, and what went wrong; cases that went wrong are kept under --keep.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import resource
import shutil
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Mapping
from multiprocessing.connection import Connection
from pathlib import Path

from .cases import Case, keep_case, read_case, write_case

CASE_TIME = 30.0
"""Longest processor time (s) of one case; the slowest valid case takes a few seconds."""

PATIENCE = 20.0
"""Times these seconds that a case may take on the wall, where other programs work, too."""

ENGINE_TIME = 90.0
"""The same for requests to the engine, which compiles kernels for the first of them."""

MEMORY = 6 * 2**30
"""Bytes of address space that a process may have; an ordinary one has some 2 GiB."""

ROUND = 20.0
"""Minutes that all kinds together get before the first one's turn comes again; a process of a kind
starts in some seconds."""

START_TIME = 300.0
"""Seconds in which a process of the fuzzer must begin its first case; it imports first, which takes
some seconds where nothing else runs."""

MOST_STILLBORN = 5
"""Processes of the fuzzer that end, or take too long, before their first case: on a busy machine
one may."""

Found = tuple[str, str, Case]
"""Kind of input, what went wrong, and with which files."""


def one_case(kind: str, case: Case, folder: Path) -> str:
    """Outcome of a case: read, refused, or the error and its place."""
    from optisense.errors import OptiSenseError

    from .every_kind import KINDS
    from .kinds import RefusedError

    write_case(case, folder)
    try:
        with warnings.catch_warnings():
            for each in (RuntimeWarning, UserWarning):  # NumPy's and others', which users would see
                warnings.simplefilter("error", each)
            KINDS[kind].read(folder)
    except (OptiSenseError, RefusedError):
        return "refused"
    except Exception as error:
        frames = [frame for frame in traceback.extract_tb(error.__traceback__)
                  if "optisense/" in frame.filename]  # fmt: skip
        place = f"{Path(frames[-1].filename).name}:{frames[-1].name}" if frames else ""
        text = str(error).split("\n")[0] if not frames else ""
        return f"{type(error).__name__} {place or text[:60]}"
    return "read"


def _work(kind: str, seed: int, seconds: float, channel: Connection, folder: Path) -> None:
    """Make cases and try them for a time; runs in a process of its own."""
    from hypothesis import HealthCheck, Phase, given, settings
    from hypothesis import seed as seeded

    from .engine_kind import ENGINE
    from .every_kind import KINDS

    sys.stderr = open(os.devnull, "w")  # noqa: SIM115, PTH123
    os.chdir(folder.parent)
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))

    class Over(BaseException):
        pass

    end = time.time() + seconds

    def run(seed_now: int) -> None:
        @seeded(seed_now)
        @settings(max_examples=500, deadline=None, database=None, phases=[Phase.generate],
                  suppress_health_check=list(HealthCheck))  # fmt: skip
        @given(KINDS[kind].cases)
        def attempt(case: Case) -> None:
            if time.time() > end:
                raise Over
            write_case(case, folder)
            channel.send(("begun", None))
            end_of_case = int(time.process_time() + CASE_TIME) + 1
            resource.setrlimit(resource.RLIMIT_CPU, (end_of_case, resource.RLIM_INFINITY))
            outcome = one_case(kind, case, folder)
            channel.send((outcome, case if outcome not in ("read", "refused") else None))

        attempt()

    try:
        while time.time() < end:
            run(seed)
            seed += 1
    except Over:
        pass
    except BaseException:
        channel.send(("failed", {"": traceback.format_exc().encode()}))
    finally:
        ENGINE.end()
    channel.send(("over", None))


def fuzz(kind: str, seconds: float, seed: int) -> tuple[Counter[str], dict[str, Case]]:
    """Try cases of a kind for a time; how often each outcome was, and a case of each fault."""
    from .engine_kind import busy

    counts: Counter[str] = Counter()
    faults: dict[str, Case] = {}
    stillborn = 0
    while seconds > 0.0:
        home = Path(tempfile.mkdtemp(prefix="optisense-fuzz-"))
        ours, theirs = multiprocessing.get_context("spawn").Pipe(duplex=False)
        child = multiprocessing.get_context("spawn").Process(
            target=_work, args=(kind, seed, seconds, theirs, home / "case")
        )
        child.start()
        theirs.close()
        over, begun = False, False
        began = first = time.time()
        try:
            while not over:
                limit = ENGINE_TIME * busy() if kind == "engine" else PATIENCE * CASE_TIME
                limit = limit if begun else START_TIME * busy()
                if not ours.poll(max(began + limit - time.time(), 0.0)):
                    raise TimeoutError
                outcome, case = ours.recv()
                began = time.time()
                first, begun = first if begun else began, True
                over = outcome == "over"
                if outcome == "failed":
                    raise RuntimeError(case[""].decode())
                if outcome not in ("begun", "over"):
                    counts[outcome] += 1
                    if case is not None:
                        faults.setdefault(outcome, case)
        except (TimeoutError, EOFError) as error:
            late = isinstance(error, TimeoutError)
            if not late:
                child.join()
                late = child.exitcode == -signal.SIGXCPU
            what = "takes too long" if late else "the process has ended"
            if begun and (home / "case").exists():
                counts[what] += 1
                faults.setdefault(what, read_case(home / "case"))
            elif (stillborn := stillborn + 1) > MOST_STILLBORN:
                raise RuntimeError("the fuzzer's own process has failed") from None
        finally:
            if child.is_alive() and not over:
                os.kill(child.pid or 0, signal.SIGKILL)
            child.join()
            shutil.rmtree(home, ignore_errors=True)
        seed += 100_000
        seconds = 0.0 if over else seconds - (time.time() - first if begun else 0.0)
    return counts, faults


def main() -> int:
    """Run from the command line; 1 where something went wrong."""
    from .every_kind import KINDS

    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0] if __doc__ else "")
    parser.add_argument("--minutes", type=float, default=60.0, help="in all")
    parser.add_argument("--seed", type=int, default=int(time.time()))
    parser.add_argument("--kind", action="append", choices=sorted(KINDS), help="only these")
    parser.add_argument("--keep", type=Path, default=Path("fuzz-found"), help="where cases go")
    parser.add_argument("--json", type=Path, help="write the counts here, too")
    given = parser.parse_args()
    names = given.kind or list(KINDS)
    total = sum(KINDS[name].weight for name in names)
    rounds = max(1, round(given.minutes / ROUND))
    rows: dict[str, Counter[str]] = {name: Counter() for name in names}
    for turn in range(rounds):
        print(f"round {turn + 1} of {rounds}", flush=True)
        for name in names:
            seconds = given.minutes * 60.0 / rounds * KINDS[name].weight / total
            counts, faults = fuzz(name, seconds, given.seed + 1_000_000 * turn)
            rows[name] += counts
            for what in sorted(faults):
                place = keep_case(name, faults[what], given.keep)
                print(f"    {name}: {counts[what]} times {what}: {place}", flush=True)
            if given.json:
                given.json.write_text(json.dumps(rows, indent=1) + "\n")
        print_table(rows)
    return int(any(set(each) - {"read", "refused"} for each in rows.values()))


def print_table(rows: Mapping[str, Counter[str]]) -> None:
    """Print the number of cases of each kind so far, and their outcomes."""
    print(f"{'kind':<14}{'cases':>9}{'read':>9}{'refused':>9}{'wrong':>7}")
    for name, counts in rows.items():
        fine = counts["read"], counts["refused"]
        print(
            f"{name:<14}{counts.total():>9}{fine[0]:>9}{fine[1]:>9}{counts.total() - sum(fine):>7}"
        )
    sys.stdout.flush()

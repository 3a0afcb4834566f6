"""``python -m tests.fuzz.guided --minutes 30``: the same cases, guided by coverage (atheris).

libFuzzer changes the bytes from which Hypothesis makes a case, and keeps those that reach lines of
OptiSense that none before has reached. Each kind has a process of its own. Kinds whose work is done
by other processes or by compiled code are left out, as no lines can be counted there.
"""

from __future__ import annotations

import argparse
import importlib
import json
import os
import random
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

KINDS = ("design", "mesh", "ies", "entry", "tuning", "recipe", "study", "dataset", "contact",
         "search-space", "options")  # fmt: skip
"""Kinds of input that are parsed by code of OptiSense."""

MOST_BYTES = 8192
"""Bytes from which a case is made at most; most cases take some hundred."""

SEEDS = 40
"""Random texts of bytes with which libFuzzer begins: those that are too short make no case."""

LIBFUZZER = ("-verbosity=0", "-rss_limit_mb=6144", "-timeout=300", f"-max_len={MOST_BYTES}",
             "-len_control=0")  # fmt: skip
"""Options of libFuzzer: memory (MiB) and time (s) of one case, and the number of bytes from which
it is made."""


def guided(kind: str, seconds: float, keep: Path, told: Path) -> None:
    """Try cases of a kind for a time, write the counts, and end the process."""
    atheris = importlib.import_module("atheris")  # only where `make guided-fuzz` has put it
    with atheris.instrument_imports(include=["optisense"]):
        from .every_kind import KINDS as READERS
        from .runner import one_case
    from hypothesis import HealthCheck, given, settings

    from .cases import Case, keep_case

    counts: Counter[str] = Counter()
    home = Path(tempfile.mkdtemp(prefix="optisense-guided-"))
    os.chdir(home)
    end = time.monotonic() + seconds

    @settings(database=None, deadline=None, suppress_health_check=list(HealthCheck))
    @given(READERS[kind].cases)
    def attempt(case: Case) -> None:
        outcome = one_case(kind, case, home / "case")
        if outcome not in ("read", "refused") and not counts[outcome]:
            print(f"    {kind}: {outcome}: {keep_case(kind, case, keep)}", flush=True)
        counts[outcome] += 1

    def from_bytes(data: bytes) -> None:
        if time.monotonic() > end:
            told.write_text(json.dumps(counts))
            os._exit(0)
        attempt.hypothesis.fuzz_one_input(data)

    seeds = home / "seeds"
    seeds.mkdir()
    chance = random.Random(kind)
    for number in range(SEEDS):
        (seeds / str(number)).write_bytes(chance.randbytes(MOST_BYTES // 4))
    atheris.Setup([sys.argv[0], *LIBFUZZER, str(seeds)], from_bytes)
    atheris.Fuzz()


def main() -> int:
    """Run from the command line; 1 where something went wrong."""
    from .runner import print_table

    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--minutes", type=float, default=30.0, help="in all")
    parser.add_argument("--kind", action="append", choices=KINDS, help="only these")
    parser.add_argument("--keep", type=Path, default=Path("fuzz-found"), help="where cases go")
    parser.add_argument("--told", type=Path, help=argparse.SUPPRESS)
    given = parser.parse_args()
    names = given.kind or list(KINDS)
    seconds, keep = given.minutes * 60.0 / len(names), given.keep.resolve()
    if given.told:
        guided(names[0], seconds, keep, given.told)
    rows: dict[str, Counter[str]] = {}
    ended = 0
    for name in names:
        with tempfile.TemporaryDirectory() as folder:
            told = Path(folder, "counts.json")
            child = subprocess.run(
                [sys.executable, "-m", "tests.fuzz.guided", "--kind", name, "--keep", str(keep),
                 "--minutes", str(seconds / 60.0), "--told", str(told)],
            )  # fmt: skip
            rows[name] = Counter(json.loads(told.read_text()) if told.exists() else {})
            ended |= child.returncode
    print_table(rows)
    return int(bool(ended) or any(set(each) - {"read", "refused"} for each in rows.values()))


if __name__ == "__main__":
    sys.exit(main())

"""Accuracy of the time left of each long command, on an idle machine.

Runs commands in this process and records the calls of their progress line, with the processor time
spent until then. Other processes that want the processors hardly change that time, so the same run
on two idle processors is worked out from it: loading and building take as long as their processor
time, and the rest, which all processors share, half as long. Played back by that clock, the time
left tells how right the promised total is:

    python -m benchmarks.progress_records            # all commands; writes benchmarks/progress.md
    python -m benchmarks.progress_records dataset    # some of them

The records are data of tests/test_time_left.py, which plays them back, too.
"""

from __future__ import annotations

import json
import math
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from subprocess import run
from typing import Any

from optisense import usual_times
from optisense.time_left import TimedStep, TimeLeft

RECORDS = Path(__file__).parent.parent / "tests" / "assets" / "progress"
PAGE = Path(__file__).parent / "progress.md"

SHARES = (0.1, 0.25, 0.5, 0.75)
"""Shares of the total time at which the predicted total is compared with the real one."""

PROCESSORS = 2
"""Number of processors of the idle machine."""

SERIAL = ("loading", "building the scene", "writing the report")
"""Steps that run in one thread."""

OFTEN = 0.1
"""Smallest processor time (s) between two recorded parts of a piece."""

FEW = ["--set", "photons=1000000"]
COMMANDS = {
    "render": ["render", "gelsight-mini-ideal", "--contact", "sphere:1.5@0,0:0.8", "--out", "OUT"],
    "render, 20 million photons": [
        *[
            "render",
            "gelsight-mini-ideal",
            "--contact",
            "sphere:1.5@0,0:0.8",
            "--photons",
            "20000000",
        ],
        *["--out", "OUT"],
    ],
    "evaluate": ["evaluate", "gelsight-mini-ideal"],
    "evaluate, 5 seeds": ["evaluate", "gelsight-mini-ideal", "--seeds", "5", *FEW],
    "dataset, 20 samples": ["dataset", "gelsight-mini-ideal", "--count", "20", "--out", "OUT"],
    "dataset, 60 samples": ["dataset", "gelsight-mini-ideal", "--count", "60", "--out", "OUT"],
    "dataset, 700 samples": ["dataset", "gelsight-mini-ideal", "--count", "700", "--out", "OUT"],
    "task misalignment": ["task", "misalignment", "gelsight-mini-ideal", "--samples", "60"],
    "search by coating": [
        *[
            "search",
            "gelsight-mini-ideal",
            "--vary",
            "coating.specularity=0.1:0.5",
            "--budget",
            "9",
        ],
        *["--objective", "rgb2normal", *FEW, "--out", "OUT"],
    ],
    "search by rays": [
        *["search", "gelsight-svelte", "--vary", "cages.M1.points.x=+-8", "--budget", "100"],
        *["--objective", "aoap", "--out", "OUT"],
    ],
    "light-colours": [
        *["search", "gelsight-mini-ideal", "--vary", "lights.*.colour=R,G,B", "--method"],
        *["light-colours", "--objective", "rgb2normal", *FEW, "--out", "OUT"],
    ],
    "tolerance": [
        *["tolerance", "gelsight-svelte", "--objective", "aoap", "--sensors", "60"],
        *["--error", "cages.M1.points=0.05"],
    ],
}


class IdleClock:
    """Clock that returns the times of a record, s."""

    def __init__(self) -> None:
        """Start at 0."""
        self.now = 0.0

    def __call__(self) -> float:
        """Seconds."""
        return self.now


@contextmanager
def noted(found: list[dict[str, Any]]) -> Iterator[None]:
    """Record the calls of each `TimeLeft` in one dictionary for each that has steps."""
    methods = {name: getattr(TimeLeft, name) for name in ("__init__", "begin", "expect", "advance")}

    def begun(self: TimeLeft, steps: Any, workers: int = 1, clock: Any = time.monotonic) -> None:
        methods["__init__"](self, steps, workers, clock)
        if steps:
            plain = [asdict(step) for step in steps]
            record = {"began": time.process_time(), "workers": workers, "steps": plain}
            found.append(record | {"events": [], "of": id(self)})

    def noting(name: str) -> Callable[..., None]:
        def noted(self: TimeLeft, *args: Any, **named: Any) -> None:
            methods[name](self, *args, **named)
            if not found or found[-1]["of"] != id(self):
                return
            now, events = time.process_time(), found[-1]["events"]
            part = name == "advance" and len(args) + len(named) == 1
            if part and args[0] % 1.0 and events and now - events[-1][0] < OFTEN:
                return
            events.append([round(now, 3), name, list(args), named])

        return noted

    try:
        TimeLeft.__init__ = begun  # type: ignore[method-assign]
        for name in ("begin", "expect", "advance"):
            setattr(TimeLeft, name, noting(name))
        yield
    finally:
        for name, method in methods.items():
            setattr(TimeLeft, name, method)


def record(arguments: list[str]) -> dict[str, Any]:
    """Run a command of optisense in this process, and record its progress."""
    from optisense.cli.app import app

    usual_times.crowding = lambda: 1.0
    usual_times.processors = lambda: PROCESSORS
    found: list[dict[str, Any]] = []
    with tempfile.TemporaryDirectory() as folder, noted(found):
        try:
            app([each.replace("OUT", f"{folder}/out") for each in arguments])
        except SystemExit as end:
            if end.code:
                raise
    last = found[-1]
    del last["of"]
    return {"command": " ".join(arguments), **last, "ended": round(time.process_time(), 3)}


def promised(record: dict[str, Any], shares: tuple[float, ...] = SHARES) -> list[float]:
    """Return the predicted total time over the real one at shares of the total time.

    The last value is the total time, s. A value is NaN where no time left is shown.

    Args:
        record: record of a command.
        shares: shares of the total time, 0 to 1.
    """
    clock = IdleClock()
    names = [step["name"] for step in record["steps"]]
    known = names[0] in SERIAL
    clock.now = record["began"]
    left = TimeLeft([TimedStep(**step) for step in record["steps"]], record["workers"], clock)
    moments = [(0.0, math.nan), (clock.now, left.seconds_left if known else math.nan)]
    spent, step, ended = record["began"], names[0] if known else "", clock.now
    for at, name, args, named in [*record["events"], [record["ended"], "end", [], {}]]:
        while spent < at:  # look at the line in between, too
            slice_ = min(0.1, at - spent)
            spent += slice_
            clock.now += slice_ / (1 if step in SERIAL else PROCESSORS)
            moments.append((clock.now, left.seconds_left))
        if name == "advance" and len(args) > 1 and args[1] is not None:
            args = [args[0], clock.now - ended, *args[2:]]
        if name == "begin":
            step = args[0]
        if name in ("begin", "advance"):
            ended = clock.now
        if name != "end":
            getattr(left, name)(*args, **named)
            moments.append((clock.now, left.seconds_left))
    whole = clock.now
    found = []
    for share in shares:
        now, rest = next(each for each in reversed(moments) if each[0] <= share * whole)
        found.append((now + rest) / whole)
    return [*found, whole]


def page(records: dict[str, dict[str, Any]]) -> str:
    """Return the table of all commands as Markdown."""
    heads = " | ".join(f"{share:.0%}" for share in SHARES)
    rows = []
    for name, each in records.items():
        *ratios, whole = promised(each)
        shown = " | ".join("none" if math.isnan(ratio) else f"{ratio:.2f}" for ratio in ratios)
        rows.append(f"| {name} | {whole:.0f} | {shown} |")
    return "\n".join(
        [
            "# Accuracy of the estimated time of long commands",
            "",
            "The command `python -m benchmarks.progress_records` writes this page; do not edit it.",
            "",
            "The table gives the total time that the progress line estimates, divided by the "
            "actual total time, after parts of the latter. Seconds are those of two idle "
            "processors, computed from processor time.",
            "",
            f"| command | seconds | {heads} |",
            "|---|---|" + "---|" * len(SHARES),
            *rows,
            "",
        ]
    )


def file_of(name: str) -> Path:
    """Return the path of the record of a command."""
    return RECORDS / (name.replace(",", "").replace(" ", "-") + ".json")


def main() -> None:
    """Record commands, each in a process of its own, and write the page."""
    if sys.argv[1:2] == ["--one"]:
        name = sys.argv[2]
        text = json.dumps(record(COMMANDS[name]))
        file_of(name).write_text(text + "\n", encoding="utf-8")
        return
    RECORDS.mkdir(parents=True, exist_ok=True)
    for name in sys.argv[1:] or COMMANDS:
        run([sys.executable, "-m", "benchmarks.progress_records", "--one", name], check=True)
    records = {
        name: json.loads(file_of(name).read_text(encoding="utf-8"))
        for name in COMMANDS
        if file_of(name).exists()
    }
    PAGE.write_text(page(records), encoding="utf-8")


if __name__ == "__main__":
    main()

"""Comparison of a command's progress line on a terminal of 80 columns with its real progress.

Runs a command in a pseudo-terminal, looks at the screen twice a second, and tells how wide the
progress line is, which stages it names, how good its time left is, how long it stands still, and
how long the command takes to end after Ctrl-C:

    python -m benchmarks.progress_line -- evaluate gelsight-mini-ideal --seeds 3
    python -m benchmarks.progress_line --interrupt 20 -- tolerance gelsight-mini-ideal

Needs pyte, a terminal in Python (``pip install "optisense[bench]"``). POSIX only.
"""

from __future__ import annotations

import argparse
import fcntl
import json
import os
import pty
import re
import select
import signal
import struct
import sys
import termios
import time
from dataclasses import dataclass, field

import pyte

POLL_INTERVAL = 0.5
"""Time (s) between two readings of the screen."""

ROWS = 50
"""Number of rows of the terminal, enough for all messages of a command."""
SHARES = (0.1, 0.25, 0.5, 0.75)
"""Shares of the total time at which the predicted total is compared with the real one."""

LEFT = re.compile(r"((?:\d+:)?\d+:\d\d) left|left ((?:\d+:)?\d+:\d\d)")
CLOCK = re.compile(r"(?:\d+:)?\d+:\d\d")
LIVE = re.compile(r"[━─╸╺]|" + CLOCK.pattern)
"""Pattern of a bar or a clock, which distinguishes a progress line from the messages above it."""


@dataclass
class DesignView:
    """Progress line at one time.

    Attributes:
        seconds: time since the start, s.
        line: progress line.
        left: time left that it states, s; None if it states none.
    """

    seconds: float
    line: str
    left: float | None


@dataclass
class Watched:
    """Observations of a whole run.

    Attributes:
        looks: readings of the progress line, in order.
        seconds: duration of the run, s.
        code: exit code; minus the number of the signal that ended the run.
        obeyed: time from the first Ctrl-C to the end, s; None if none was pressed.
        answered: time from Ctrl-C until the screen mentioned it, s; None if it never did.
        screen: lines of the last screen.
    """

    looks: list[DesignView] = field(default_factory=list)
    seconds: float = 0.0
    code: int = 0
    obeyed: float | None = None
    answered: float | None = None
    screen: list[str] = field(default_factory=list)


def watch(command: list[str], columns: int, presses: list[float]) -> Watched:
    """Run a command in a terminal, and observe its screen.

    Args:
        command: program and arguments.
        columns: width of the terminal.
        presses: times (s) after which Ctrl-C is pressed.
    """
    pid, terminal = pty.fork()
    if pid == 0:
        os.execvp(command[0], command)
    fcntl.ioctl(terminal, termios.TIOCSWINSZ, struct.pack("HHHH", ROWS, columns, 0, 0))
    screen = pyte.Screen(columns, ROWS)
    stream = pyte.ByteStream(screen)
    found = Watched()
    began = time.monotonic()
    look_at, waiting, pressed = POLL_INTERVAL, list(presses), None
    while True:
        ready, _, _ = select.select([terminal], [], [], 0.05)
        now = time.monotonic() - began
        if ready:
            try:
                data = os.read(terminal, 65536)
            except OSError:
                break
            if not data:
                break
            stream.feed(data)
            if pressed is not None and found.answered is None and _answers(screen):
                found.answered = now - pressed
        if waiting and now >= waiting[0]:
            waiting.pop(0)
            pressed = pressed or now
            os.write(terminal, b"\x03")
        if now >= look_at:
            look_at += POLL_INTERVAL
            line = _line(screen)
            found.looks.append(DesignView(now, line, _left(line)))
    _, status = os.waitpid(pid, 0)
    found.seconds = time.monotonic() - began
    found.code = os.waitstatus_to_exitcode(status)
    found.obeyed = None if pressed is None else found.seconds - pressed
    found.screen = [line.rstrip() for line in screen.display if line.strip()]
    return found


def _answers(screen: pyte.Screen) -> bool:
    return any(re.search(r"Ctrl-C|interrupted|stopping", line) for line in screen.display)


def _line(screen: pyte.Screen) -> str:
    """Return the progress line: the lowest one with a bar or a clock, or else the lowest one."""
    lines = [line.rstrip() for line in screen.display]
    for number in range(len(lines) - 1, -1, -1):
        if LIVE.search(lines[number]):
            return lines[number]
    return next((line for line in reversed(lines) if line), "")


def _left(line: str) -> float | None:
    found = LEFT.search(line)
    if found is None:
        return None
    parts = [int(part) for part in (found[1] or found[2]).split(":")]
    return float(sum(part * 60**power for power, part in enumerate(reversed(parts))))


def _stage(line: str) -> str:
    """Return a line without its bar, clock and numbers, which change while a stage lasts."""
    plain = re.sub(r"[━─╸╺]+", " ", CLOCK.sub("", line))
    return re.sub(r"\s+", " ", re.sub(r"[-+]?\d[\d.,e]*", "#", plain)).strip()


def summary(found: Watched) -> dict[str, object]:
    """Return the figures of a run."""
    stages: list[str] = []
    for look in found.looks:
        stage = _stage(look.line)
        if stage and stage not in stages:
            stages.append(stage)
    still, longest, line, bare, longest_bare = 0.0, 0.0, None, 0.0, 0.0
    before = None
    for look in found.looks:
        still, line = (look.seconds, look.line) if look.line != line else (still, line)
        longest = max(longest, look.seconds - still)
        # Compared without the clock, which always advances.
        shown = CLOCK.sub("", look.line)
        bare, before = (look.seconds, shown) if shown != before else (bare, before)
        longest_bare = max(longest_bare, look.seconds - bare)
    promised = {}
    for share in SHARES:
        at = share * found.seconds
        look = next((each for each in found.looks if each.seconds >= at), None)
        ratio = None if look is None or look.left is None else look.seconds + look.left
        promised[f"{share:.0%}"] = None if ratio is None else round(ratio / found.seconds, 2)
    return {
        "seconds": round(found.seconds, 1),
        "exit code": found.code,
        "widest": max((len(look.line) for look in found.looks), default=0),
        "promised total over real": promised,
        "longest without any change": round(longest, 1),
        "longest without change but of the clock": round(longest_bare, 1),
        "Ctrl-C answered after": None if found.answered is None else round(found.answered, 2),
        "Ctrl-C obeyed after": None if found.obeyed is None else round(found.obeyed, 2),
        "stages": stages,
    }


def main() -> None:
    """Measure one command and print its figures as JSON."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--columns", type=int, default=80)
    parser.add_argument("--interrupt", type=float, action="append", default=[], metavar="SECONDS")
    parser.add_argument("--lines", action="store_true", help="print the line of each look too")
    parser.add_argument("--screen", action="store_true", help="print the last screen too")
    parser.add_argument("arguments", nargs="+", help="of optisense")
    given = parser.parse_args()
    command = [sys.executable, "-m", "optisense.cli", *given.arguments]
    signal.signal(signal.SIGINT, signal.default_int_handler)
    found = watch(command, given.columns, given.interrupt)
    if given.lines:
        for look in found.looks:
            print(f"{look.seconds:7.1f}  {look.line}")
    if given.screen:
        print("\n".join(found.screen))
    print(json.dumps(summary(found), indent=2, ensure_ascii=False))


if __name__ == "__main__":
    main()

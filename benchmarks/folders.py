"""Loss of work when several commands use one folder, or when one is killed.

``python -m benchmarks.folders [--repeats 12] [--only NAME]`` tries each case several times with
real processes, which start together or one while the other works. It prints for each case how often
something was lost. It needs only the command line, so it can test an earlier release: ``--optisense
/path/to/its/bin/optisense``.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

OBJECTIVE = '''
import os
from pathlib import Path

HERE = Path(__file__).parent

def fine(design):
    """The first call waits in a pipe until it is told to go on."""
    if (HERE / "wait").exists():
        (HERE / "asked").write_text("here")
        (HERE / "wait").read_text()
    return True

def score(evaluation):
    return evaluation.design.coating.specularity
'''

MATERIAL = """
description: number {number}
value: {{kind: dielectric, ior: 1.4, roughness: 0.{number}}}
sources: {{ior: {{status: assumed, source: a guess}}}}
"""


class Bench:
    """Starter of commands in a folder that no other command uses."""

    def __init__(self, program: Sequence[str], here: Path) -> None:
        self.here = here
        self._program = list(program)
        self._environment = {
            **os.environ,
            "OPTISENSE_LIBRARY": str(here / "library"),
            "XDG_STATE_HOME": str(here / "state"),
        }

    def start(self, *words: object) -> subprocess.Popen[str]:
        """Start a command and return its process."""
        return subprocess.Popen(
            [*self._program, *map(str, words)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            env=self._environment,
            cwd=self.here,  # else Python takes the program from the current folder
        )

    def run(self, *words: object) -> int:
        """Run a command and return its exit code."""
        process = self.start(*words)
        process.communicate()
        return process.returncode

    def search(self, *more: object) -> list[object]:
        """Return the arguments of a search of three trials."""
        mine = self.here / "mine.py"
        mine.write_text(OBJECTIVE)
        return ["search", "gelsight-mini-ideal", "--vary", "coating.specularity=0:1", "--budget", 3,
                "--method", "random", "-b", f"{mine}:score", "--rule", f"{mine}:fine",
                "--out", self.here / "study", *more]  # fmt: skip

    def waiting(self) -> subprocess.Popen[str]:
        """Start a search that waits in its first trial, and return its process."""
        pipe, asked = self.here / "wait", self.here / "asked"
        os.mkfifo(pipe)
        os.mkfifo(asked)
        process = self.start(*self.search())
        asked.read_text()
        return process

    def go(self) -> None:
        """Let the waiting search continue."""
        pipe = self.here / "wait"
        hidden = pipe.rename(pipe.with_name("wait-once"))
        hidden.write_text("go")


def resumed_while_it_runs(bench: Bench) -> bool:
    """A study is resumed while its first trial runs."""
    first = bench.waiting()
    bench.run("search", "--resume", "--out", bench.here / "study")
    bench.go()
    first.communicate()
    return bench.run("apply", bench.here / "study", "--out", bench.here / "better") != 0


def two_new_searches(bench: Bench) -> bool:
    """Two searches begin in one folder at once."""
    for process in [bench.start(*bench.search()) for _ in range(2)]:
        process.communicate()
    return bench.run("apply", bench.here / "study", "--out", bench.here / "better") != 0


def two_datasets(bench: Bench) -> bool:
    """Two datasets of other seeds begin in one folder at once."""
    out = bench.here / "dataset"
    sensors = ("gelsight-mini-ideal", "gelsight-mini-ideal")
    small = ["--count", 1, "--photons", 20000, "--resolution", "32x24"]
    processes = [
        bench.start("dataset", sensor, "--out", out, "--seed", seed, *small)
        for seed, sensor in enumerate(sensors)
    ]
    for process in processes:
        process.communicate()
    codes = [process.returncode for process in processes]
    if codes.count(0) != 1:
        return True
    winner = codes.index(0)
    info = json.loads((out / "dataset.json").read_text())
    again = bench.run("dataset", sensors[winner], "--out", out, "--seed", winner, *small)
    return info["settings"]["seed"] != winner or again != 0


def two_parts_of_one_name(bench: Bench) -> bool:
    """Two library entries of one name are added at once."""
    files = []
    for number in (1, 2):
        file = bench.here / str(number) / "twin.yaml"
        file.parent.mkdir()
        file.write_text(MATERIAL.format(number=number))
        files.append(file)
    processes = [bench.start("library", "add", file) for file in files]
    for process in processes:
        process.communicate()
    return [process.returncode for process in processes].count(0) != 1


def file_of_the_user(bench: Bench) -> bool:
    """A user's file lies in the folder of a search that fails before its first trial."""
    first = bench.waiting()
    notes = bench.here / "study" / "notes.txt"
    notes.write_text("mine")
    first.kill()
    first.communicate()
    bench.run("search", "--resume", "--out", bench.here / "study", "--cluster", "tcp://127.0.0.1:9")
    return not notes.exists()


def killed(words: Callable[[Bench], list[object]], bench: Bench) -> bool:
    """A command is killed at a random moment and given again."""
    given = words(bench)
    folder = Path(str(given[-1]))
    process = bench.start(*given)
    until = random.random()
    while process.poll() is None and not (folder.exists() and random.random() < until):
        pass
    process.send_signal(signal.SIGKILL)
    process.communicate()
    if bench.run(*given) == 0:
        return False
    if given[0] == "search":
        return bench.run("search", "--resume", "--out", folder) != 0
    return bench.run("check", folder) != 0  # it had ended before it was killed


def new_killed(bench: Bench) -> bool:
    """`new` is killed at a random moment and given again."""
    return killed(lambda bench: ["new", "gelsight-mini-ideal", bench.here / "design"], bench)


def search_killed(bench: Bench) -> bool:
    """`search` is killed while it begins, and given again or resumed."""
    return killed(lambda bench: bench.search(), bench)


def apply_killed(bench: Bench) -> bool:
    """`apply` is killed at a random moment and given again."""
    bench.run(*bench.search())
    return killed(lambda b: ["apply", b.here / "study", "--out", b.here / "better"], bench)


CASES: dict[str, Callable[[Bench], bool]] = {
    each.__name__.replace("_", "-"): each
    for each in (
        resumed_while_it_runs,
        two_new_searches,
        two_datasets,
        two_parts_of_one_name,
        file_of_the_user,
        new_killed,
        search_killed,
        apply_killed,
    )
}


def main() -> None:
    """Try the cases and print a table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.folders", description=__doc__)
    parser.add_argument("--repeats", type=int, default=12, help="of each case")
    parser.add_argument("--only", choices=CASES, action="append", help="these cases only")
    parser.add_argument("--optisense", help="the program to try; this release if left out")
    given = parser.parse_args()
    program = [given.optisense] if given.optisense else [sys.executable, "-m", "optisense.cli"]
    print("| what is tried | lost |\n|---|---|")
    for name in given.only or CASES:
        lost = 0
        for _ in range(given.repeats):
            here = Path(tempfile.mkdtemp(prefix="optisense-folders-"))
            try:
                lost += CASES[name](Bench(program, here))
            finally:
                shutil.rmtree(here)
        about = (CASES[name].__doc__ or name).splitlines()[0].rstrip(".")
        print(f"| {about} | {lost} of {given.repeats} |", flush=True)


if __name__ == "__main__":
    main()

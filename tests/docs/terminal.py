"""A reader's terminal and Python session, which keep their state between blocks."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import tempfile
import threading
import time
from dataclasses import dataclass
from pathlib import Path

_LEFT_OUT = ("PYTHON", "VIRTUAL_ENV", "MAKE", "MFLAGS", "PYTEST", "OPTISENSE_")
"""Beginnings of the environment variables that come from the test run and not from a reader."""

_SESSION = """
import json, linecache, sys, traceback
names = {"__name__": "__main__"}
answers = sys.stdout
sys.stdout = sys.stderr  # what the blocks print
for line in sys.stdin:
    place, text = json.loads(line)
    linecache.cache[place] = (len(text), None, text.splitlines(True), place)
    error = ""
    try:
        exec(compile(text, place, "exec"), names)
    except BaseException:
        error = traceback.format_exc()
    print(json.dumps(error), file=answers, flush=True)
"""
"""Runs one block for each line of standard input, all with the same names, and answers with the
traceback or an empty text. Tracebacks show the block's lines."""


@dataclass(frozen=True)
class Outcome:
    """How a command or a Python block ended."""

    exit_code: int
    output: str
    """Standard output and standard error as they came; of Python, the traceback."""
    seconds: float


def reader_environment(own: Path) -> dict[str, str]:
    """The environment of somebody who reads the page: that of the tests without what is theirs.

    The folder `own` takes what commands keep for a user: parts that are added to the library, and
    which files were named before. The home folder stays, with the kernels that are compiled.
    """
    kept = {name: value for name, value in os.environ.items() if not name.startswith(_LEFT_OUT)}
    return kept | {
        "OPTISENSE_LIBRARY": str(own / "library"),
        "XDG_STATE_HOME": str(own / "state"),
        "TERM": "dumb",
    }


class Terminal:
    """A shell in a folder, and a Python session beside it in the same folder.

    The folder, the exported variables and an activated virtual environment last from one command
    to the next. Python is the `python` that the shell finds when the first block is typed.
    """

    def __init__(self, folder: Path, environment: dict[str, str]) -> None:
        self.folder = folder
        self._environment = environment
        self._state = tempfile.TemporaryDirectory(prefix="terminal-")
        self._python: subprocess.Popen[str] | None = None

    def type(self, command: str, *, enter: bool = False, limit: float) -> Outcome:
        """Run a command of the shell, for `limit` seconds at most.

        Standard input is a terminal. With `enter` somebody presses Enter at each question.
        Raises subprocess.TimeoutExpired, after the command and its children were killed.
        """
        begin = time.monotonic()
        keyboard, standard_input = os.openpty()
        try:
            if enter:
                os.write(keyboard, b"\n" * 200)
            child = subprocess.Popen(
                ["bash", "-c", self._script(command)],
                stdin=standard_input,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                cwd=self.folder,
                env=self._environment,
                text=True,
                start_new_session=True,
            )
            try:
                output, _ = child.communicate(timeout=limit)
            except subprocess.TimeoutExpired:
                os.killpg(child.pid, signal.SIGKILL)
                child.communicate()
                raise
        finally:
            os.close(keyboard)
            os.close(standard_input)
        return Outcome(child.returncode, output, time.monotonic() - begin)

    def type_python(self, text: str, place: str, *, limit: float) -> Outcome:
        """Run a block in the Python session, for `limit` seconds at most.

        `place` is the file name that tracebacks show. Exit code 1 stands for an exception that the
        block raises, and for a session that was killed at the limit.
        """
        begin = time.monotonic()
        if self._python is None:
            self._python = self._start_python()
        python = self._python
        assert python.stdin is not None and python.stdout is not None
        watch = threading.Timer(limit, python.kill)
        watch.start()
        try:
            python.stdin.write(json.dumps([place, text]) + "\n")
            python.stdin.flush()
            answer = python.stdout.readline()
        finally:
            watch.cancel()
        error = json.loads(answer) if answer else f"Python ended with {python.wait()}"
        return Outcome(1 if error else 0, error, time.monotonic() - begin)

    def close(self) -> None:
        """End the Python session."""
        if self._python is not None:
            assert self._python.stdin is not None
            self._python.stdin.close()
            self._python.wait()
        self._state.cleanup()

    def __enter__(self) -> Terminal:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _script(self, command: str) -> str:
        """The command between what brings the state of the shell back and what keeps it."""
        state = Path(self._state.name)
        before = f'. "{state}/exported"; cd "$(cat "{state}/folder")"\n'
        after = f'\ncode=$?; export -p > "{state}/exported"; pwd > "{state}/folder"; exit $code'
        return (before if (state / "folder").exists() else "") + command + after

    def _start_python(self) -> subprocess.Popen[str]:
        return subprocess.Popen(
            ["bash", "-c", self._script('exec python -c "$SESSION"')],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            cwd=self.folder,
            env=self._environment | {"SESSION": _SESSION},
            text=True,
        )

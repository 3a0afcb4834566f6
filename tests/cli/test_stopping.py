"""Ctrl-C and SIGTERM: an answer at once, and an end that can be relied on."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")

BUSY = """
import hashlib, signal
signal.signal(signal.SIGINT, signal.default_int_handler)  # it may be ignored where tests run
from optisense.cli import stopping
stopping.watch()
signal.signal(signal.SIGINT, lambda number, frame: None)  # held back, as during a trial
with stopping.waiting({waits}):
    print("ready", flush=True)
    # Longer than any test, without a moment in which Python could handle a signal.
    hashlib.pbkdf2_hmac("sha256", b"", b"", 2**31 - 1)
"""

COMMAND = """
import signal
signal.signal(signal.SIGINT, signal.default_int_handler)
from optisense.cli import stopping
from optisense.cli.console import ends_well
from optisense.cli.leaving import run_and_leave
import typer

app = typer.Typer(add_completion=False)

@app.command()
@ends_well
def wait():
    print("ready", flush=True)
    while True:
        signal.pause()

stopping.watch()
run_and_leave(app)
"""

IMPORTING = """
import signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)

class PressesCtrlC:
    def find_spec(self, name, path=None, target=None):
        if name == "optisense.cli.app":
            signal.raise_signal(signal.SIGINT)

sys.meta_path.insert(0, PressesCtrlC())
from optisense.__main__ import main
main()
"""


@contextmanager
def ready(program: str) -> Iterator[subprocess.Popen[str]]:
    """A child that has come as far as it says."""
    child = subprocess.Popen(
        [sys.executable, "-c", program],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert child.stdout is not None
        assert child.stdout.readline() == "ready\n"
        yield child
    finally:
        child.kill()
        child.communicate()


@pytest.mark.parametrize(
    ("first", "answer", "code"),
    [
        (signal.SIGINT, "Ctrl-C: {}; press again to stop at once\n", 130),
        (signal.SIGTERM, "SIGTERM: {}; another one stops at once\n", 143),
    ],
)
def test_what_is_waited_for_is_told_while_the_renderer_computes_and_again_stops(
    first: signal.Signals, answer: str, code: int
) -> None:
    what = "finishing trial 7, about 12 s"
    with ready(BUSY.format(waits=f"lambda: {what!r}")) as child:
        assert child.stderr is not None
        child.send_signal(first)
        assert child.stderr.readline() == answer.format(what)
        child.send_signal(first)
        assert child.wait() == code
        assert child.stderr.read() == "stopped at once\n"


def test_without_a_wait_silence_is_broken() -> None:
    with ready(BUSY.format(waits="None")) as child:
        assert child.stderr is not None
        child.send_signal(signal.SIGINT)
        assert "stopping after the step at hand" in child.stderr.readline()


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_command_ends_with_the_code_of_its_signal(number: signal.Signals, code: int) -> None:
    with ready(COMMAND) as child:
        child.send_signal(number)
        assert child.wait() == code
        assert child.stderr is not None
        assert child.stderr.read() == "interrupted\n"


def test_ctrl_c_while_python_imports_shows_no_traceback() -> None:
    child = subprocess.run([sys.executable, "-c", IMPORTING], capture_output=True, text=True)
    assert child.returncode == -signal.SIGINT
    assert child.stderr == ""

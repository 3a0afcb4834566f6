"""Ctrl-C and SIGTERM are acknowledged at once and reliably end a command."""

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
stopping.install_handlers()
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
from optisense.cli.console import handles_errors
from optisense.cli.leaving import run_and_leave
import typer

app = typer.Typer(add_completion=False)

@app.command()
@handles_errors
def command():
    {body}

stopping.install_handlers()
run_and_leave(app)
"""

WAITING = COMMAND.format(body='print("ready", flush=True)\n    while True: signal.pause()')

EXECUTING = COMMAND.format(
    body='exec("import signal; signal.raise_signal(signal.SIGINT)\\nfor _ in range(9): pass")'
)

RETURNING = COMMAND.format(
    body='raise SystemError("returned a result with an exception set") from KeyboardInterrupt()'
)

IMPORTING = """
import signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)

class Presses:
    def find_spec(self, name, path=None, target=None):
        if name == "{module}":
            signal.raise_signal({number})

sys.meta_path.insert(0, Presses())
sys.argv[1:] = {words}
from optisense.__main__ import main
main()
"""

LEAVING = """
import atexit, signal
signal.signal(signal.SIGINT, signal.default_int_handler)
from optisense.cli import stopping
from optisense.cli.leaving import run_and_leave
atexit.register(signal.raise_signal, {number})
def command():
    raise SystemExit(7)
stopping.install_handlers()
run_and_leave(command)
"""


OUTSIDE = """
import signal
signal.signal(signal.SIGINT, signal.default_int_handler)
from optisense import starting
from optisense.cli import stopping
from optisense.cli.leaving import run_and_leave
def command():
    signal.raise_signal({number})
    for _ in range(9): pass
stopping.install_handlers()
starting.begin()
run_and_leave(command)
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
        assert "stopping after the current step" in child.stderr.readline()


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_command_ends_with_the_code_of_its_signal(number: signal.Signals, code: int) -> None:
    with ready(WAITING) as child:
        child.send_signal(number)
        assert child.wait() == code
        assert child.stderr is not None
        assert child.stderr.read() == "interrupted\n"


def in_the_background(program: str) -> str:
    """A program as a shell begins it in the background: Ctrl-C is ignored."""
    return program.replace("signal.default_int_handler", "signal.SIG_IGN")


def test_where_ctrl_c_is_ignored_sigterm_ends_a_command_and_ctrl_c_does_not() -> None:
    with ready(in_the_background(WAITING)) as child:
        child.send_signal(signal.SIGINT)
        with pytest.raises(subprocess.TimeoutExpired):
            child.wait(0.3)
        child.send_signal(signal.SIGTERM)
        assert child.wait() == 143
        assert child.stderr is not None
        assert child.stderr.read() == "interrupted\n"


SIGNALS = pytest.mark.parametrize(
    ("number", "code"), [(int(signal.SIGINT), 130), (int(signal.SIGTERM), 143)]
)


def ended(program: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)


@pytest.mark.parametrize(
    ("number", "words", "module"),
    [
        (signal.SIGINT, ["check", "gelsight-mini-ideal"], "optisense.cli.app"),
        (signal.SIGTERM, ["check", "gelsight-mini-ideal"], "optisense.cli.app"),
        (signal.SIGINT, ["library", "list"], "optisense.cli.library"),
        (
            signal.SIGTERM,
            ["export", "gelsight-mini-ideal", "--out", "/nowhere"],
            "optisense.cli.export",
        ),
        (signal.SIGINT, ["check", "gelsight-mini-ideal"], "numpy._core.multiarray"),
        (signal.SIGTERM, ["ledger", "gelsight-mini-ideal"], "drjit.ast"),
    ],
)
def test_a_signal_while_python_imports_ends_the_command_in_a_word(
    number: signal.Signals, words: list[str], module: str
) -> None:
    child = ended(IMPORTING.format(module=module, number=int(number), words=words))
    assert child.stderr == "interrupted\n"
    assert child.returncode == 128 + number


def test_sigterm_amid_an_import_is_not_lost_where_ctrl_c_is_ignored() -> None:
    number, words = int(signal.SIGTERM), ["ledger", "gelsight-mini-ideal"]
    program = IMPORTING.format(module="drjit.ast", number=number, words=words)
    child = ended(in_the_background(program))
    assert child.stderr == "interrupted\n"
    assert child.returncode == 143


def test_ctrl_c_that_compiled_code_did_not_raise_ends_the_command_in_a_word() -> None:
    """As Python reports it for a compiled function that returned although Ctrl-C was pressed."""
    child = ended(RETURNING)
    assert child.stderr == "interrupted\n"
    assert child.returncode == 130


def test_ctrl_c_in_code_that_is_executed_gives_the_usual_code() -> None:
    """Python 3.11 remembers such an interrupt although it was handled, and ends by a signal."""
    child = ended(EXECUTING)
    assert child.stderr == "interrupted\n"
    assert child.returncode == 130


@SIGNALS
def test_a_signal_while_a_usage_error_is_printed_ends_in_a_word(number: int, code: int) -> None:
    """Typer prints these outside of the command."""
    child = ended(OUTSIDE.format(number=number))
    assert child.stderr == "interrupted\n"
    assert child.returncode == code


@SIGNALS
def test_a_signal_at_the_end_leaves_the_result_as_it_is(number: int, code: int) -> None:
    assert code not in (7, 0)
    child = ended(LEAVING.format(number=number))
    assert child.stderr == ""
    assert child.returncode == 7

"""Forks of a warm Python behave as `python` and `optisense` do."""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from warm_python import can_fork, warm_python

pytestmark = pytest.mark.skipif(not can_fork(), reason="forks of the renderer need Linux")

Begin = Callable[..., "subprocess.Popen[str]"]


@pytest.fixture(scope="module")
def begin(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Begin]:
    """Starts one of the programs in a folder."""
    own = tmp_path_factory.mktemp("own")
    environment = {**os.environ, "OPTISENSE_LIBRARY": str(own)}
    with warm_python(environment, render=False) as programs:

        def start(*words: str, folder: Path = own, **more: str) -> subprocess.Popen[str]:
            return subprocess.Popen(
                [str(programs / words[0]), *words[1:]],
                cwd=folder,
                env={**environment, **more},
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
            )

        yield start


def test_streams_arguments_folder_environment_and_code_are_the_callers(
    begin: Begin, tmp_path: Path
) -> None:
    script = "import os, sys; print(sys.stdin.read(), sys.argv[1:], os.getcwd(), os.environ['A']);"
    child = begin("python", "-c", script + "sys.exit(7)", "x", folder=tmp_path, A="b")
    out, error = child.communicate("typed")
    assert (out, error, child.returncode) == (f"typed ['x'] {tmp_path} b\n", "", 7)


def test_a_fork_runs_on_the_processors_of_its_caller(begin: Begin) -> None:
    begin("python", "-c", "").wait()  # the process that forks has all processors
    ours = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(ours)})
    try:
        child = begin("python", "-c", "import os; print(*os.sched_getaffinity(0))")
        assert child.communicate()[0] == f"{min(ours)}\n"
    finally:
        os.sched_setaffinity(0, ours)


def test_scripts_and_modules_import_what_is_beside_them(begin: Begin, tmp_path: Path) -> None:
    (tmp_path / "beside.py").write_text("name = __name__\n")
    (tmp_path / "script.py").write_text("import beside, sys; print(__name__, beside.name)\n")
    for words in (["script.py"], ["-m", "script"]):
        child = begin("python", *words, folder=tmp_path)
        assert child.communicate() == ("__main__ beside\n", "")
        assert child.returncode == 0


def test_an_exception_is_shown_and_an_error_has_its_code(begin: Begin, tmp_path: Path) -> None:
    child = begin("python", "-c", "1 / 0")
    assert child.communicate()[1].endswith("ZeroDivisionError: division by zero\n")
    assert child.returncode == 1
    child = begin("optisense", "check", "nosuch", folder=tmp_path)
    assert "no built-in sensor and no folder 'nosuch'" in child.communicate()[1]
    assert child.returncode == 2


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_signals_reach_the_fork(begin: Begin, number: int, tmp_path: Path) -> None:
    """Also where only the caller is killed, as at a time limit."""
    script = (
        "import os, signal, time; signal.signal(signal.SIGINT, lambda *_: os._exit(130));"
        "print(os.getpid(), flush=True); time.sleep(600)"
    )
    child = begin("python", "-c", script)
    assert child.stdout is not None
    fork = int(child.stdout.readline())
    child.send_signal(number)
    child.communicate()
    assert child.returncode == (130 if number == signal.SIGINT else -number)
    while Path(f"/proc/{fork}").exists():
        os.sched_yield()

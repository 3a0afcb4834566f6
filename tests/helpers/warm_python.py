"""A `python` and an `optisense` that begin within hundredths of a second, for tests that run many.

A process that renders spends half of its time on imports and on the renderer's start. Here one
process does this once and forks for each program that is run; a program in a folder of its own asks
it to. The fork has the caller's folder, environment, arguments and standard streams, hears its
signals, runs on its processors, and gives it its exit code. Tests with forks do not test what a
process does before its first line. Python that such a program starts by `sys.executable` is a fork,
too.

`make test` starts one such process for all its targets, and names its folder of programs in the
environment variable `WARM_PYTHON`.
"""

from __future__ import annotations

import atexit
import contextlib
import gc
import json
import os
import select
import signal
import socket
import struct
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any, NoReturn

CLIENT = """#!{python} -IS
import array, json, os, select, signal, socket, sys
asked = socket.socket(socket.AF_UNIX)
asked.connect({address!r})
def hand_on(number, frame):
    asked.send(bytes([number]))
for number in (signal.SIGINT, signal.SIGTERM):
    if signal.getsignal(number) is not signal.SIG_IGN:
        signal.signal(number, hand_on)
text = json.dumps([{name!r}, sys.argv[1:], os.getcwd(), dict(os.environ)]).encode()
asked.sendmsg(
    [len(text).to_bytes(4, "big")],
    [(socket.SOL_SOCKET, socket.SCM_RIGHTS, array.array("i", [0, 1, 2]))],
)
asked.sendall(text)
code = int(asked.recv(8))
if code < 0:
    if -code != signal.SIGKILL:
        signal.signal(-code, signal.SIG_DFL)
    os.kill(os.getpid(), -code)
os._exit(code)
"""
"""The program that asks for a fork. It needs no module that takes time to load."""


def can_fork() -> bool:
    """Return whether such a process works here: macOS' own libraries must not be used in forks."""
    return sys.platform == "linux"


@contextlib.contextmanager
def warm_python(
    environment: dict[str, str], *, python: str = sys.executable, render: bool = True
) -> Iterator[Path]:
    """Start the process, and yield the folder with the programs `python` and `optisense`, which
    wait for its imports.

    Args:
        environment: what modules find in the environment when they are imported.
        python: that of the environment that `optisense` is installed in.
        render: whether it renders once, which loads the kernels.
    """
    with tempfile.TemporaryDirectory(prefix="warm-") as folder:
        server = subprocess.Popen(
            [python, __file__, folder, *(["--render"] if render else [])],
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )
        assert server.stdin is not None and server.stdout is not None
        assert server.stdout.readline() == b"ready\n", "the process did not start"
        try:
            yield Path(folder)
        finally:
            server.stdin.close()  # which ends it
            server.wait()


_shared = contextlib.ExitStack()
atexit.register(_shared.close)


@cache
def programs(python: str = sys.executable) -> Path:
    """Return a folder with the programs `python` and `optisense`, which all tests of a run share,
    and all targets of `make test`.

    They are the real ones where a process cannot fork.

    Args:
        python: that of the environment that `optisense` is installed in.
    """
    if not can_fork():
        return Path(python).parent
    if "WARM_PYTHON" in os.environ:
        return Path(os.environ["WARM_PYTHON"])
    return _shared.enter_context(warm_python(dict(os.environ), python=python))


def end_programs() -> None:
    """End the processes of `programs`, for a run whose process leaves without its own end."""
    _shared.close()


def import_all() -> None:
    """Import what commands import, and start the renderer with one thread: forks keep no others."""
    from optisense.optics.backend.variant import import_renderer, use_variant

    use_variant("llvm")
    import_renderer("drjit").set_thread_count(1)
    # Commands load these only when they need them, as each takes up to a second.
    for name in ("matplotlib.figure", "scipy.stats", "sklearn.ensemble", "sklearn.neural_network"):
        import_module(name)
    with contextlib.suppress(ImportError):  # the extra 'step'
        import_module("OCP.STEPCAFControl")

    import optisense.cli
    import optisense.commands.rendering
    import optisense.objectives
    import optisense.optics._model
    import optisense.report
    import optisense.search
    import optisense.sensors
    import optisense.tasks  # noqa: F401


def render() -> None:
    """Render once."""
    from optisense import Contact, OpticalModel, Sphere, load
    from optisense.optics.backend.memory import release_memory

    ball = Contact(Sphere(radius=1.5), at=(0, 0), depth=0.5)
    OpticalModel(load("gelsight-mini")).render([ball], resolution=(64, 48), photons=50000)
    release_memory()  # else a fork that writes to it would copy it


def serve(folder: Path, rendering: bool) -> None:
    """Write the programs to a folder, and fork for each request until standard input is closed."""
    address = str(folder / "asked")
    with socket.socket(socket.AF_UNIX) as asked:
        asked.bind(address)
        asked.listen()
        for name in ("python", "optisense"):
            text = CLIENT.format(python=sys.executable, address=address, name=name)
            (folder / name).write_text(text, encoding="utf-8")
            (folder / name).chmod(0o755)
        os.write(1, b"ready\n")
        import_all()
        if rendering:
            render()
        gc.collect()
        gc.freeze()  # else the collections of a fork would copy the pages of all objects
        while True:
            ready, _, _ = select.select([asked, 0], [], [])
            with contextlib.suppress(ChildProcessError):  # where all have ended
                while os.waitpid(-1, 0 if 0 in ready else os.WNOHANG)[0]:
                    pass
            if 0 in ready:
                return
            caller, _ = asked.accept()
            if os.fork() == 0:
                asked.close()
                sys.executable = str(folder / "python")
                handle(caller)
            caller.close()


def handle(caller: socket.socket) -> NoReturn:
    """Run one program in a fork of this one, which hands signals on and tells the exit code."""
    size = struct.calcsize("3i")
    pid, _, _ = struct.unpack("3i", caller.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, size))
    with contextlib.suppress(OSError):  # where the caller has gone
        os.sched_setaffinity(0, os.sched_getaffinity(pid))
    head, streams, _, _ = socket.recv_fds(caller, 4, 3)
    text = b""
    while len(text) < int.from_bytes(head, "big"):
        text += caller.recv(1 << 16)
    child = os.fork()
    if child == 0:
        caller.close()
        os.setsid()
        run(streams, *json.loads(text))
    for stream in streams:
        os.close(stream)
    ended = os.pidfd_open(child)
    while True:
        ready, _, _ = select.select([ended, caller], [], [])
        if ended in ready:
            break
        number = caller.recv(1)
        os.kill(child, number[0] if number else signal.SIGKILL)  # the caller was killed
        if not number:
            os._exit(0)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    with contextlib.suppress(OSError):
        caller.send(str(code).encode())
    os._exit(0)


def run(
    streams: list[int], name: str, arguments: list[str], folder: str, environment: dict[str, str]
) -> NoReturn:
    """Do what `python` or `optisense` does with these arguments, and end."""
    import runpy

    atexit._clear()  # of the renderer, whose other threads are not here
    for number, stream in enumerate(streams):
        os.dup2(stream, number)
        os.close(stream)
    sys.stdin = open(0, closefd=False)  # noqa: SIM115
    sys.stdout = open(1, "w", closefd=False)  # noqa: SIM115
    sys.stderr = open(2, "w", buffering=1, errors="backslashreplace", closefd=False)  # noqa: SIM115
    os.chdir(folder)
    os.environ.clear()
    os.environ.update(environment)
    sys.path[1:1] = filter(None, environment.get("PYTHONPATH", "").split(os.pathsep))
    signal.signal(signal.SIGINT, signal.default_int_handler)

    def work() -> Any:
        if name == "optisense":
            sys.argv = [str(Path(sys.executable).with_name("optisense")), *arguments]
            sys.path[0] = str(Path(sys.executable).parent)
            from optisense.__main__ import main

            return main()
        kind, rest = arguments[0], arguments[1:]
        sys.path[0] = ""
        if kind == "-m":
            sys.argv = rest
            return runpy.run_module(rest[0], run_name="__main__", alter_sys=True)
        sys.argv = [kind, *rest[1 if kind == "-c" else 0 :]]
        if kind == "-c":
            return exec(compile(rest[0], "<string>", "exec"), {"__name__": "__main__"})
        sys.path[0] = str(Path(kind).parent.absolute())
        return runpy.run_path(kind, run_name="__main__")

    from optisense.cli.leaving import run_and_leave

    try:
        run_and_leave(work)
    except BaseException:
        sys.excepthook(*sys.exc_info())  # type: ignore[arg-type]
        sys.stdout.flush()
        os._exit(1)


if __name__ == "__main__":
    serve(Path(sys.argv[1]), "--render" in sys.argv)

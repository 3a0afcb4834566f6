"""The output of a command is complete and its exit code is right, however it ends."""

from __future__ import annotations

import subprocess
import sys

import pytest

PROGRAM = """
import atexit, sys, types
from optisense.cli.leaving import run_and_leave
if {renderer}:
    sys.modules["drjit"] = types.ModuleType("drjit")
atexit.register(lambda: print("closed"))
def command():
    print("x" * 200_000)
    raise SystemExit({code!r})
run_and_leave(command)
"""


@pytest.mark.parametrize("renderer", [False, True])
@pytest.mark.parametrize(("code", "expected"), [(0, 0), (None, 0), (130, 130), ("why", 1)])
def test_output_is_whole_and_the_code_is_the_commands(
    renderer: bool, code: object, expected: int
) -> None:
    program = PROGRAM.format(renderer=renderer, code=code)
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.returncode == expected
    assert done.stdout.startswith("x" * 200_000)
    assert done.stdout.endswith("closed\n")
    assert ("why" in done.stderr) == (code == "why")

"""A command that is killed at any of its steps on the disk is given again, and ends well.

Every call that opens, makes, renames or removes a file in the folder is a step: Python tells of
each by an audit event. A process is killed at its first step, another at its second, and so on
until one comes to its end.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = '''
import os
import signal
import sys
from pathlib import Path

import optisense as ots
from optisense.search import Plan, SearchSpace, Study
from optisense.sensors import gelsight_mini_ideal, save_design

EVENTS = {"open", "os.mkdir", "os.rename", "os.remove", "os.rmdir", "sqlite3.connect"}
MINI = gelsight_mini_ideal(tessellation=4.0)  # whose files are written at once
SPACE = SearchSpace({"coating.specularity": (0.0, 1.0)})
HERE = Path(sys.argv[2])

def score(design):
    return design.coating.specularity

def new(folder):
    save_design(MINI, folder, new=True)

def design_again(folder):
    ots.load(folder)

def begin(folder):
    Study.create(folder, MINI, Plan(space=SPACE, goals=[score])).close()

def begin_again(folder):
    Study.open(folder, goals=[score]).close()

COMMANDS = {
    "new": (new, design_again),
    "search": (begin, begin_again),
}

def steps_of(folder, at):
    """Count the steps on a folder, and die at one of them."""
    count = 0
    def hook(event, args):
        nonlocal count
        if event in EVENTS and args and str(folder) in str(args[0]):
            count += 1
            if count == at:
                os.kill(os.getpid(), signal.SIGKILL)
    sys.addaudithook(hook)

def in_child(work):
    child = os.fork()
    if not child:
        try:
            work()
        except BaseException as error:
            print("failed:", type(error).__name__, error, flush=True)
            os._exit(1)
        os._exit(0)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])

command, opened = COMMANDS[sys.argv[1]]
command(HERE / "before")  # loads once what all children need
opened(HERE / "before")
killed = 0
for at in range(1, 1000):
    folder = HERE / "out" / str(at)
    def first():
        steps_of(folder, at)
        command(folder)
    ended = in_child(first)
    if ended == 0:
        break
    assert ended == -signal.SIGKILL, ended
    killed += 1
    again = in_child(lambda: command(folder))
    if again != 0:  # then it had come to its end before it was killed
        assert in_child(lambda: opened(folder)) == 0, at
    strange = [path.name for path in folder.rglob(".*") if again == 0]
    assert not strange, (at, strange)
print("killed", killed)
'''


@pytest.mark.slow
@pytest.mark.parametrize("command", ["new", "search"])
def test_it_is_given_again_and_ends_well(command: str, tmp_path: Path) -> None:
    found = subprocess.run(
        [sys.executable, "-c", SCRIPT, command, str(tmp_path)],
        capture_output=True,
        text=True,
    )
    assert found.returncode == 0, found.stdout + found.stderr
    assert int(found.stdout.split()[-1]) >= 10
    print(found.stdout)

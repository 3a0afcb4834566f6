"""Designs and spaces that searches are tested on; nothing here renders."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from types import ModuleType

import pytest

import optisense as ots
from optisense.design import SensorDesign
from optisense.search.space.search_space import BoundSpace, SearchSpace
from optisense.sensors import gelsight_svelte

TWO_NUMBERS = {"coating.specularity": (0.0, 1.0, 5), "camera.position.x": (-1.0, 3.0, 3)}
"""A space in which `cheap_goals` make sense."""


@pytest.fixture(scope="session")
def mini() -> SensorDesign:
    return ots.load("gelsight-mini-ideal")


@pytest.fixture(scope="session")
def svelte() -> SensorDesign:
    return ots.load("gelsight-svelte")


@pytest.fixture(scope="session")
def coarse_svelte() -> SensorDesign:
    """A GelSight Svelte of few triangles."""
    return gelsight_svelte(tessellation=1.0, m1_grid=(60, 15))


@pytest.fixture(scope="session")
def two_numbers(mini: SensorDesign) -> BoundSpace:
    """Two numbers that are independent in all checks."""
    return SearchSpace(TWO_NUMBERS).bind(mini)


@pytest.fixture(scope="session")
def mixed(mini: SensorDesign) -> BoundSpace:
    """A number, a whole number and names."""
    group = next(iter(mini.lights))
    return SearchSpace(
        {
            "coating.specularity": (0.0, 1.0, 3),
            f"lights.{group}.colour": ["red", "green", "blue"],
            "camera.resolution[0]": (100, 104),
        }
    ).bind(mini)


GOALS = '''
import os
import signal
import time
from pathlib import Path

def nearness(design):
    """Highest, 0, at a specularity of 0.3 and a camera at x = 0.5."""
    return -((design.coating.specularity - 0.3) ** 2) - (design.camera.position[0] - 0.5) ** 2

def brightness(design):
    return design.coating.specularity

def told(design):
    """The same as `nearness`, and tells that it was asked, in a file.

    The call after KILL_AT others kills the study's own process, as a power cut would.
    """
    log = Path(os.environ["TRIAL_LOG"])
    place = [design.coating.specularity, design.camera.position[0], os.getpid()]
    with log.open("a") as file:
        file.write(" ".join(map(repr, place)) + "\\n")
    if len(log.read_text().splitlines()) == int(os.environ.get("KILL_AT", "-1")):
        study = os.getpid() if os.environ["WORKERS"] == "1" else os.getppid()
        os.kill(study, signal.SIGKILL)
    return nearness(design)

def deadly(design):
    """Ends its process where the specularity is above a half."""
    if design.coating.specularity > 0.5:
        os._exit(3)
    return nearness(design)

def struck(design):
    """Kills the process that is the first to come to the fifth of ten places."""
    if design.coating.specularity == 0.5:
        try:
            Path(os.environ["STRUCK"]).touch(exist_ok=False)
        except FileExistsError:
            return told(design)
        os.kill(os.getpid(), signal.SIGKILL)
    return told(design)

def crowded(design):
    """The same, and from 0.6 on waits until three processes have come to work."""
    folder = Path(os.environ["CROWD"])
    (folder / str(os.getpid())).touch()
    while design.coating.specularity >= 0.6 and len(list(folder.iterdir())) < 3:
        time.sleep(0.01)
    return struck(design)

def broken(design):
    raise ValueError("no such sensor can be made")
'''


@pytest.fixture(scope="session")
def goals_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the module `cheap_goals`: functions of designs that need no image."""
    folder = tmp_path_factory.mktemp("goals")
    (folder / "cheap_goals.py").write_text(GOALS, encoding="utf-8")
    return folder


@pytest.fixture
def goals(goals_folder: Path, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """The module `cheap_goals`, which other processes can import too."""
    monkeypatch.syspath_prepend(str(goals_folder))
    return import_module("cheap_goals")

"""Designs and spaces that searches are tested on; nothing here renders."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from types import ModuleType

import pytest

import optisense as ots
from optisense.design import SensorDesign
from optisense.search.space import BoundSpace, SearchSpace

TWO_NUMBERS = {"coating.specularity": (0.0, 1.0, 5), "camera.position.x": (-1.0, 3.0, 3)}
"""A space in which `cheap_goals` make sense."""


@pytest.fixture(scope="session")
def mini() -> SensorDesign:
    return ots.load("gelsight-mini")


@pytest.fixture(scope="session")
def svelte() -> SensorDesign:
    return ots.load("gelsight-svelte")


@pytest.fixture(scope="session")
def two_numbers(mini: SensorDesign) -> BoundSpace:
    """Two numbers that no check ties to each other."""
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
import time

def nearness(design):
    """Highest, 0, at a specularity of 0.3 and a camera at x = 0.5."""
    return -((design.coating.specularity - 0.3) ** 2) - (design.camera.position[0] - 0.5) ** 2

def brightness(design):
    return design.coating.specularity

def told(design):
    """The same as `nearness`, and tells that it was asked, in a file."""
    log = os.environ.get("TRIAL_LOG")
    if log:
        with open(log, "a") as file:
            values = [design.coating.specularity, design.camera.position[0], os.getpid()]
            file.write(" ".join(map(repr, values)) + "\\n")
    time.sleep(float(os.environ.get("TRIAL_SECONDS", "0")))
    return nearness(design)

def deadly(design):
    """Ends its process where the specularity is above a half."""
    if design.coating.specularity > 0.5:
        os._exit(3)
    return nearness(design)

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

"""Materials of the user's own beside those of the library."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import bpy
import pytest

from studio.engine import catalogue, session
from studio.scene.collections import object_of


@pytest.fixture
def own_library(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[Path]:
    """An engine that keeps the user's own parts in a folder of the test's."""
    monkeypatch.setenv("OPTISENSE_LIBRARY", str(tmp_path))
    session.stop()
    session.engine()
    yield tmp_path
    session.stop()


def listed(name: str) -> bool:
    return name in [row["name"] for row in catalogue.entries("material")]


def until(is_so: Callable[[], bool]) -> None:
    end = time.monotonic() + 60.0
    while not is_so():
        session.engine().poll()
        assert time.monotonic() < end
        time.sleep(0.01)


def test_what_is_chosen_stays_chosen_when_the_library_grows(
    mini: Any, select: Callable[..., None], own_library: Path
) -> None:
    until(lambda: listed("silicone-lsr"))
    choice = bpy.context.window_manager.optisense_material
    choice.material = "silicone-lsr"
    select(object_of(mini, "PART", "gel"))
    assert bpy.ops.optisense.keep_material(name="a gel of mine") == {"FINISHED"}
    until(lambda: listed("a-gel-of-mine"))
    assert list(own_library.rglob("a-gel-of-mine.yaml"))
    assert choice.material == "silicone-lsr"
    assert bpy.ops.optisense.apply_material() == {"FINISHED"}
    assert object_of(mini, "PART", "gel").optisense.material == "silicone-lsr"
    choice.material = "a-gel-of-mine"
    assert choice.entry == "a-gel-of-mine"


def test_a_material_needs_a_name_that_files_can_have(
    mini: Any, select: Callable[..., None], own_library: Path
) -> None:
    select(object_of(mini, "PART", "gel"))
    with pytest.raises(RuntimeError, match="letter"):
        bpy.ops.optisense.keep_material(name="ü")
    assert not list(own_library.rglob("*.yaml"))

"""Tests of the Blender extension run inside Blender's Python module: `make studio-tests`.

They use the engine of the project's own environment, as a child process like any user's. Engines
and their searches are forks of one process that has imported everything.
"""

from __future__ import annotations

import atexit
import importlib.util
import math
import os
import shlex
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from warm_python import end_programs, programs

ROOT = Path(__file__).parents[2]

_status: int | None = None

if importlib.util.find_spec("bpy") is None:
    collect_ignore_glob = ["test_*.py"]
else:
    import bpy  # noqa: F401  (bmesh and mathutils can be imported only after it)

    if "OPTISENSE_ENGINE" not in os.environ:
        python = programs(str(ROOT / ".venv" / "bin" / "python")) / "python"
        command = [str(python), "-m", "optisense.cli", "engine"]
        os.environ["OPTISENSE_ENGINE"] = shlex.join(command)


@pytest.hookimpl(trylast=True)
def pytest_unconfigure(config: pytest.Config) -> None:
    """Leave without Blender's own end, at which the module of Blender 4.2 crashes."""
    if "bpy" in sys.modules and _status is not None:
        sys.stdout.flush()
        sys.stderr.flush()
        end_programs()
        os._exit(_status)


def pytest_sessionfinish(session: pytest.Session, exitstatus: int) -> None:
    """Keep how it went."""
    global _status
    _status = int(exitstatus)


@pytest.fixture(scope="session", autouse=True)
def _extension() -> Iterator[None]:
    """The extension is registered for all tests, and never when Python ends: Blender would hang."""
    import studio

    studio.register()
    registered = True

    def take_out() -> None:
        nonlocal registered
        if registered:
            registered = False
            studio.unregister()

    atexit.register(take_out)
    yield
    take_out()


@pytest.fixture(scope="session", autouse=True)
def _patience(_extension: None) -> None:
    """A slow machine's engine is waited for: no test depends on speed."""
    from studio.core import engine
    from studio.engine import session

    engine.GREETING_SECONDS = session.PATIENCE = math.inf


@pytest.fixture(autouse=True)
def scene(_extension: None) -> Any:
    """An empty scene, and nothing said yet."""
    import bpy

    from studio.engine import session

    bpy.ops.wm.read_homefile(use_empty=True)
    now = session.state()
    now.problem = now.hint = now.note = now.busy = now.about = ""
    bpy.context.window_manager.optisense_picture.shown = False
    return bpy.context.scene


@pytest.fixture(scope="session")
def mini_design(_extension: None) -> tuple[Any, Any]:
    """A GelSight Mini as the engine gives it, fetched once."""
    import bpy

    from studio.scene.gather import gather

    bpy.ops.wm.read_homefile(use_empty=True)
    assert bpy.ops.optisense.new(sensor="gelsight-mini-ideal") == {"FINISHED"}
    return gather(bpy.context.scene)


@pytest.fixture
def mini(mini_design: tuple[Any, Any], scene: Any) -> Any:
    """A scene with a GelSight Mini."""
    import bpy

    from studio.scene.build import build

    build(bpy.context.scene, *mini_design)
    bpy.ops.ed.undo_push(message="A sensor")
    return bpy.context.scene


@pytest.fixture
def select() -> Callable[..., None]:
    """Select objects, the first of them active."""
    import bpy

    def choose(*objects: Any) -> None:
        for each in bpy.context.scene.objects:
            each.select_set(False)
        for each in objects:
            each.select_set(True)
        bpy.context.view_layer.objects.active = objects[0] if objects else None

    return choose

"""Memory is released when another sensor is rendered."""

from __future__ import annotations

import sys
from collections.abc import Callable

import drjit as dr
import mitsuba as mi
import pytest

import optisense as ots
from optisense.engine.session import Renderer
from optisense.optics.backend import memory
from optisense.optics.backend.memory import bound_memory, release_memory, resident
from optisense.optics.backend.variant import use_variant


@pytest.mark.skipif(sys.platform != "linux", reason="what is in memory is told by /proc")
@pytest.mark.parametrize("give_back", [release_memory, bound_memory])
def test_freed_arrays_go_back_to_the_system(
    give_back: Callable[[], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    use_variant("auto")
    if dr.backend_v(mi.Float) != dr.JitBackend.LLVM:
        pytest.skip("arrays are in the memory of a GPU")
    release_memory()
    count = 64 * 2**20
    array = dr.arange(mi.Float, count) + 1.0
    dr.eval(array)
    dr.sync_thread()
    held = resident()
    del array
    monkeypatch.setattr(memory._Bound, "resident", held - 2.0 * count)
    give_back()
    assert resident() < held - 0.9 * 4 * count  # bytes of single precision


def test_drafts_of_another_sensor_are_dropped_and_those_of_an_edit_stay() -> None:
    renderer = Renderer()
    mini = ots.load("gelsight-mini-ideal")
    renderer.model(mini)
    drafts = renderer.draft_model(mini)
    edited = mini.copy()
    edited.camera.fov = 50.0
    renderer.model(edited)
    assert renderer.draft_model(edited) is drafts
    belt = ots.load("gelbelt")
    assert renderer.model(belt).design.name == belt.name
    assert renderer.draft_model(belt) is not drafts

"""The stored drafts of the built-in sensors are those that the engine makes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from optisense.sensors import SENSORS

SAME = 0.004
"""Mean difference of pixels (0 to 1) up to which drafts are the same: one level of 256. On another
kind of processor, rounding changes a few photons."""


@pytest.mark.parametrize("name", SENSORS.names())
def test_the_draft_of_an_opened_sensor_is_the_one_that_the_engine_makes(
    engine: Any, name: str
) -> None:
    opened = engine.ask("open", design=name)
    made = engine.ask("simulate", design=name, draft=True, files=["pixels"])
    stored, fresh = np.load(opened["draft"]), np.load(made["files"]["pixels"])
    assert stored.shape == fresh.shape
    off = float(np.abs(stored - fresh).mean())
    assert off < SAME, f"run python scripts/stored_drafts.py: drafts of {name} differ by {off:.3f}"


def test_a_saved_sensor_has_the_draft_until_it_is_changed(engine: Any, tmp_path: Any) -> None:
    folder = str(tmp_path / "sensor")
    engine.ask("save", design="digit", to=folder)
    assert engine.ask("open", design=folder)["draft"] is not None
    brighter = {"from": folder, "set": {"lights.red.flux": 2.0}}
    assert engine.ask("open", design=brighter)["draft"] is None
    housing = engine.ask("open", design=folder)["meshes"]["housing"]
    moved = str(tmp_path / "housing.npy")
    np.save(moved, np.load(housing["vertices"]) + 0.1)
    meshes = {"housing": {"vertices": moved, "faces": housing["faces"]}}
    assert engine.ask("open", design=folder, meshes=meshes)["draft"] is None

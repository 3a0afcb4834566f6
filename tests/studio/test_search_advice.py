"""Before a search begins: whether it can succeed, which objective fits, and how long it takes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest
from recording import draw

from studio.core.numbers import duration
from studio.engine import session
from studio.optimise import search_advice, search_progress
from studio.optimise.ui import OPTISENSE_PT_optimise
from studio.scene.collections import objects_of


def test_a_search_that_can_not_succeed_is_refused(mini: Any, tmp_path: Path) -> None:
    search = mini.optisense_search
    bpy.ops.optisense.vary(label="Specularity", text="coating.specularity=0:1")
    assert search.objective == "rgb2normal"  # what fits is chosen
    search.objective, search.study = "aoap", str(tmp_path / "study")
    with pytest.raises(RuntimeError, match="all trials will score alike"):
        bpy.ops.optisense.search()
    assert "rgb2normal or normdiff" in session.state().hint
    assert not (tmp_path / "study").exists()


def test_an_objective_that_was_chosen_stays(mini: Any) -> None:
    search = mini.optisense_search
    search.objective = "2to3pw"
    bpy.ops.optisense.vary(label="Flux", text="lights.red.flux=1:9")
    assert search.objective == "2to3pw"
    search.objective = "aoap"
    bpy.ops.optisense.vary(label="View", text="camera.fov=40:70")
    assert search.objective == "aoap"


def test_how_long_it_takes_is_told(mini: Any) -> None:
    from studio.engine import design_transfer

    search = mini.optisense_search
    bpy.ops.optisense.vary(label="View", text="camera.fov=40:70")
    few = search_advice.advice(design_transfer.design(mini), search, {"budget": 30})
    assert few.startswith("30 trials usually take ")
    assert duration(7300.0) == "2 hours" and duration(100.0) == "2 minutes"
    assert duration(20.0) == "20 seconds" and duration(0.1) == "1 seconds"


def test_a_flat_curve_is_told(mini: Any) -> None:
    rows = [{"number": each, "scores": {"aoap": 0.9}, "start": each == 0} for each in range(6)]
    search_progress.take_curve(mini, rows[:4])
    assert not search_advice.is_flat(search_progress.known_scores())
    search_progress.take_curve(mini, rows)
    layout = draw(OPTISENSE_PT_optimise)
    assert layout is not None and any("All trials score alike" in text for text in layout.texts)
    search_progress.take_curve(
        mini, [*rows, {"number": 6, "scores": {"aoap": 0.91}, "start": False}]
    )
    assert not search_advice.is_flat(search_progress.known_scores())
    search_progress.begin(mini)


def test_a_search_is_shown_in_its_own_scene(mini: Any, tmp_path: Path) -> None:
    files = {name: str(tmp_path / f"{name}.npy") for name in ("vertices", "faces")}
    np.save(files["vertices"], np.eye(3))
    np.save(files["faces"], [[0, 1, 2]])
    search_progress.begin(mini)
    other = bpy.data.scenes.new("Other")
    other.optisense.document = mini.optisense.document
    with bpy.context.temp_override(scene=other):
        search_progress.take(
            {
                "event": "trial",
                "number": 0,
                "best": True,
                "scores": {"aoap": 0.9},
                "shapes": {"gel": files},
            }
        )
        layout = draw(OPTISENSE_PT_optimise)
    assert [each.name for each in objects_of(mini, "SHOWN")] == ["ghost gel"]
    assert not objects_of(other, "SHOWN")
    assert layout is not None
    assert f"Search of the sensor of the scene '{mini.name}'" in layout.texts

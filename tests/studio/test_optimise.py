"""What a search may change, as the studio offers it."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import bpy
import pytest
from waiting import until

from studio.engine import catalogue, design_transfer, session
from studio.optimise.suggestions import suggestions
from studio.scene.collections import objects_of


@pytest.fixture
def library() -> None:
    """The engine has told what the library has."""
    session.engine()
    kinds = ("material", "coating", "light", "camera")
    until(lambda: all(catalogue.entries(kind) for kind in kinds))


def parameters(scene: Any, text: str) -> list[dict[str, Any]]:
    """What the engine makes of a range."""
    found = session.ask_and_wait("space", design=design_transfer.design(scene), vary=[text])
    return list(found["parameters"])


@pytest.mark.parametrize("sensor", ["gelsight-mini-ideal", "gelsight-svelte"])
def test_pose_material_and_points_of_every_object_can_vary(
    sensor: str, scene: Any, select: Callable[..., None], library: None
) -> None:
    assert bpy.ops.optisense.new(sensor=sensor) == {"FINISHED"}
    names = set()
    for each in objects_of(scene, "LIGHT", "PART", "CAMERA", "CAGE"):
        select(each)
        offered = suggestions(bpy.context)
        assert offered and len({row.text for row in offered}) == len(offered)
        for row in offered:
            names |= {one["name"] for one in parameters(scene, row.text)}
    assert {"camera.position.x", "camera.turn.y", "camera.model", "coating.library"} <= names
    assert {"lights.red.lights[0].position.z", "lights.red.turn.x", "lights.red.model"} <= names
    assert {"parts.gel.material", "coating.specularity"} <= names
    assert any(name.startswith("cages.") for name in names)
    free = "M2" if sensor == "gelsight-svelte" else "tray"
    assert {f"parts.{free}.shift.x", f"parts.{free}.turn.z", f"parts.{free}.material"} <= names


def test_a_search_starts_from_what_is_there(
    mini: Any, select: Callable[..., None], library: None
) -> None:
    design = mini.optisense
    design.light_groups["red"].flux = 30.0
    design.coating.put("reflectance", (0.95, 0.01, 0.5))
    design.materials["silicone-xp565"].put("roughness", 0.75)
    starts: dict[str, float] = {}
    for kind in ("LIGHT", "PART"):
        for each in objects_of(mini, kind):
            select(each)
            for row in suggestions(bpy.context):
                for one in parameters(mini, row.text):
                    assert one["lower"] <= one["start"] <= one["upper"]
                    starts[one["name"]] = one["start"]
    assert starts["lights.red.flux"] == pytest.approx(30.0)
    assert starts["coating.reflectance.r"] == pytest.approx(0.95)
    assert starts["coating.reflectance.g"] == pytest.approx(0.01)
    assert starts["materials.silicone-xp565.roughness"] == pytest.approx(0.75)


def test_the_best_of_a_search_keeps_the_conditions(mini: Any, tmp_path: Path) -> None:
    search = mini.optisense_search
    row = search.vary.add()
    row.text = "camera.fov=40:60:3"
    search.objective, search.method, search.study = "aoap", "grid", str(tmp_path / "study")
    search.require = "coverage>=0.5, min(coverage, 1)<=0.99"
    assert bpy.ops.optisense.search() == {"FINISHED"}
    about = session.ask_and_wait("study", study=search.study)
    assert about["requirements"] == ["coverage >= 0.5", "min(coverage, 1) <= 0.99"]
    fine = [row for row in about["curve"] if row["feasible"]]
    assert 0 < len(fine) < len(about["curve"])
    scores = {row["number"]: row["scores"]["aoap"] for row in fine}
    assert about["best"] == max(scores, key=lambda number: scores[number])
    found = bpy.context.window_manager.optisense_found
    assert float(found.best) == pytest.approx(max(scores.values()), rel=1e-3)
    assert found.conditions.splitlines()[0].startswith("coverage >= 0.5: 0.")


def test_a_search_takes_all_options_of_the_command_line(mini: Any, tmp_path: Path) -> None:
    rules = tmp_path / "rules.py"
    rules.write_text("def not_too_wide(design):\n    return design.camera.fov < 55\n")
    search = mini.optisense_search
    row = search.vary.add()
    row.text = "camera.fov=45:60"
    search.objective, search.method, search.budget = "aoap", "cma-es", 4
    search.study = str(tmp_path / "study")
    search.coarse_first = search.may_cross = True
    search.options, search.rules = "population=4, sigma=0.2", f"{rules}:not_too_wide"
    search.errors, search.samples = "camera.position.z=0.05", 2
    search.settings = "photons=50000"
    with pytest.raises(RuntimeError, match="needs pictures"):
        bpy.ops.optisense.search()  # scores of rays are not made faster
    search.coarse_first = False
    assert bpy.ops.optisense.search() == {"FINISHED"}
    stored = json.loads((tmp_path / "study" / "study.json").read_text())
    assert stored["options"] == {"population": 4, "sigma": 0.2} and stored["samples"] == 2
    assert not stored["apart"] and stored["errors"]
    assert stored["settings"]["photons"] == 50000 and len(stored["rules"]) == 1


def test_several_objectives_are_weighed_against_each_other(mini: Any, tmp_path: Path) -> None:
    goals = tmp_path / "goals.py"
    goals.write_text(
        "def up(e):\n    return e.design.coating.specularity\n"
        "def down(e):\n    return -e.design.coating.specularity\n"
    )
    search = mini.optisense_search
    search.objective = f"{goals}:up, {goals}:down"
    search.method, search.budget, search.study = "pareto", 3, str(tmp_path / "study")
    bpy.ops.optisense.vary(label="specularity", text="coating.specularity=0:1")
    assert bpy.ops.optisense.search() == {"FINISHED"}
    about = session.ask_and_wait("study", study=str(tmp_path / "study"))
    assert about["objectives"] == ["up", "down"]


def test_long_choices_fit_into_the_menu(
    mini: Any, select: Callable[..., None], library: None
) -> None:
    select(objects_of(mini, "LIGHT")[0])
    texts: list[str] = []
    layout = SimpleNamespace(
        operator=lambda name, text: texts.append(text) or SimpleNamespace(),
    )
    bpy.types.OPTISENSE_MT_vary.draw(SimpleNamespace(layout=layout), bpy.context)
    assert texts and max(map(len, texts)) <= 72 and any(text.endswith(" ...") for text in texts)

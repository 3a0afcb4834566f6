"""Sensors of the user's CAD files, by requests to the engine."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
import yaml


def box(path: Path, low: tuple[float, ...], high: tuple[float, ...], scale: float = 1.0) -> str:
    bounds = scale * np.array([low, high])
    trimesh.creation.box(bounds=bounds).export(path)
    return str(path)


def test_bodies_are_told_with_their_uses_and_units(engine: Any, tmp_path: Path) -> None:
    files = [
        box(tmp_path / "gel.stl", (-9, -7, -4), (9, 7, 0), 1e-3),
        box(tmp_path / "Acrylic Plate.obj", (-9, -7, -7), (9, 7, -4), 1e-3),
    ]
    told = engine.ask("cad", files=files)
    assert told["units"] == "m"
    rows = {row["name"]: row for row in told["bodies"]}
    assert {name: row["use"] for name, row in rows.items()} == {
        "gel": "elastomer",
        "Acrylic-Plate": "support",
    }
    assert rows["gel"]["size"] == pytest.approx([18, 14, 4], rel=1e-5) and rows["gel"]["closed"]
    assert np.ptp(np.load(rows["gel"]["mesh"]["vertices"]), axis=0) == pytest.approx([18, 14, 4])
    assert engine.ask("cad", files=[str(tmp_path)])["bodies"][0]["file"] == "Acrylic Plate.obj"


def test_a_design_is_made_of_them(engine: Any, tmp_path: Path) -> None:
    cad = tmp_path / "cad"
    cad.mkdir()
    files = [
        box(cad / "gel.stl", (-9, -7, -4), (9, 7, 0)),
        box(cad / "thing.stl", (-9, -7, -7), (9, 7, -4)),
    ]
    engine.ask("from_cad", files=files, uses={"thing": "support"}, to=str(tmp_path / "made"))
    made = yaml.safe_load((tmp_path / "made" / "design.yaml").read_text())
    roles = {name: part["role"] for name, part in made["parts"].items()}
    assert roles == {"gel": "elastomer", "skin": "sensing_surface", "thing": "support"}
    assert set(made["lights"]) == {"red", "green", "blue"}
    assert "CAD file gel.stl" in made["provenance"]["parts.gel"]["source"]


def test_what_makes_no_sense_is_refused(engine: Any, tmp_path: Path) -> None:
    gel = box(tmp_path / "gel.stl", (0, 0, 0), (9, 9, 4))
    missing = engine.refused("cad", files=["/elsewhere/plate.stl"])
    assert "no file" in missing["message"] and missing["hint"].endswith(
        "from the folder /elsewhere"
    )
    assert "one folder" in engine.refused("cad", files=[gel, "/elsewhere/plate.stl"])["hint"]
    assert (
        "'lid'"
        in engine.refused("from_cad", files=[gel], uses={"lid": "blocker"}, to="/x")["message"]
    )
    told = engine.refused("from_cad", files=[gel], uses={"gel": "blocker"}, to=str(tmp_path / "x"))
    assert "gel" in told["message"] and not (tmp_path / "x").exists()

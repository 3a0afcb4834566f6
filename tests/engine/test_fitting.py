"""A design is fitted to photographs through the engine."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

FLUX = 3.0
"""Flux (mW) of the red lights of the real sensor; the design that is fitted has 2.1."""

PRESSES = {"a": (-4.0, 2.0), "b": (3.0, -2.0), "c": (0.5, 3.0)}
"""Surface coordinates (mm) of presses of balls of 6 mm."""


def test_the_power_of_a_light_is_found_from_photographs(engine: Any, tmp_path: Path) -> None:
    photos = tmp_path / "photos"
    photos.mkdir()
    real = {"from": "gelsight-mini-ideal", "set": {"lights.red.flux": FLUX}}
    shots = {
        "background": [],
        **{name: [f"sphere:3@{x},{y}:0.6"] for name, (x, y) in PRESSES.items()},
    }
    for name, contacts in shots.items():
        result = engine.ask(
            "simulate", design=real, contacts=contacts, resolution=[100, 75], photons=100_000,
            exposure=700.0, to=str(photos), name=name,
        )  # fmt: skip
        Path(result["files"]["picture"]).rename(photos / f"{name}.png")
    rows = "".join(f"{name}.png,6\n" for name in PRESSES)
    (photos / "presses.csv").write_text(f"file,diameter\n{rows}", encoding="utf-8")
    listed = engine.ask("calibration_families")["families"]
    families = [each["name"] for each in listed if each["usual"]]
    assert {"edges", "gel"} <= {each["name"] for each in listed if not each["usual"]}
    to = tmp_path / "fitted"
    given = {
        "design": "gelsight-mini-ideal",
        "photos": str(photos),
        "rounds": 1,
        "photons": 100_000,
    }
    keep = [each for each in families if each != "powers"]
    number = engine.send("calibrate", to=str(to), keep=keep, **given)
    kept = to / "renderings"
    engine.until(lambda said: said["id"] == number and ("ok" in said or any(kept.glob("*.npz"))))
    engine.ask("cancel", of=number)
    assert engine.error(number)["kind"] == "Cancelled"
    assert any(kept.glob("*.npz")) and not list(to.glob("*.*ml")) and not list(to.glob("*.json"))
    found = engine.ask("calibrate", to=str(to), keep=keep, **given)
    assert not kept.exists()
    (red,) = [each for each in found["numbers"] if "red" in each["path"]]
    (green,) = [each for each in found["numbers"] if "green" in each["path"]]
    assert red["before"] == pytest.approx(2.1)
    assert red["after"] / green["after"] == pytest.approx(FLUX / 2.1, rel=0.1)
    assert "better" in found["verdict"]
    assert found["unexplained"][1] < found["unexplained"][0]
    assert (to / "design.yaml").is_file() and Path(found["page"]).is_file()
    refused = engine.refused("calibrate", to=str(tmp_path / "n"), keep=["weather"], **given)
    assert "keep" in refused["message"] and "powers" in refused["message"]
    refused = engine.refused("calibrate", to=str(tmp_path / "n"), fit=["camera.fov"], **given)
    assert "PATH=LO:HI" in refused["message"]

"""Saved images: a folder holds the files of one image only."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import drjit as dr
import numpy as np
import pytest

from optisense.errors import OutputError, RenderError
from optisense.optics import TactileImage
from optisense.report import write_report
from optisense.sensors import gelsight_mini_ideal


def image(*groups: str) -> TactileImage:
    return TactileImage(
        layers={name: np.full((4, 6, 3), 0.2, dtype=np.float32) for name in groups},
        normals=np.tile(np.float32([0, 0, -1]), (4, 6, 1)),
        contact_mask=np.zeros((4, 6), dtype=bool),
        points=np.zeros((4, 6, 3), dtype=np.float32),
    )


def files(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}


def test_an_image_is_found_among_others() -> None:
    images = [image("red"), image("red")]
    assert images.index(images[1]) == 1
    assert len({*images}) == 2


def test_files_are_written_on_one_processor_too(tmp_path: Path) -> None:
    """Mitsuba waits for other threads of Dr.Jit; on one processor there are none."""
    before = dr.thread_count()
    dr.set_thread_count(1)
    try:
        image("red").save(tmp_path / "all")
        image("red").save_radiance(str(tmp_path / "radiance.exr"))
        assert dr.thread_count() == 1
    finally:
        dr.set_thread_count(before)
    for file in ("all/radiance.exr", "all/layers/red.exr", "radiance.exr"):
        assert (tmp_path / file).stat().st_size > 200


@pytest.mark.parametrize("exposure", [np.array([1.0, 2.0, 3.0]), None, "bright", 0.0])
def test_an_exposure_is_auto_or_above_zero(tmp_path: Path, exposure: Any) -> None:
    with pytest.raises(RenderError, match="the exposure is"):
        image("red").picture(exposure)
    with pytest.raises(RenderError, match="the exposure is"):
        image("red").save(tmp_path, exposure)


def test_another_image_takes_away_what_was_written_about_the_first(tmp_path: Path) -> None:
    first = image("red", "green")
    first.save(tmp_path)
    write_report(tmp_path / "report.html", gelsight_mini_ideal(), first)
    (tmp_path / "notes.txt").write_text("mine")
    (tmp_path / "layers" / "blue.exr").write_text("mine too")
    image("red").save(tmp_path)
    left = files(tmp_path)
    assert "report.html" not in left
    assert "layers/green.exr" not in left
    assert {"notes.txt", "layers/blue.exr", "layers/red.exr", "image.png"} <= left


def test_an_earlier_image_stays_whole_if_a_file_cannot_be_replaced(tmp_path: Path) -> None:
    first = image("red", "green")
    first.save(tmp_path)
    write_report(tmp_path / "report.html", gelsight_mini_ideal(), first)
    (tmp_path / "pressure.npy").write_bytes(b"of the first")
    (tmp_path / "image.png").unlink()
    (tmp_path / "image.png" / "a folder").mkdir(parents=True)
    before = files(tmp_path)
    with pytest.raises(OutputError, match="the results can't be written"):
        image("red").save(tmp_path)
    assert files(tmp_path) == before
    assert (tmp_path / "pressure.npy").read_bytes() == b"of the first"


def test_files_of_others_stay_whatever_run_json_says(tmp_path: Path) -> None:
    folder = tmp_path / "image"
    folder.mkdir()
    (folder / "report.html").write_text("<!DOCTYPE html><p>my own report")
    (tmp_path / "mine.exr").write_text("mine")
    for text in ('{"layers": ["../../mine", "../mine", 3]}', "[1]", '{"layers": 3}', "no JSON"):
        (folder / "run.json").write_text(text)
        image("red").save(folder)
        assert (tmp_path / "mine.exr").read_text() == "mine"
        assert "my own report" in (folder / "report.html").read_text()
    assert json.loads((folder / "run.json").read_text())["layers"] == ["red"]

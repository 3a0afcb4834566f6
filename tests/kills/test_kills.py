"""Commands that are killed at a random moment; `make kill-tests` does so 200 times."""

from __future__ import annotations

from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest
from PIL import Image

from optisense.optics.backend.variant import threads_for_exr_files

from .agreement import agrees, same_values
from .killing import kill_repeatedly
from .work import half_files, whole_files

SEED = 7
"""Seed of the moments, which also depend on the speed of the machine."""


@pytest.mark.slow
def test_it_leaves_nothing_half_and_ends_as_if_it_had_not_been_killed(tmp_path: Path) -> None:
    """An export; `tests/search/test_killed.py` kills searches, and `make kill-tests` kills all."""
    report = kill_repeatedly("export", 1, SEED, tmp_path)
    assert report.wrong == []
    assert report.killed + report.late == 1


def test_pictures_agree_up_to_rounding(tmp_path: Path) -> None:
    light = np.random.default_rng(1).uniform(0.0, 1.0, (20, 30, 3)).astype(np.float32)

    def written(name: str, values: np.ndarray) -> bytes:
        path = tmp_path / name
        if path.suffix == ".npy":
            np.save(path, values)
        elif path.suffix == ".png":
            Image.fromarray((255 * values).astype(np.uint8)).save(path)
        else:
            with threads_for_exr_files():
                mi.Bitmap(values).write(str(path))
        return path.read_bytes()

    for name in ("a.npy", "a.exr", "a.png"):
        whole = written(name, light)
        assert agrees(name, whole, written(name, light * np.float32(1 + 1e-6)))
        assert not agrees(name, whole, written(name, light[::-1].copy()))
        assert not agrees(name, whole, whole[: len(whole) // 2])
        assert not agrees(name, whole, written(name, light[:-1]))
    assert not agrees("a.csv", b"1\n", b"2\n")


def test_fitted_numbers_agree_up_to_rounding() -> None:
    fitted = {"flux": {"red": 2.2896, "blue": 1.9241}, "matrix": [[1.0, -0.01454]], "name": "mini"}
    near = {"flux": {"red": 2.2897, "blue": 1.9241}, "matrix": [[1.0, -0.014538]], "name": "mini"}
    assert same_values(fitted, near)
    for wrong in (
        {**fitted, "flux": {"red": 2.2896, "blue": 1.93}},
        {**fitted, "flux": {"red": 2.2896}},
        {**fitted, "matrix": [[1.0]]},
        {**fitted, "matrix": [[1.0, -0.0146]]},
        {**fitted, "name": "digit"},
    ):
        assert not same_values(fitted, wrong)


def test_half_files_are_found(tmp_path: Path) -> None:
    """What `half_files` says of files that are cut off, strange, or in order."""
    made = {
        "whole.png": b"picture",
        "half.png": b"pic",
        "table.csv": b"a,b\n1,2\n",
        "half.csv": b"a,b\n1,",
        "run.json": b'{"seconds": 2}',
        "report.html": b"<html>\n</html>\n",
        "deep/strange.bin": b"",
        ".temporary": b"anything",
    }
    for name, data in made.items():
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(data)
    whole = {
        "whole.png": b"picture",
        "half.png": b"picture",
        "table.csv": b"a,b\n1,2\n3,4\n",
        "half.csv": b"a,b\n1,2\n",
        "run.json": None,
        "report.html": None,
    }
    assert half_files(tmp_path, whole) == [
        "deep/strange.bin: is not in the result",
        "half.csv: has half a line",
        "half.png: has other content",
    ]
    (tmp_path / "run.json").write_bytes(b'{"sec')
    (tmp_path / "report.html").write_bytes(b"<html>\n")
    told = half_files(tmp_path, whole)
    assert "report.html: is cut off" in told
    assert any(each.startswith("run.json: can't be read") for each in told)
    assert "report.html" in whole_files(tmp_path)

"""Intermediate results are found again by all their inputs, and by nothing less."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from optisense.kept_arrays import NOTHING_KEPT, KeptArrays

NAMES = ["one"]


@dataclass(frozen=True)
class Ball:
    radius: float


@dataclass(frozen=True)
class Rod:
    radius: float


class Maker:
    """Makes other arrays each time, and counts how often."""

    def __init__(self) -> None:
        self.made = 0

    def __call__(self) -> dict[str, np.ndarray]:
        self.made += 1
        return {"one": np.array([float(self.made)])}


def test_equal_inputs_give_the_stored_arrays(tmp_path: Path) -> None:
    make = Maker()
    for kept in (KeptArrays(tmp_path / "kept"), KeptArrays(tmp_path / "kept")):
        inputs = [1, "two", np.arange(3.0), np.float32(0.5), Path("mesh.stl"), {"four": (5, None)}]
        assert kept.arrays(inputs, make, NAMES)["one"] == 1.0
    assert make.made == 1


@pytest.mark.parametrize("other", [2, "1", np.array([1]), [1], None])
def test_other_inputs_give_new_arrays(tmp_path: Path, other: object) -> None:
    kept, make = KeptArrays(tmp_path), Maker()
    assert kept.arrays([1], make, NAMES)["one"] == 1.0
    assert kept.arrays([other], make, NAMES)["one"] == 2.0
    assert kept.arrays([np.arange(3)], make, NAMES)["one"] == 3.0
    assert kept.arrays([np.arange(3) + 1], make, NAMES)["one"] == 4.0
    assert kept.arrays([Ball(1.0)], make, NAMES)["one"] == 5.0
    assert kept.arrays([Rod(1.0)], make, NAMES)["one"] == 6.0
    assert kept.arrays([Ball(1.0)], make, NAMES)["one"] == 5.0


def test_damaged_and_unexpected_arrays_are_made_again(tmp_path: Path) -> None:
    kept, make = KeptArrays(tmp_path), Maker()
    kept.arrays([1], make, NAMES)
    (file,) = tmp_path.iterdir()
    file.write_bytes(file.read_bytes()[:40])  # as of a disk that was full
    assert kept.arrays([1], make, NAMES)["one"] == 2.0
    assert kept.arrays([1], make, ["another"])["one"] == 3.0


def test_an_input_that_cannot_be_told_from_others_is_refused(tmp_path: Path) -> None:
    with pytest.raises(TypeError, match="Maker can't identify a stored result"):
        KeptArrays(tmp_path).arrays([Maker()], Maker(), NAMES)


def test_the_folder_is_removed_with_its_arrays(tmp_path: Path) -> None:
    kept, make = KeptArrays(tmp_path / "kept"), Maker()
    kept.remove()  # nothing has been stored yet
    kept.arrays([1], make, NAMES)
    kept.remove()
    assert not (tmp_path / "kept").exists()
    assert NOTHING_KEPT.arrays([1], make, NAMES)["one"] == 2.0
    NOTHING_KEPT.remove()

"""The fitted GelSight Mini, compared with photographs of a real unit that no fit used.

The photographs are those of the package taxim. Its publishers do not state the diameter of the
ball; docs/calibration.md explains the value here.
"""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

import pytest

import optisense as ots
from optisense.calibration import compare, read_photographs

DIAMETER = 2.5
"""Assumed diameter of the ball, mm."""
SHALLOW = 19
"""Index of the shallowest press, whose contact the ball certainly fits."""
WIDTH = 320
"""Width (pixels) to which the photographs are scaled."""


def test_a_background_and_a_press_of_another_unit_look_alike() -> None:
    found = find_spec("taxim")
    assert found is not None and found.origin is not None, "the extra dev installs taxim"
    pack = Path(found.origin).parent / "calib" / "gelsight_mini" / "dataPack.npz"
    photographs = read_photographs(pack, DIAMETER).subset([SHALLOW]).scaled(WIDTH)
    model = ots.OpticalModel(ots.load("gelsight-mini"))
    result = compare(model, photographs, photons=1_000_000)
    background = result.realism.background
    # The three figures are 31.7 dB, 0.92 for green, and 0.13; an ideal camera has 19.7 dB.
    assert background.ratio > 30.0
    assert min(background.correlation) > 0.9
    (press,) = result.realism.presses
    assert press.unexplained < 0.18
    # The label of this press is wrong, and a note names it.
    assert any("press 20" in note and "radius" in note for note in result.notes)
    assert press.gain == pytest.approx((1.0, 1.0, 1.0), abs=0.3)

"""How the intensity of a lamp varies with angle."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from optisense.design import AreaEmitter, IesEmitter, SpotEmitter

QUADRANT = (
    "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 3 3 1 2 0 0 0\n1 1 5\n0 45 90\n0 90 180\n"
    "8 4 0\n8 6 0\n8 2 0\n"
)


def test_a_flat_window_follows_lamberts_law() -> None:
    angles = np.array([0.0, 30.0, 60.0, 90.0, 120.0])
    relative = AreaEmitter(size=(1.0, 1.0)).relative_intensity(angles)
    np.testing.assert_allclose(relative, [1.0, np.sqrt(0.75), 0.5, 0.0, 0.0], atol=1e-12)


def test_a_spot_is_full_in_its_beam_half_midway_and_dark_beyond() -> None:
    spot = SpotEmitter(cutoff=40.0, beam=20.0)
    relative = spot.relative_intensity([0.0, 20.0, 30.0, 40.0, 80.0])
    np.testing.assert_allclose(relative, [1.0, 1.0, 0.5, 0.0, 0.0], atol=1e-12)
    sharp = SpotEmitter(cutoff=30.0, beam=30.0).relative_intensity([29.9, 30.1])
    assert sharp.tolist() == [1.0, 0.0]


def test_the_spot_is_the_one_that_the_simulation_emits() -> None:

    angles = np.linspace(0.0, 60.0, 241)
    emitted = SpotEmitter(cutoff=40.0, beam=20.0).intensity().at(angles, np.zeros_like(angles))
    relative = SpotEmitter(cutoff=40.0, beam=20.0).relative_intensity(angles)
    np.testing.assert_allclose(relative, emitted, atol=1e-3)


@pytest.fixture
def lamp(tmp_path: Path) -> IesEmitter:
    (tmp_path / "lamp.ies").write_text(QUADRANT)
    emitter = IesEmitter(file="lamp.ies")
    emitter._folder = tmp_path
    return emitter


@pytest.mark.parametrize(
    ("polar", "azimuth", "expected"),
    [
        (0.0, 77.0, 1.0),
        (45.0, 0.0, 0.5),
        (45.0, 90.0, 0.75),
        (45.0, 270.0, 0.75),
        (45.0, -90.0, 0.75),
        (45.0, 180.0, 0.25),
        (45.0, 45.0, 0.625),
        (22.5, 180.0, 0.625),
        (45.0, 360.0, 0.5),
        (90.0, 0.0, 0.0),
        (135.0, 0.0, 0.0),
    ],
)
def test_an_ies_file_is_linear_between_its_angles(
    lamp: IesEmitter, polar: float, azimuth: float, expected: float
) -> None:
    assert lamp.relative_intensity(polar, azimuth) == pytest.approx(expected)


def test_angles_of_any_shape(lamp: IesEmitter) -> None:
    grid = lamp.relative_intensity(np.array([[0.0], [45.0]]), np.array([[0.0, 90.0, 180.0]]))
    np.testing.assert_allclose(grid, [[1.0, 1.0, 1.0], [0.5, 0.75, 0.25]])

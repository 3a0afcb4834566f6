"""The raised plane: places where photons cross it, and which camera samples look it up."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from optisense.optics.radiance_cache.raised_plane import (
    RAISED_HEIGHT,
    crossed_cell,
    sampled_plane,
)
from optisense.optics.scene.surface_cells import build_cells, cell_at

SQUARE = np.array([[-5, -5, 0], [5, -5, 0], [5, 5, 0], [-5, 5, 0]], dtype=float)
FACES = np.array([[0, 1, 2], [0, 2, 3]])


def test_a_slanting_photon_crosses_the_plane_behind_its_landing() -> None:
    cells = build_cells(SQUARE, FACES, 0.5)
    point = mi.Point3f(1.0, 0.2, 0.0)
    landed, found = cell_at(cells, point, mi.Bool(True))
    for tangent in (0.0, 1.0, 3.0):
        direction = dr.normalize(mi.Vector3f(tangent, 0, -1))
        crossed, crosses = crossed_cell(cells, landed, point, direction, found)
        expected, _ = cell_at(
            cells, point - mi.Vector3f(tangent * RAISED_HEIGHT, 0, 0), mi.Bool(True)
        )
        assert crosses[0] and crossed[0] == expected[0]


def test_photons_from_beyond_the_edge_and_from_behind_do_not_count() -> None:
    cells = build_cells(SQUARE, FACES, 0.5)
    point = mi.Point3f(-4.8, 0.2, 0.0)
    landed, found = cell_at(cells, point, mi.Bool(True))
    for direction in (mi.Vector3f(5, 0, -1), mi.Vector3f(0, 0, 1)):
        crosses = crossed_cell(cells, landed, point, dr.normalize(direction), found)[1]
        assert not crosses[0]


@pytest.mark.parametrize("share", [0.0, 0.25, 0.75, 1.2])
def test_samples_look_up_the_plane_in_proportion_to_their_height(share: float) -> None:
    count = 1200
    points = SimpleNamespace(
        series=dr.full(mi.UInt32, 7, count), number=dr.arange(mi.UInt32, count)
    )
    rise = dr.full(mi.Float, share * RAISED_HEIGHT, count)
    above = sampled_plane(cast(Any, points), rise, mi.Bool(True))
    assert np.asarray(above).mean() == pytest.approx(min(share, 1.0), abs=0.01)
    beside = sampled_plane(cast(Any, points), rise, dr.full(mi.Bool, False, count))
    assert not np.asarray(beside).any()

"""Sheets as plates: volumes and places by closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from optisense import sensors
from optisense.geometry import TriangleMesh
from optisense.sensors._shapes import ribbon
from optisense.workshop._thickened import thickened
from optisense.workshop.shapes import shapes


def test_a_rectangle_becomes_a_box_behind_its_face() -> None:
    plate = thickened(TriangleMesh.grid((20.0, 10.0)), 1.5)
    assert plate is not None and plate.is_closed
    assert plate.volume == pytest.approx(20.0 * 10.0 * 1.5)
    np.testing.assert_allclose(plate.bounds, [[-10, -5, -1.5], [10, 5, 0]], atol=1e-9)


def test_a_bent_sheet_is_mitred() -> None:
    """An L of two arms of 10 mm, its normals inside: outside of it a corner of 1 x 1 is added."""
    sheet = ribbon([(10.0, 0.0), (0.0, 0.0), (0.0, 10.0)], 4.0, 1).flipped()
    assert sheet.face_normals[0] @ (0.0, 0.0, 1.0) == pytest.approx(1.0)
    plate = thickened(sheet, 1.0)
    assert plate is not None
    assert plate.volume == pytest.approx(8.0 * (10.0 + 10.0 + 1.0))
    np.testing.assert_allclose(plate.bounds, [[-1, -4, -1], [10, 4, 10]], atol=1e-9)


def test_an_arc_is_a_pipe() -> None:
    angle = np.linspace(0.0, np.pi, 361)
    half = ribbon(np.column_stack([10.0 * np.cos(angle), 10.0 * np.sin(angle)]), 2.0, 1)
    plate = thickened(half, 1.0)  # its normals look to the axis
    assert plate is not None
    assert plate.volume == pytest.approx(4.0 * np.pi / 2.0 * (11.0**2 - 10.0**2), rel=1e-3)


def test_three_sheets_that_meet_in_one_edge_are_joined() -> None:
    """A T: where three faces share an edge, there is no one way behind them."""
    top = ribbon([(-5.0, 0.0), (0.0, 0.0), (5.0, 0.0)], 1.0, 1)
    stem = ribbon([(0.0, -5.0), (0.0, 0.0)], 1.0, 1)
    plate = thickened(TriangleMesh.joined([top, stem]).welded(), 1.0)
    assert plate is not None and plate.is_closed
    # The bar is 10 x 1 mm, the stem 1 x 5, of which the upper 1 x 1 lies in the bar.
    assert plate.volume == pytest.approx(2.0 * (10.0 + 4.0))


def test_only_the_skins_of_built_in_sensors_have_no_thickness() -> None:
    for name in sensors.SENSORS.names():
        sheets = [shape for shape in shapes(sensors.build(name)) if not shape.is_solid]
        assert [shape.name for shape in sheets] == ["skin"], name


def test_the_base_of_a_round_fingertip_lies_below_its_face() -> None:
    (base,) = (s for s in shapes(sensors.gelsight360(base_thickness=3.0)) if s.name == "base")
    assert base.volume == pytest.approx(3.0 * np.pi * (14.0**2 - 8.5**2), rel=5e-3)
    np.testing.assert_allclose(base.mesh.bounds[:, 2], [-3.0, 0.0], atol=1e-9)


def test_the_black_coat_lies_outside_of_the_belt() -> None:
    made = {shape.name: shape for shape in shapes(sensors.gelbelt(coat_thickness=0.4))}
    assert made["far-coat"].volume == pytest.approx(
        0.4 * sensors.gelbelt().deformed_meshes()["far-coat"].area, rel=0.01
    )
    outside = made["far-coat"].mesh.bounds[1] - made["gel"].mesh.bounds[1]
    np.testing.assert_allclose(outside, [0.4, 0.0, 0.4], atol=2e-3)


def test_the_sheets_of_svelte_are_plates_behind_their_faces() -> None:
    design = sensors.gelsight_svelte()
    drawn = design.deformed_meshes()
    made = {shape.name: shape for shape in shapes(design)}
    assert [name for name, shape in made.items() if not shape.is_solid] == ["skin"]
    for name in ("M1", "M2", "body", "side-walls", "led-covers"):
        assert made[name].volume == pytest.approx(drawn[name].area, rel=0.05)  # 1 mm thick
    for name in ("body", "side-walls"):  # the walls lie outside of their inner faces
        low, high = made[name].mesh.bounds - drawn[name].bounds
        assert (low < 1e-9).all() and (high > -1e-9).all()

"""The cells of a surface: their areas are those of the surface in them, however it is meshed."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from optisense.geometry.mesh_points import surface_samples
from optisense.optics.radiance_cache.smoothing import Kernels
from optisense.optics.scene.surface_cells import build_cells, cell_at

RADIUS = 6.0
SIZE = 0.5


def fan(sectors: int) -> tuple[np.ndarray, np.ndarray]:
    """A disc of thin triangles that meet in its middle, as at the tip of a turned part."""
    turns = 2 * np.pi * np.arange(sectors) / sectors
    rim = RADIUS * np.stack([np.cos(turns), np.sin(turns), 0 * turns], axis=1)
    numbers = np.arange(1, sectors + 1)
    faces = np.stack([0 * numbers, numbers, np.roll(numbers, -1)], axis=1)
    return np.concatenate([np.zeros((1, 3)), rim]), faces


def rings(sectors: int, count: int) -> tuple[np.ndarray, np.ndarray]:
    """The same disc with rings of small triangles about the middle."""
    points, faces = fan(sectors)
    circles = [points[1:] * step / count for step in range(1, count + 1)]
    numbers = np.arange(1, sectors + 1)
    after = np.roll(numbers, -1)
    for ring in range(count - 1):
        inner, outer = ring * sectors, (ring + 1) * sectors
        faces = np.concatenate(
            [
                faces,
                np.stack([inner + numbers, outer + numbers, outer + after], axis=1),
                np.stack([inner + numbers, outer + after, inner + after], axis=1),
            ]
        )
    return np.concatenate([points[:1], *circles]), faces


@pytest.mark.parametrize("mesh", [fan(400), rings(90, 40)], ids=["fan", "rings"])
def test_areas_are_true_where_many_thin_faces_meet(mesh: tuple[np.ndarray, np.ndarray]) -> None:
    cells = build_cells(*mesh, SIZE)
    assert cells.areas.sum() == pytest.approx(np.pi * RADIUS**2, rel=1e-3)
    whole = np.hypot(*cells.centres[:, :2].T) < RADIUS - SIZE
    assert np.std(cells.areas[whole]) < 0.07 * SIZE**2
    middle = np.hypot(*cells.centres[:, :2].T) < 1.5
    assert cells.areas[middle].mean() == pytest.approx(SIZE**2, rel=0.02)


def test_triangles_without_area_make_no_cells() -> None:
    points, faces = fan(400)
    far = np.array([[50.0, 0.0, 0.0], [60.0, 0.0, 0.0], [70.0, 0.0, 0.0]])
    last = len(points)
    with_line = np.concatenate([faces, [[last, last + 1, last + 2]]])
    cells = build_cells(np.concatenate([points, far]), with_line, SIZE)
    assert np.isfinite(cells.centres).all()
    assert cells.cells == build_cells(points, faces, SIZE).cells


def corner() -> tuple[np.ndarray, np.ndarray]:
    """A top of 8 x 8 mm in the plane z = 0, and a wall of 3 mm under its edge at x = 8."""
    points = [(0, 0, 0), (8, 0, 0), (8, 8, 0), (0, 8, 0), (8, 0, -3), (8, 8, -3)]
    faces = [(0, 1, 2), (0, 2, 3), (1, 4, 2), (4, 5, 2)]
    return np.array(points, dtype=float), np.array(faces)


def test_a_crease_divides_the_cells_that_it_runs_through() -> None:
    cells = build_cells(*corner(), SIZE)
    assert cells.creased
    assert cells.areas.sum() == pytest.approx(8 * 8 + 8 * 3, rel=1e-3)
    on_top, on_wall = np.abs(cells.normals[:, 2]) > 0.999, np.abs(cells.normals[:, 0]) > 0.999
    assert (on_top ^ on_wall).all()
    np.testing.assert_allclose(cells.centres[on_top][:, 2], 0.0, atol=1e-9)
    np.testing.assert_allclose(cells.centres[on_wall][:, 0], 8.0, atol=1e-9)
    second = np.asarray(cells.others)
    pairs = np.flatnonzero(second != np.arange(cells.cells))
    np.testing.assert_array_equal(second[second[pairs]], pairs)
    assert 16 <= len(pairs) / 2 <= 17  # along 8 mm of the edge


def test_light_on_a_top_is_not_averaged_with_the_dark_wall_beside_it() -> None:
    points, faces = corner()
    cells = build_cells(points, faces, SIZE)
    landings, owner, power = surface_samples(points, faces, 0.02)
    lit = owner < 2
    cell, found = cell_at(cells, mi.Point3f(*(mi.Float(each[lit]) for each in landings)), True)
    dr.eval(cell, found)
    assert np.asarray(found).all()
    landed = np.bincount(np.asarray(cell), power[lit], cells.cells)[:, None]
    kernel = Kernels(cells, np.full(cells.cells, 10.0), 1e-3).smoothing(1_000_000).kernel
    light = (kernel @ landed)[:, 0]
    on_top = np.abs(cells.normals[:, 2]) > 0.999
    # Areas of cells are known to a few per cent; a cell of both faces would have half the light.
    np.testing.assert_allclose(light[on_top], 1.0, atol=0.05)
    np.testing.assert_allclose(light[~on_top], 0.0, atol=1e-3)  # landings on the edge itself


def test_two_sides_of_a_sheet_are_one_cell() -> None:
    points, faces = fan(60)
    cells = build_cells(points, np.concatenate([faces, faces[:, ::-1]]), SIZE)
    assert not cells.creased
    assert cells.areas.sum() == pytest.approx(2 * np.pi * RADIUS**2, rel=5e-3)

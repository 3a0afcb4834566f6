"""The cells of a surface: their areas are those of the surface in them, however it is meshed."""

from __future__ import annotations

import numpy as np
import pytest

from optisense.optics.backend.variant import use_variant

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
    use_variant("llvm")
    from optisense.optics.scene.surface_cells import build_cells

    cells = build_cells(*mesh, SIZE)
    assert cells.areas.sum() == pytest.approx(np.pi * RADIUS**2, rel=1e-3)
    whole = np.hypot(*cells.centres[:, :2].T) < RADIUS - SIZE
    assert np.std(cells.areas[whole]) < 0.07 * SIZE**2
    middle = np.hypot(*cells.centres[:, :2].T) < 1.5
    assert cells.areas[middle].mean() == pytest.approx(SIZE**2, rel=0.02)


def test_triangles_without_area_make_no_cells() -> None:
    use_variant("llvm")
    from optisense.optics.scene.surface_cells import build_cells

    points, faces = fan(400)
    far = np.array([[50.0, 0.0, 0.0], [60.0, 0.0, 0.0], [70.0, 0.0, 0.0]])
    last = len(points)
    with_line = np.concatenate([faces, [[last, last + 1, last + 2]]])
    cells = build_cells(np.concatenate([points, far]), with_line, SIZE)
    assert np.isfinite(cells.centres).all()
    assert cells.cells == build_cells(points, faces, SIZE).cells

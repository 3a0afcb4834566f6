"""Facts about free-form deformation."""

import numpy as np
import pytest

from optisense.errors import DesignError
from optisense.geometry import cage_points, cage_weights, deform

BOX = np.array([[-12.0, -10.0, -4.0], [13.0, 10.0, 0.5]])


def inside(count: int = 200) -> np.ndarray:
    return np.random.default_rng(1).uniform(BOX[0], BOX[1], size=(count, 3))


@pytest.mark.parametrize("resolution", [(2, 2, 2), (3, 3, 3), (4, 3, 7), (12, 2, 5)])
def test_a_cage_at_rest_changes_nothing(resolution: tuple[int, int, int]) -> None:
    weights = cage_weights(inside(), BOX, resolution)
    assert weights.shape == (200, np.prod(resolution))
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-12)
    assert weights.min() >= 0.0
    np.testing.assert_allclose(
        deform(weights, cage_points(BOX, resolution)), inside(), rtol=0, atol=1e-12
    )


def test_points_are_ordered_x_slowest_z_fastest() -> None:
    points = cage_points(BOX, (2, 3, 4)).reshape(2, 3, 4, 3)
    np.testing.assert_allclose(points[1, 0, 0], [13, -10, -4])
    np.testing.assert_allclose(points[0, 1, 0], [-12, 0, -4])
    np.testing.assert_allclose(points[0, 0, 1], [-12, -10, -2.5])


@pytest.mark.parametrize("resolution", [(3, 3, 3), (5, 4, 2)])
def test_an_affine_move_of_the_cage_moves_the_shape_with_it(
    resolution: tuple[int, int, int],
) -> None:
    rng = np.random.default_rng(2)
    matrix, shift = rng.normal(size=(3, 3)), rng.normal(size=3)
    weights = cage_weights(inside(), BOX, resolution)
    moved = deform(weights, cage_points(BOX, resolution) @ matrix.T + shift)
    np.testing.assert_allclose(moved, inside() @ matrix.T + shift, atol=1e-10)


def test_middle_row_of_27_lifts_the_top_by_a_parabola_of_half_the_height() -> None:
    """B_1(t) = 2 t (1 - t) has its top, 1/2, in the middle: 6 mm up gives 3 mm there."""
    points = cage_points(BOX, (3, 3, 3)).reshape(3, 3, 3, 3)
    points[1, :, 2, 2] += 6.0
    x = np.linspace(BOX[0, 0], BOX[1, 0], 21)
    top = np.column_stack([x, np.full(21, 3.0), np.full(21, BOX[1, 2])])
    lifted = deform(cage_weights(top, BOX, (3, 3, 3)), points.reshape(-1, 3))
    t = (x - BOX[0, 0]) / (BOX[1, 0] - BOX[0, 0])
    np.testing.assert_allclose(lifted[:, 2], BOX[1, 2] + 12.0 * t * (1.0 - t), atol=1e-12)
    np.testing.assert_allclose(lifted[:, :2], top[:, :2], atol=1e-12)
    assert lifted[10, 2] == pytest.approx(BOX[1, 2] + 3.0)
    bottom = top - [0, 0, BOX[1, 2] - BOX[0, 2]]
    unmoved = deform(cage_weights(bottom, BOX, (3, 3, 3)), points.reshape(-1, 3))
    np.testing.assert_allclose(unmoved, bottom, atol=1e-12)


def test_a_vertex_outside_the_box_is_refused_with_its_place() -> None:
    cage_weights([[13.0 + 1e-7, 0, 0]], BOX, (3, 3, 3))
    with pytest.raises(DesignError, match=r"\(0.000, 0.000, 2.000\)"):
        cage_weights([[0, 0, 0], [0, 0, 2.0]], BOX, (3, 3, 3))

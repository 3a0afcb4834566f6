"""Facts about free-form deformation."""

import numpy as np
import pytest

from optisense.errors import DesignError
from optisense.geometry import TriangleMesh, cage, cage_points, cage_weights, deform
from optisense.geometry.cage import (
    MOST_KEPT_WEIGHTS,
    deformed,
    is_one_to_one,
    jacobians,
    kept_weights,
    refined_points,
)

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


def box_mesh() -> TriangleMesh:
    return TriangleMesh.box(BOX[0], BOX[1], (6, 5, 3))


@pytest.mark.parametrize("resolution", [(3, 3, 3), (2, 5, 4)])
def test_an_affine_cage_scales_the_volume_by_its_determinant(
    resolution: tuple[int, int, int],
) -> None:
    matrix = np.array([[1.2, 0.3, 0.0], [-0.2, 0.9, 0.1], [0.1, 0.0, 1.5]])
    points = cage_points(BOX, resolution) @ matrix.T + [3.0, -2.0, 1.0]
    bent = deformed(box_mesh(), BOX, resolution, points)
    expected = np.linalg.det(matrix) * np.prod(BOX[1] - BOX[0])
    assert bent.volume == pytest.approx(expected, rel=1e-12)
    derivative = jacobians(inside(), BOX, resolution, points)
    np.testing.assert_allclose(derivative, np.broadcast_to(matrix, (200, 3, 3)), atol=1e-12)


def test_jacobians_are_the_derivatives_of_the_map() -> None:
    rng = np.random.default_rng(3)
    points = cage_points(BOX, (4, 3, 5)) + rng.normal(scale=0.8, size=(60, 3))
    places, step = 0.9 * inside(20), 1e-5
    numeric = np.stack(
        [
            (
                deform(cage_weights(places + step * way, BOX, (4, 3, 5)), points)
                - deform(cage_weights(places - step * way, BOX, (4, 3, 5)), points)
            )
            / (2.0 * step)
            for way in np.eye(3)
        ],
        axis=-1,
    )
    np.testing.assert_allclose(jacobians(places, BOX, (4, 3, 5), points), numeric, atol=1e-7)


@pytest.mark.parametrize("finer", [(3, 3, 3), (4, 3, 3), (5, 6, 4)])
def test_a_refined_cage_gives_the_same_shape(finer: tuple[int, int, int]) -> None:
    points = cage_points(BOX, (3, 3, 3)) + np.random.default_rng(4).normal(size=(27, 3))
    coarse = deform(cage_weights(inside(), BOX, (3, 3, 3)), points)
    fine = refined_points(points, (3, 3, 3), finer)
    np.testing.assert_allclose(deform(cage_weights(inside(), BOX, finer), fine), coarse, atol=1e-12)


def test_weights_are_kept_and_told_apart_by_box_and_resolution() -> None:
    mesh = box_mesh()
    weights = kept_weights(mesh, BOX, (3, 3, 3))
    assert kept_weights(mesh, BOX, (3, 3, 3)) is weights
    assert kept_weights(mesh, BOX + [[-1.0], [1.0]], (3, 3, 3)) is not weights
    assert kept_weights(mesh, BOX, (3, 4, 3)).shape[1] == 36
    with pytest.raises(ValueError, match="read-only"):
        weights[0, 0] = 2.0


def test_the_oldest_of_many_weights_are_dropped(monkeypatch: pytest.MonkeyPatch) -> None:
    meshes = [box_mesh() for _ in range(3)]
    monkeypatch.setattr(cage, "KEPT_WEIGHTS", 2 * 27 * len(meshes[0].vertices))
    first, *others = [kept_weights(mesh, BOX, (3, 3, 3)) for mesh in meshes]
    for mesh, weights in zip(meshes[1:], others, strict=True):
        assert kept_weights(mesh, BOX, (3, 3, 3)) is weights
    assert kept_weights(meshes[0], BOX, (3, 3, 3)) is not first
    cage._weights.clear()
    larger = BOX + [[-1.0], [1.0]]
    kept_weights(meshes[0], BOX, (3, 3, 3)), kept_weights(meshes[1], BOX, (3, 3, 3))
    newest = kept_weights(meshes[0], larger, (3, 3, 3))
    kept_weights(meshes[2], BOX, (3, 3, 3))
    assert kept_weights(meshes[0], larger, (3, 3, 3)) is newest


def test_a_fine_cage_without_kept_weights_agrees_with_one_that_keeps_them() -> None:
    vertices = inside(600)
    mesh = TriangleMesh(vertices, np.zeros((0, 3)))
    resolution = (20, 20, 20)
    assert len(vertices) * 8000 > MOST_KEPT_WEIGHTS
    points = cage_points(BOX, resolution)
    points += 0.1 * np.random.default_rng(5).normal(size=points.shape)
    expected = deform(cage_weights(vertices, BOX, resolution), points)
    np.testing.assert_allclose(
        deformed(mesh, BOX, resolution, points).vertices, expected, atol=1e-11
    )


class TestOneToOne:
    def test_rest_and_any_turn_are_certain(self) -> None:
        turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
        points = cage_points(BOX, (3, 3, 3))
        assert is_one_to_one(BOX, (3, 3, 3), points)
        assert is_one_to_one(BOX, (3, 3, 3), points @ turn.T)

    def test_a_mirror_image_and_a_fold_are_not(self) -> None:
        points = cage_points(BOX, (3, 3, 3))
        assert not is_one_to_one(BOX, (3, 3, 3), points * [-1, 1, 1])
        folded = points.reshape(3, 3, 3, 3).copy()
        folded[[0, 2], :, :, 0] = folded[[2, 0], :, :, 0]
        assert not is_one_to_one(BOX, (3, 3, 3), folded.reshape(-1, 3))

    def test_where_it_is_certain_jacobians_are_positive(self) -> None:
        rng = np.random.default_rng(6)
        certain = 0
        for scale in np.linspace(0.1, 6.0, 60):
            points = cage_points(BOX, (3, 3, 3)) + rng.normal(scale=scale, size=(27, 3))
            if is_one_to_one(BOX, (3, 3, 3), points):
                certain += 1
                assert np.linalg.det(jacobians(inside(), BOX, (3, 3, 3), points)).min() > 0.0
        assert 0 < certain < 60


def test_a_shape_asked_for_twice_is_one_object_and_another_shape_is_not() -> None:
    mesh = TriangleMesh.grid((2.0, 2.0), (4, 4))
    box = mesh.bounds + np.array([[-1.0], [1.0]])
    points = cage_points(box, (3, 3, 3))
    once = deformed(mesh, box, (3, 3, 3), points)
    assert deformed(mesh, box, (3, 3, 3), points.copy()) is once
    points[13, 2] += 0.5
    other = deformed(mesh, box, (3, 3, 3), points)
    assert other is not once
    assert other.vertices[:, 2].max() > once.vertices[:, 2].max()

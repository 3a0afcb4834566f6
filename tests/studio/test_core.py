"""What the extension computes without Blender."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from studio.core import cage, mesh_file, search_parameters
from studio.core.numbers import joined, kept, kept_array, short, split
from studio.core.pose import matrix_of, pose_of
from studio.core.rows import row_on_face

RNG = np.random.default_rng(7)


def test_numbers_survive_single_precision() -> None:
    for number in (0.1, 48.4, -9.88095238095238, 2.1, 1e-9, 12345.678901):
        assert kept(number, float(np.float32(number))) == number
    assert short(float(np.float32(0.3))) == 0.3
    assert kept(0.3, float(np.float32(0.4))) == 0.4
    assert kept(None, 1.5) == 1.5
    assert kept(True, 1.0) == 1.0  # a truth value is no number


def test_split_numbers_join_exactly() -> None:
    values = RNG.normal(size=(500, 3)) * 10.0 ** RNG.integers(-6, 5, size=(500, 3))
    assert np.array_equal(joined(split(values)), values)


def test_only_what_moved_changes_in_an_array() -> None:
    before = RNG.normal(size=(4, 3))
    shown = before.astype(np.float32)
    shown[2, 1] = 0.7
    after = kept_array(before, shown)
    assert after[2, 1] == 0.7
    after[2, 1] = before[2, 1]
    assert np.array_equal(after, before)


@pytest.mark.parametrize("up", [None, (0.2, 0.9, 0.1)])
def test_poses_come_back_as_they_were(up: tuple[float, float, float] | None) -> None:
    pose = {"position": [1.1, -2.2, 3.3], "direction": [0.3, -0.4, 2.0]}
    if up is not None:
        pose["up"] = list(up)
    matrix = matrix_of(pose["position"], pose["direction"], up).astype(np.float32)
    assert pose_of(matrix, pose, up=False) == pose


def test_a_turned_pose_says_where_it_looks() -> None:
    matrix = matrix_of((0, 0, 0), (1, 0, 0), (0, 0, 1))
    turned = pose_of(matrix, {"direction": [0.0, 0.0, 1.0], "position": [0, 0, 0]}, up=False)
    assert turned["direction"] == [1.0, 0.0, 0.0]
    assert turned["up"] == [0.0, 0.0, 1.0]


def test_a_cage_at_rest_changes_nothing_and_an_affine_one_moves_all_alike() -> None:
    box = np.array([[-3.0, -2.0, -1.0], [4.0, 5.0, 6.0]])
    vertices = RNG.uniform(*box, size=(200, 3))
    weights = cage.weights(vertices, box, (3, 4, 2))
    points = cage.rest_points(box, (3, 4, 2))
    assert np.allclose(weights @ points, vertices, atol=1e-12)
    turn = np.linalg.qr(RNG.normal(size=(3, 3)))[0]
    assert np.allclose(weights @ (points @ turn + 5.0), vertices @ turn + 5.0, atol=1e-12)


def test_a_cage_must_enclose_its_mesh() -> None:
    with pytest.raises(ValueError, match="outside the box"):
        cage.weights(np.array([[2.0, 0.0, 0.0]]), [[0, 0, 0], [1, 1, 1]], (2, 2, 2))


def test_a_lattice_has_the_edges_of_a_grid() -> None:
    nx, ny, nz = 3, 4, 5
    pairs = cage.edges((nx, ny, nz))
    assert len(pairs) == (nx - 1) * ny * nz + nx * (ny - 1) * nz + nx * ny * (nz - 1)
    points = cage.rest_points([[0, 0, 0], [2, 3, 4]], (nx, ny, nz))
    assert np.allclose(np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1), 1.0)


def test_meshes_are_written_and_read_exactly(tmp_path: Path) -> None:
    mesh = mesh_file.Mesh(
        RNG.normal(size=(5, 3)), np.array([[0, 1, 2], [2, 3, 4]]), RNG.normal(size=(5, 3))
    )
    mesh_file.write(mesh, tmp_path / "a" / "b.obj")
    read = mesh_file.read(tmp_path / "a" / "b.obj")
    assert np.array_equal(read.vertices, mesh.vertices)
    assert np.array_equal(read.faces, mesh.faces)
    assert read.normals is not None and np.array_equal(read.normals, mesh.normals)


def test_a_row_of_lights_lies_on_its_face_and_shines_to_the_target() -> None:
    corners = np.array([[-8, 15, -8], [8, 15, -8], [8, 15, -6], [-8, 15, -6]], dtype=float)
    row = row_on_face(corners, np.array([0, 1.0, 0]), np.zeros(3), 3, 4.0)
    assert [light["position"] for light in row] == [[-4, 15, -7], [0, 15, -7], [4, 15, -7]]
    assert all(light["direction"] == [0.0, -1.0, 0.0] for light in row)


def test_the_curve_of_a_search_rises_to_the_right() -> None:
    picture = search_parameters.curve_picture([0.1, None, 0.4, 0.9], (64, 32))
    orange = np.argwhere((picture[..., 0] > 0.9) & (picture[..., 2] < 0.3))
    left, right = orange[orange[:, 1] < 20], orange[orange[:, 1] > 50]
    assert left[:, 0].max() < right[:, 0].max()

"""Creases between flat faces, which are sharp, and edges of curved surfaces, which are smooth."""

from __future__ import annotations

import numpy as np
import pytest

from optisense.geometry import TriangleMesh, cage_points
from optisense.geometry.cage import deformed
from optisense.sensors._shapes import arc, revolve, ribbon

RISE = np.tan(np.radians(10.0))
EDGE = np.tan(np.radians(20.0))


@pytest.mark.parametrize("cells", [1, 12])
@pytest.mark.parametrize(
    "outline",
    [
        [(-8, 0), (0, 8 * RISE), (8, 0)],
        [(-8, 0), (-7, EDGE), (7, EDGE), (8, 0)],
        [(0, 0), (1, RISE), (2, 0), (3, RISE), (4, 0), (5, RISE)],
        [(-8, 0), (0, 8 * RISE), (8, 0), (8.3, -0.3)],
        [(-8.3, -0.3), (-8, 0), (0, 8 * RISE), (8, 0), (8.3, -0.3)],
    ],
    ids=["roof", "plate with two bevels", "rows of prisms", "roof, one bevel", "roof, two bevels"],
)
def test_flat_faces_remain_flat(outline: list[tuple[float, float]], cells: int) -> None:
    smooth = ribbon(outline, 3.0, cells).vertex_normals()
    assert smooth.normals is not None
    corners = smooth.normals[smooth.faces]
    np.testing.assert_allclose(corners, np.repeat(smooth.face_normals[:, None], 3, 1), atol=1e-9)
    assert len(smooth.vertices) == (len(outline) - 1) * 2 * (cells + 1)


@pytest.mark.parametrize(
    ("outline", "segments"),
    [
        ([[0, 0], [0, 3], [2, 3], [4, 4], [9, 4], [9, 0]], 60),
        ([[0, 0], [0, 3], [8, 3], [9, 2.42], [9, 0]], 12),
        ([[0, 0], [0, 3], [8, 3], [9, 2.42], [9, 0]], 16),
    ],
    ids=["recess", "bevel of 12 segments", "bevel of 16 segments"],
)
def test_shallow_conical_faces_have_sharp_rims(outline: list[list[float]], segments: int) -> None:
    plate = revolve(outline, segments).vertex_normals()
    assert plate.normals is not None
    flat = np.abs(plate.face_normals[:, 2]) > 0.999
    np.testing.assert_allclose(np.abs(plate.normals[plate.faces[flat], 2]), 1.0, atol=1e-9)


def test_a_ridge_is_sharp_beside_small_fillets() -> None:
    slope, *fillet = arc((7.913, -0.492), 0.5, 80.0, 0.0, 8)
    half = [slope, *fillet]
    roof = ribbon([*((-x, z) for x, z in half[::-1]), (0, 8 * RISE), *half], 3.0, 1)
    assert len(roof.vertex_normals().vertices) == len(roof.vertices) + 2


def test_a_deformed_crease_remains_sharp() -> None:
    roof = ribbon([(-8, 0), (0, 8 * RISE), (8, 0)], 3.0, 4)
    box = roof.bounds + [[-1.0], [1.0]]
    points = cage_points(box, (3, 3, 3))
    points[0] += 0.001
    bent = deformed(roof, box, (3, 3, 3), points)
    mirrored = bent.transformed(np.diag([1.0, 1.0, -1.0]))
    again = bent.deformed(1.1 * bent.vertices)
    halves = [bent.with_faces(bent.faces[k::2]).compacted() for k in range(2)]
    whole = TriangleMesh.joined(halves).welded()
    for mesh in (bent, again, bent.flipped(), mirrored, whole):
        assert len(mesh.vertex_normals().vertices) == len(roof.vertices) + 5
    assert bent.rest is not roof  # which is a weak key of caches that hold deformed meshes
    pair = TriangleMesh.joined([bent, roof.with_faces(roof.faces[::2])]).compacted()
    one_side = pair.with_faces(pair.faces[: len(bent.faces)]).compacted()
    assert len(one_side.vertex_normals().vertices) == len(roof.vertices) + 5


def test_the_order_of_the_array_of_faces_is_of_no_importance() -> None:
    roof = ribbon([(-8, 0), (0, 8 * RISE), (8, 0)], 3.0, 1)
    turned = TriangleMesh(roof.vertices, np.asfortranarray(roof.faces))
    assert turned.vertex_normals().equals(roof.vertex_normals())


@pytest.mark.parametrize(
    "outline",
    [
        arc((0.0, 0.0), 5.0, 0.0, 90.0, 3),
        [*arc((0.0, 0.0), 5.0, 0.0, 60.0, 6), *arc((5.0, 8.66), 5.0, 240.0, 180.0, 6)[1:]],
        [(-9, 0.0), *((x, np.sqrt(100 - x**2) - 10) for x in [0, 1, 2, 3, 3.1])],
        [arc((0.0, 0.0), 5.0, t, t, 1)[0] for t in [0, 6, 6.5, 7, 13, 13.5, 14, 20, 20.5, 21, 27]],
        [arc((0.0, 0.0), 5.0, t, t, 1)[0] for t in [0, 10, 11, 12, 22, 23, 24, 34]],
    ],
    ids=["arc of three facets", "S", "fillet that ends in a narrow facet", "uneven", "more uneven"],
)
def test_curves_remain_smooth(outline: list[tuple[float, float]]) -> None:
    sheet = ribbon(outline, 3.0, 1)
    assert len(sheet.vertex_normals().vertices) == len(sheet.vertices)


def test_irregular_triangles_remain_smooth() -> None:
    from scipy.spatial import Delaunay

    points = np.random.default_rng(1).uniform(-5, 5, (80, 2))
    lens = TriangleMesh(np.c_[points, (points**2).sum(axis=1) / 25], Delaunay(points).simplices)
    assert len(lens.vertex_normals().vertices) == len(points)

"""Straight rays against meshes."""

import numpy as np
import pytest

from optisense.geometry import TriangleMesh
from optisense.geometry.rays import ray_hits


def test_rays_through_a_box_enter_and_leave_where_its_planes_are():
    box = TriangleMesh.box((-1.0, -2.0, -3.0), (4.0, 2.0, 1.0))
    rng = np.random.default_rng(0)
    inside = rng.uniform((-0.9, -1.9, -2.9), (3.9, 1.9, 0.9), (300, 3))
    ways = rng.normal(size=(300, 3)) * rng.uniform(0.1, 10.0, (300, 1))
    hits = ray_hits(box, inside, ways)
    assert hits.ray.tolist() == list(range(300))
    planes = np.where(ways > 0.0, (4.0, 2.0, 1.0), (-1.0, -2.0, -3.0))
    leaves = ((planes - inside) / ways).min(axis=1)
    assert hits.distance == pytest.approx(leaves)
    before = ray_hits(box, inside - 100.0 * ways, ways)
    assert np.bincount(before.ray).tolist() == [2] * 300
    assert before.distance[1::2] == pytest.approx(100.0 + leaves)


def test_rays_meet_every_small_face_of_a_wide_mesh():
    sheet = TriangleMesh.grid((40.0, 40.0), (80, 80))
    rng = np.random.default_rng(1)
    starts = np.column_stack([rng.uniform(-19.9, 19.9, (500, 2)), np.full(500, 7.0)])
    hits = ray_hits(sheet, starts, np.tile([0.0, 0.0, -2.0], (500, 1)))
    assert np.unique(hits.ray).tolist() == list(range(500))
    assert hits.distance == pytest.approx(3.5)
    together = ray_hits(sheet, starts, (0.0, 0.0, -2.0))
    assert together.face.tolist() == hits.face.tolist()
    assert len(ray_hits(sheet, np.zeros((0, 3)), np.zeros((0, 3))).ray) == 0


def test_rays_through_edges_and_corners_meet_a_face_that_has_them():
    rng = np.random.default_rng(2)
    sheet = TriangleMesh.grid((25.25, 20.75), (17, 13))
    share = rng.uniform(size=(20_000, 1))
    ends = sheet.vertices[sheet.faces[rng.integers(len(sheet.faces), size=20_000), :2]]
    met = np.concatenate([share * ends[:, 0] + (1.0 - share) * ends[:, 1], sheet.vertices])
    met = met[(np.abs(met[:, :2]) < (12.6, 10.3)).all(axis=1)]
    ways = rng.normal(size=met.shape) + (0.0, 0.0, 2.0)
    ways[::3] = 0.0, 0.0, 1.0
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    for axes in (np.eye(3), turn):
        turned = TriangleMesh(sheet.vertices @ axes, sheet.faces)
        hits = ray_hits(turned, (met - 5.0 * ways) @ axes, ways @ axes)
        assert np.unique(hits.ray).tolist() == list(range(len(met)))
        assert hits.distance == pytest.approx(5.0)

"""Flat faces of many triangles, which are merged into few."""

from __future__ import annotations

import numpy as np
import pytest

import optisense
from optisense.geometry import TriangleMesh
from optisense.geometry.coplanar import merge_coplanar
from optisense.geometry.rotations import rotation


@pytest.fixture(scope="module")
def gel() -> TriangleMesh:
    """A box whose top has a fine grid: triangles of some 0.5 mm up to 16 mm from the origin."""
    return optisense.load("gelsight-mini-ideal").meshes["gel"]


def rounded(mesh: TriangleMesh, turn: np.ndarray, to: str) -> TriangleMesh:
    """The turned mesh as a file stores it."""
    points = mesh.vertices @ turn.T
    points = np.round(points, 6) if to == "1e-6 mm" else points.astype(np.float32)
    return mesh.with_vertices(points.astype(np.float64))


@pytest.mark.parametrize("to", ["single precision", "1e-6 mm"])
@pytest.mark.parametrize(
    ("axis", "angle"), [((1, 0, 0), 20), ((0, 0, 1), 10), ((0, 0, 1), 30), ((1, 2, 3), 77)]
)
def test_a_turned_and_rounded_box_remains_closed(
    gel: TriangleMesh, axis: tuple[int, int, int], angle: float, to: str
) -> None:
    turned = rounded(gel, rotation(axis, angle), to)
    merged = merge_coplanar(turned)
    assert merged.is_closed
    assert len(merged.faces) < len(gel.faces) / 10
    assert merged.volume == pytest.approx(gel.volume, rel=1e-6)
    assert merged.area == pytest.approx(gel.area, rel=1e-6)


def test_a_point_is_left_out_only_where_all_patches_leave_it_out() -> None:
    """A side whose lower edge is bent is not merged, so the top keeps the point on their edge."""
    box = TriangleMesh.box((0, 0, 0), (2, 1, 1), (2, 1, 1))
    assert len(merge_coplanar(box).faces) == 12
    points = box.vertices.copy()
    points[np.all(points == (1, 0, 0), axis=1), 1] = -1e-4
    bent = merge_coplanar(box.with_vertices(points))
    assert bent.is_closed
    assert bent.volume == pytest.approx(box.with_vertices(points).volume, rel=1e-12)


def test_a_sensor_with_a_gel_in_single_precision_can_be_simulated(gel: TriangleMesh) -> None:
    from optisense.optics import OpticalModel

    design = optisense.load("gelsight-mini-ideal")
    turn = rotation((1, 0, 0), 20)
    design.meshes["gel"] = rounded(gel, turn, "single precision").transformed(turn.T)
    assert OpticalModel(design).scenes.pieces

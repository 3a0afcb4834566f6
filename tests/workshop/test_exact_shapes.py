"""Exact surfaces found again in meshes, and STEP files of them."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import trimesh
from step_extra import needs_step

from optisense.design import Role
from optisense.geometry import TriangleMesh
from optisense.sensors._half_round import HalfRound, stacked
from optisense.sensors._shapes import revolve
from optisense.workshop._profiles import pieces
from optisense.workshop._recognised import box_sides, extrusion_of, turned
from optisense.workshop._step_format import write_step
from optisense.workshop.shapes import Shape

SAUCER = [(0.0, 0.0), (3.0, 0.0), *[(3.0 + math.sin(t), 1.0 - math.cos(t)) for t in
          np.linspace(0.2, math.pi / 2, 12)], (0.0, 1.0)]  # fmt: skip


def volume_read(mesh: TriangleMesh, folder: Path) -> float:
    """mm3 of the only body of a STEP file of a mesh."""
    from optisense.geometry.step import read_step

    assert write_step(folder / "it.step", [Shape("it", Role.SUPPORT, None, mesh)]) == []
    (body,) = read_step(folder / "it.step")
    assert body.solid
    return body.mesh.volume


def plate_with_a_hole(sections: int) -> TriangleMesh:
    plate = trimesh.creation.annulus(r_min=3.0, r_max=10.0, height=2.0, sections=sections)
    return TriangleMesh(plate.vertices, plate.faces).welded()


class TestProfiles:
    def test_a_smooth_run_of_no_circle_is_a_curve(self) -> None:
        x = np.linspace(-1.0, 1.0, 20)
        (piece,) = pieces(np.column_stack([x, x**2]))
        assert piece.kind == "curve"
        np.testing.assert_array_equal(piece.points[:, 0], x)

    def test_long_sides_at_small_angles_are_straight(self) -> None:
        """Eight sides of 10 mm that turn by 8 degrees stand 0.17 mm off a curve."""
        ways = np.radians(8.0 * np.arange(8))
        ways[::2] += 0.02  # no circle
        steps = 10.0 * np.column_stack([np.cos(ways), np.sin(ways)])
        corners = np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])
        assert [piece.kind for piece in pieces(corners)] == ["line"] * 8

    def test_a_mitred_end_of_a_curve_is_straight(self) -> None:
        x = np.linspace(-1.0, 1.0, 20)
        corners = np.concatenate([np.column_stack([x, 0.2 * x**2]), [(1.9, 0.56)]])
        curve, end = pieces(corners)
        assert (curve.kind, end.kind) == ("curve", "line")
        np.testing.assert_array_equal(curve.points, corners[:-1])

    def test_a_polygon_stays_one(self) -> None:
        angle = np.linspace(0.0, 2.0 * np.pi, 7)
        hexagon = np.column_stack([np.cos(angle), np.sin(angle)])
        assert [piece.kind for piece in pieces(hexagon)] == ["line"] * 6


class TestRecognised:
    @pytest.mark.parametrize("axis", [0, 1, 2])
    def test_a_turned_body_about_each_axis(self, axis: int) -> None:
        mesh = revolve(SAUCER, 40)
        moved = np.roll(mesh.vertices, axis - 2, axis=1) + (1.0, -2.0, 3.0)
        found = turned(TriangleMesh(moved, mesh.faces))
        assert found is not None
        assert found.axis == axis
        off = np.delete(found.centre - (1.0, -2.0, 3.0), axis)
        np.testing.assert_allclose(off, 0.0, atol=1e-5)
        assert found.profile[:, 0].max() == pytest.approx(4.0)

    def test_a_ball_and_a_bent_plate_are_neither(self) -> None:
        ball = trimesh.creation.icosphere(subdivisions=2)
        mesh = TriangleMesh(ball.vertices, ball.faces)
        assert turned(mesh) is None
        assert extrusion_of(mesh) is None
        assert box_sides(mesh) == []

    def test_a_box_has_six_sides_that_look_outward(self) -> None:
        box = TriangleMesh.box((0, 0, 0), (1, 2, 3), (2, 2, 2))
        sides = box_sides(box)
        assert len(sides) == 6
        for corners in sides:
            normal = np.cross(corners[1, 0] - corners[0, 0], corners[0, 1] - corners[0, 0])
            assert normal @ (corners.mean(axis=(0, 1)) - (0.5, 1.0, 1.5)) > 0.0


@needs_step
@pytest.mark.usefixtures("forks")
class TestStepFiles:
    def test_a_cut_cylinder_is_round_again(self, tmp_path: Path) -> None:
        found = volume_read(plate_with_a_hole(48), tmp_path)
        assert found == pytest.approx(math.pi * (100.0 - 9.0) * 2.0, rel=5e-4)

    def test_a_turned_body_is_round_again(self, tmp_path: Path) -> None:
        coarse, fine = revolve(SAUCER, 24), revolve(SAUCER, 2000)
        assert volume_read(coarse, tmp_path) == pytest.approx(fine.volume, rel=2e-3)
        assert coarse.volume < 0.99 * fine.volume

    def test_a_tub_of_arcs_has_its_volume(self, tmp_path: Path) -> None:
        def ring(width: float, z: float) -> np.ndarray:
            points = HalfRound(width, width, 0.1 * width, 0.0).points(0.5)
            return np.column_stack([points, np.full(len(points), z)])

        def area(width: float) -> float:
            corners = 2.0 * (1.0 - math.pi / 4.0) * (0.1 * width) ** 2
            return width**2 + math.pi / 2.0 * (width / 2.0) ** 2 - corners

        tub = stacked([ring(8.0, 1.0), ring(8.0, 5.0), ring(10.0, 5.0), ring(10.0, 0.0)]).flipped()
        expected = 5.0 * area(10.0) - 4.0 * area(8.0)
        assert volume_read(tub, tmp_path) == pytest.approx(expected, rel=1e-3)
        assert (tmp_path / "it.step").stat().st_size < 60_000

    def test_what_stays_cut_into_triangles_is_told(self, tmp_path: Path) -> None:
        from optisense.geometry.step import read_step

        ball = trimesh.creation.icosphere(subdivisions=2)
        mesh = TriangleMesh(ball.vertices, ball.faces)
        (note,) = write_step(tmp_path / "it.step", [Shape("ball", Role.SUPPORT, None, mesh)])
        assert note.startswith("ball is written as 320 triangles")
        (body,) = read_step(tmp_path / "it.step")
        assert body.mesh.volume == pytest.approx(mesh.volume)

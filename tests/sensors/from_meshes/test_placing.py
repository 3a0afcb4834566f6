"""Where lights and the camera go."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import trimesh

from optisense.design import Camera
from optisense.design.camera_checks import lens_problem
from optisense.errors import DesignError
from optisense.geometry import TriangleMesh
from optisense.geometry.mesh import grid_faces
from optisense.sensors.from_meshes._lights import over, ring, row
from optisense.sensors.from_meshes._placement import make_camera
from optisense.sensors.from_meshes.recipe import CameraChoice
from optisense.sensors.from_meshes.recipe_lights import LightRow, LightsOver, Ring
from optisense.sensors.from_meshes.surfaces import pick

BOUNDS = np.array([[-12.0, -10.0, -3.0], [12.0, 10.0, 1.0]])


def places(lights: list[Any]) -> np.ndarray:
    return np.array([light.position for light in lights])


def ways(lights: list[Any]) -> np.ndarray:
    return np.array([light.direction for light in lights])


class TestRow:
    def test_pitch_gap_and_middle(self) -> None:
        lights = row(LightRow(part="plate", side="+y", count=4, pitch=5.0, gap=0.3), BOUNDS)
        np.testing.assert_allclose(
            places(lights), [[x, 10.3, -1.0] for x in (-7.5, -2.5, 2.5, 7.5)]
        )
        np.testing.assert_allclose(ways(lights), [[0, -1, 0]] * 4)

    def test_without_a_pitch_each_is_in_the_middle_of_its_share(self) -> None:
        lights = row(LightRow(part="plate", side="-x", count=4, height=-2.5), BOUNDS)
        np.testing.assert_allclose(
            places(lights), [[-12.2, y, -2.5] for y in (-7.5, -2.5, 2.5, 7.5)]
        )

    def test_it_cannot_run_into_its_own_side(self) -> None:
        with pytest.raises(DesignError, match="can't run along x"):
            row(LightRow(part="plate", side="+x", along="x", count=2), BOUNDS)


class TestRing:
    @pytest.mark.parametrize("axis", ["+x", "-y", "+z"])
    def test_a_full_ring_is_regular_and_looks_to_its_axis(self, axis: str) -> None:
        lights = ring(Ring(part="p", axis=axis, count=8, radius=5.0), BOUNDS)
        centre = BOUNDS.mean(axis=0)
        np.testing.assert_allclose(np.linalg.norm(places(lights) - centre, axis=1), 5.0, atol=1e-6)
        steps = np.linalg.norm(np.diff(places(lights), axis=0), axis=1)
        np.testing.assert_allclose(steps, 2 * 5.0 * np.sin(np.pi / 8), atol=1e-5)
        np.testing.assert_allclose(5.0 * ways(lights), centre - places(lights), atol=1e-5)

    def test_an_arc_has_a_light_at_each_end(self) -> None:
        lights = ring(Ring(part="p", count=4, radius=2.0, start=0.0, end=90.0, height=7.0), BOUNDS)
        np.testing.assert_allclose(places(lights)[[0, -1]], [[2, 0, 7], [0, 2, 7]], atol=1e-6)

    def test_outside_of_the_part(self) -> None:
        lights = ring(Ring(part="p", count=2, gap=0.5), BOUNDS)
        np.testing.assert_allclose(places(lights)[0], [12.5, 0, -1], atol=1e-6)


class TestOver:
    board = TriangleMesh.box((-20, -5, 0), (20, 5, 1.6))

    def spots(self, mesh: TriangleMesh, **choice: Any) -> list[Any]:
        shape = LightsOver(file="board.stl", towards="+z", **choice)
        return over(shape, mesh, pick(mesh, shape, "lights"), "lights")

    def test_a_grid_over_a_board(self) -> None:
        lights = self.spots(self.board, count=[3, 2], pitch=[10.0, 4.0], gap=0.1)
        expected = [[x, y, 1.7] for y in (-2, 2) for x in (-10, 0, 10)]
        np.testing.assert_allclose(sorted(places(lights).tolist()), sorted(expected), atol=1e-6)
        np.testing.assert_allclose(ways(lights), [[0, 0, 1]] * 6, atol=1e-9)

    def test_spread_evenly(self) -> None:
        lights = self.spots(self.board, count=4)
        np.testing.assert_allclose(np.sort(places(lights)[:, 0]), [-15, -5, 5, 15], atol=1e-6)

    def test_one_on_each_patch(self) -> None:
        two = TriangleMesh.joined([self.board, TriangleMesh.box((0, 20, 0), (2, 22, 3))])
        lights = self.spots(two, patches="all")
        np.testing.assert_allclose(places(lights), [[0, 0, 1.65], [1, 21, 3.05]], atol=1e-6)

    def test_off_the_board_is_refused(self) -> None:
        with pytest.raises(DesignError, match="off it, or in a hole"):
            self.spots(self.board, count=5, pitch=12.0)

    def test_over_a_ball_the_pitch_runs_along_the_surface(self) -> None:
        ball = trimesh.creation.icosphere(subdivisions=5, radius=10.0)
        mesh = TriangleMesh(ball.vertices, ball.faces).welded()
        shape = LightsOver(file="b.stl", towards="+z", within=60, count=3, pitch=5.0, gap=0.5)
        lights = over(shape, mesh, pick(mesh, shape, "lights"), "lights")
        np.testing.assert_allclose(np.linalg.norm(places(lights), axis=1), 10.5, atol=0.01)
        np.testing.assert_allclose(ways(lights), places(lights) / 10.5, atol=0.02)
        cosine = np.einsum("ij,ij->i", places(lights)[1:], places(lights)[:-1]) / 10.5**2
        np.testing.assert_allclose(np.arccos(cosine), 5.0 / 10.0, atol=0.01)

    @pytest.mark.parametrize(("count", "angles"), [(5, [-72, -36, 0, 36, 72]), ([2, 1], [-45, 45])])
    def test_lights_are_spread_over_the_whole_arc(self, count: Any, angles: list[float]) -> None:
        """In a half pipe of 12 facets, in whose middle is an edge."""
        turn = np.radians(np.linspace(-90.0, 90.0, 13))
        arc = np.stack([np.zeros(13), 10.0 * np.sin(turn), -10.0 * np.cos(turn)], axis=1)
        vertices = np.concatenate([arc - (8.0, 0.0, 0.0), arc + (8.0, 0.0, 0.0)])
        lights = self.spots(TriangleMesh(vertices, grid_faces(2, 13)), count=count, within=85)
        found = np.degrees(np.arctan2(places(lights)[:, 1], -places(lights)[:, 2]))
        np.testing.assert_allclose(np.sort(found), angles, atol=0.2)

    @staticmethod
    def half_pipe(hole: Callable[[Any, Any], Any]) -> TriangleMesh:
        """A half pipe of radius 10 mm in 16 x 24 cells, without those where `hole` is true of x and
        the angle in degrees.
        """
        turn = np.radians(np.linspace(-90.0, 90.0, 25))
        arc = np.stack([np.zeros(25), 10.0 * np.sin(turn), -10.0 * np.cos(turn)], axis=1)
        vertices = np.concatenate([arc + (x, 0.0, 0.0) for x in np.linspace(-8.0, 8.0, 17)])
        faces = grid_faces(17, 25)
        corners = vertices[faces].reshape(2, -1, 3, 3)  # two triangles of each cell
        x, y, z = np.moveaxis(corners.mean(axis=(0, 2)), 1, 0)
        return TriangleMesh(vertices, faces[~np.tile(hole(x, np.degrees(np.arctan2(y, -z))), 2)])

    @pytest.mark.parametrize(
        ("hole", "angles"),
        [
            (lambda x, angle: (abs(x) < 1) & (abs(angle) < 7.5), [-67.5, -22.5, 22.5, 67.5]),
            (lambda x, angle: (abs(x) < 1) & (abs(angle) < 37.5), [-45.0, 45.0]),
            (
                lambda x, angle: (
                    (abs(x) < 1) & (abs(angle) < 15) | (abs(x - 2) < 2) & (abs(angle - 4) < 4)
                ),
                [-67.5, -22.5, 22.5, 67.5],
            ),
        ],
        ids=["square", "slot", "L"],
    )
    def test_a_hole_of_a_curved_board_does_not_move_its_row(
        self, hole: Callable[[Any, Any], Any], angles: list[float]
    ) -> None:
        lights = self.spots(self.half_pipe(hole), count=[len(angles), 1], within=88)
        x, y, z = places(lights).T
        np.testing.assert_allclose(np.sort(np.degrees(np.arctan2(y, -z))), angles, atol=0.4)
        np.testing.assert_allclose(x, 0.0, atol=1e-6)

    def test_a_light_in_a_hole_of_a_curved_board_is_refused(self) -> None:
        board = self.half_pipe(lambda x, angle: (abs(x) < 1) & (angle > 15) & (angle < 30))
        with pytest.raises(DesignError, match="off it, or in a hole"):
            self.spots(board, count=[4, 1], within=88)

    def test_a_row_over_several_curved_pieces(self) -> None:
        """As over flat ones, it is spread over all of them."""
        pieces = self.half_pipe(lambda x, angle: (abs(angle) > 45) | (abs(abs(x) - 2) < 1))
        lights = self.spots(pieces, count=[2, 1], within=88, patches="all")
        np.testing.assert_allclose(places(lights)[:, :2], [[-4.0, 0.0], [4.0, 0.0]], atol=1e-6)

    def test_a_row_around_a_body_is_refused(self) -> None:
        body = TriangleMesh.box((-3, -2, -2), (3, 2, 2))
        above = TriangleMesh.grid((20.0, 20.0), (2, 2))
        both = TriangleMesh.joined([body, TriangleMesh(above.vertices + (0, 0, 5), above.faces)])
        with pytest.raises(DesignError, match="no edge at the ends of a row"):
            self.spots(both, count=3, within=180, patches="all")

    def test_a_surface_that_looks_everywhere_is_refused(self) -> None:
        shape = LightsOver(file="b.stl", count=3)
        with pytest.raises(DesignError, match="faces all sides"):
            over(shape, self.board, pick(self.board, shape, "lights"), "lights")


class TestCamera:
    skin = TriangleMesh.grid((16.0, 12.0), (4, 4)).flipped()  # looks to -z

    def camera(self, **choice: Any) -> Camera:
        place = choice.pop("place", None)
        return make_camera(CameraChoice(model="pi-v2", **choice), self.skin, place, np.zeros(3), {})

    def test_behind_the_skin_it_fills_the_picture(self) -> None:
        camera = self.camera(resolution=(320, 240))
        right, up, ahead = camera.axes()
        way = self.skin.vertices - np.array(camera.position)
        reach = np.tan(np.radians(camera.fov) / 2)
        u = (way @ right) / (way @ ahead) / reach
        v = (way @ up) / (way @ ahead) / reach * 320 / 240
        assert np.abs(u).max() <= 1 + 1e-6 and np.abs(v).max() <= 1 + 1e-6
        assert max(np.abs(u).max(), np.abs(v).max()) == pytest.approx(1.0, abs=1e-5)
        assert camera.position[2] < 0 and camera.direction == pytest.approx((0, 0, 1))

    def test_it_stays_out_of_parts(self) -> None:
        free = np.array(self.camera().position)
        parts = {"plate": TriangleMesh.box((-9, -9, free[2] - 2), (9, 9, free[2] + 2))}
        choice = CameraChoice(model="pi-v2")
        moved = make_camera(choice, self.skin, None, np.zeros(3), parts).position
        assert moved[2] <= free[2] - 3.0  # a millimetre behind the plate

    def test_it_looks_at_its_target(self) -> None:
        camera = self.camera(place=np.array([3.0, 4.0, -12.0]))
        np.testing.assert_allclose(camera.direction, np.array([-3, -4, 12]) / 13, atol=1e-8)

    def test_a_wide_view_needs_a_fisheye(self) -> None:
        problem = lens_problem(self.camera(fov=170.0), "fov")
        assert "projection: equidistant" in str(problem.hint)
        assert not lens_problem(self.camera(fov=170.0, projection="equidistant"), "fov")

    @pytest.mark.parametrize(
        ("choice", "message"),
        [
            ({"place": np.zeros(3)}, "at the point that it looks at"),
            ({"place": np.array([0, 0, -9.0]), "up": "+z"}, "parallel to up"),
        ],
    )
    def test_poses_that_make_no_picture(self, choice: dict[str, Any], message: str) -> None:
        with pytest.raises(DesignError, match=message):
            self.camera(**choice)

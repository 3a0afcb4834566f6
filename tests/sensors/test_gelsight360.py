"""GelSight360: its shapes against closed forms, its ring of lights, and what it refuses."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from optisense import sensors
from optisense.design import SensorDesign
from optisense.geometry.containment import inside
from optisense.optics import OpticalModel
from optisense.sensors._tip_shape import TipShape

from .conftest import ModelOf

R, HEIGHT, GEL, SHELL = 14.0, 34.0, 3.0, 2.5
"""Default dimensions, mm."""

FACETS = 2e-3
"""Relative error of a volume or area of round shapes that are divided into facets of 0.5 mm."""


@pytest.fixture(scope="module")
def design() -> SensorDesign:
    return sensors.gelsight360()


@pytest.fixture(scope="module")
def model(model_of: ModelOf) -> OpticalModel:
    return model_of("gelsight360")


def capsule(radius: float) -> float:
    """mm^3 of a cylinder 20 mm high with a hemisphere on it."""
    return math.pi * radius**2 * 20.0 + 2.0 / 3.0 * math.pi * radius**3


class TestShapes:
    def test_the_round_tip_is_a_cylinder_with_a_hemisphere(self) -> None:
        meshes = sensors.gelsight360(tessellation=0.5).meshes
        gel, shell = R - GEL, R - GEL - SHELL
        assert meshes["gel"].volume == pytest.approx(capsule(R) - capsule(gel), rel=FACETS)
        assert meshes["shell"].volume == pytest.approx(capsule(gel) - capsule(shell), rel=FACETS)
        area = 2.0 * math.pi * R * (20.0 + R)
        assert meshes["skin"].area == pytest.approx(area, rel=FACETS)
        assert meshes["base"].area == pytest.approx(math.pi * (R**2 - shell**2), rel=FACETS)

    def test_the_flat_tip_is_a_cylinder_with_a_rounded_edge(self) -> None:
        """Pappus: a quarter circle of radius e about a core of radius c."""
        skin = sensors.gelsight360(tip_design=0.0, tessellation=0.5).meshes["skin"]
        e, c = 7.0, 7.0
        wall = 2.0 * math.pi * R * (HEIGHT - e)
        edge = 2.0 * math.pi * (c * 0.5 * math.pi * e + e**2)
        assert skin.area == pytest.approx(wall + edge + math.pi * c**2, rel=FACETS)
        top = skin.vertices[skin.vertices[:, 2] > HEIGHT - 1e-9]
        assert np.hypot(top[:, 0], top[:, 1]).max() == pytest.approx(c, rel=FACETS)

    @pytest.mark.parametrize("tip_design", [0.0, 2.0, 5.0, 6.0, 10.0])
    def test_each_tip_has_the_volume_of_its_parallel_bodies(self, tip_design: float) -> None:
        """By Steiner's formula for bodies parallel to a cone of radius c and height h."""
        meshes = sensors.gelsight360(tip_design=tip_design, tessellation=0.5).meshes
        shape = TipShape.of_family(tip_design / 10.0, R, HEIGHT, 7.0, 12.0)
        c, h, lean = shape.core, shape.cone, math.radians(shape.lean)
        slant, bent = math.hypot(c, h), h + c * lean

        def volume(e: float) -> float:
            tip = c**2 * h / 3.0 + c * slant * e + bent * e**2 + 2.0 / 3.0 * e**3
            return math.pi * ((c + e) ** 2 * shape.shoulder + tip)

        e = shape.edge
        area = math.pi * (2.0 * R * shape.shoulder + c * slant + 2.0 * bent * e + 2.0 * e**2)
        assert meshes["gel"].volume == pytest.approx(volume(e) - volume(e - GEL), rel=FACETS)
        assert meshes["skin"].area == pytest.approx(area, rel=FACETS)

    def test_tips_go_from_flat_to_conical_at_one_height(self) -> None:
        widths = []
        for tip_design in (0.0, 2.5, 5.0, 7.5, 10.0):
            skin = sensors.gelsight360(tip_design=tip_design).meshes["skin"].vertices
            assert skin[:, 2].max() == pytest.approx(HEIGHT)
            assert np.hypot(skin[:, 0], skin[:, 1]).max() == pytest.approx(R)
            profile = skin[np.argsort(skin[:, 2])]
            widths.append(
                np.interp(HEIGHT - 2.0, profile[:, 2], np.hypot(profile[:, 0], profile[:, 1]))
            )
        assert np.all(np.diff(widths) < 0.0)

    def test_layers_are_as_thick_as_asked_everywhere(self) -> None:
        meshes = sensors.gelsight360(tip_design=8.0, gel_thickness=2.0).meshes
        outer = meshes["skin"].vertices
        shell = meshes["shell"].vertices
        nearest = np.array([np.linalg.norm(outer - point, axis=1).min() for point in shell[::7]])
        outside = nearest[nearest < 2.2]
        assert len(outside) > 50
        np.testing.assert_allclose(outside, 2.0, atol=0.02)

    def test_resin_designs_lower_the_innermost_dome(self) -> None:
        plain = sensors.gelsight360()
        top = plain.meshes["shell"].vertices[:, 2]
        for number, left in ((0.0, 1.0), (4.0, 0.64), (10.0, 0.1)):
            shell = sensors.gelsight360(resin_design=number).meshes["shell"]
            on_axis = np.hypot(*shell.vertices[:, :2].T) < 0.2
            inner = shell.vertices[on_axis, 2].min()
            assert inner == pytest.approx(20.0 + 8.5 * left)
            assert shell.vertices[:, 2].max() == top.max()
            lost = 2.0 / 3.0 * math.pi * 8.5**3 * (1.0 - left)
            assert shell.volume - plain.meshes["shell"].volume == pytest.approx(
                lost, rel=0.02, abs=1e-6
            )

    @pytest.mark.parametrize(
        "change",
        [{"tip_design": 0.0}, {"tip_design": 10.0}, {"resin_design": 10.0}, {"base_ring": ""}],
    )
    def test_the_whole_family_is_in_order(self, change: dict[str, Any]) -> None:
        member = sensors.gelsight360(**change)
        assert sensors.check(member) == []
        for name in ("gel", "shell", "boards"):
            assert member.meshes[name].is_closed
            assert member.meshes[name].volume > 0.0


class TestLights:
    def test_each_letter_colours_a_group(self) -> None:
        lit = sensors.gelsight360(light_colours="RGBRGBRG", base_ring="")
        letters = {(1.0, 0.0, 0.0): "R", (0.0, 1.0, 0.0): "G", (0.0, 0.0, 1.0): "B"}
        assert "".join(letters[tuple(g.colour)] for g in lit.lights.values()) == "RGBRGBRG"
        assert list(lit.lights) == [f"lg{number}" for number in range(1, 9)]

    def test_groups_go_round_anticlockwise_in_facing_pairs(self, design: SensorDesign) -> None:
        for number in range(1, 9):
            lights = design.lights[f"lg{number}"].lights
            places = np.array([light.position for light in lights])
            ways = np.array([light.direction for light in lights])
            around = np.degrees(np.arctan2(places[:, 1], places[:, 0])) % 360.0
            board = 90.0 * (number // 2 % 4)
            away = (around - board + 180.0) % 360.0 - 180.0
            turn = np.cross(places, ways)[:, 2]
            side = 1.0 if number % 2 else -1.0
            assert (side * away > 0.0).all() and (side * away < 15.0).all()
            assert (side * turn > 0.0).all()

    def test_boards_and_the_bodies_on_them_have_their_volume(self, design: SensorDesign) -> None:
        board = (SHELL - 0.3) * 1.0 * 12.0
        body = 1.25 * 2.0 * 1.0
        expected = 4.0 * (board + 2 * 4 * body)
        assert design.meshes["boards"].volume == pytest.approx(expected)

    def test_leds_stand_in_the_wall_clear_of_their_boards(self, design: SensorDesign) -> None:
        places = np.array([li.position for g in design.lights.values() for li in g.lights])
        assert inside(places, design.meshes["shell"]).all()
        assert not inside(places, design.meshes["boards"]).any()

    def test_the_picture_is_as_symmetric_as_the_ring(self, model: OpticalModel) -> None:
        """Turned by a quarter, each group lights the same share of a square picture."""
        image = model.render([], resolution=(72, 72), photons=400_000)
        means = np.array([image.layers[f"lg{k}"].mean() for k in range(1, 9)])
        np.testing.assert_allclose(means, means.mean(), rtol=0.04)

    def test_rays_reach_the_skin_or_end_on_boards_and_base(self, model: OpticalModel) -> None:
        rays = model.chief_rays((160, 120))
        assert rays.hit.mean() > 0.89
        assert rays.hit[40:80, 60:100].all()  # forward, nothing is in the way
        radius = np.hypot(rays.points[..., 0], rays.points[..., 1])
        np.testing.assert_allclose(radius[rays.hit & (rays.points[..., 2] < 20.0)], R, atol=0.03)

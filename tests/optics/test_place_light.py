"""The light at a point: irradiance, kinds of paths, and directions."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from test_housing import RADIUS, SHARE, sphere
from typer.testing import CliRunner

import optisense as ots
from optisense.cli import app
from optisense.errors import ContactError, RenderError
from optisense.geometry import TriangleMesh
from optisense.optics import OpticalModel, light_at
from optisense.optics.place_light import WAY_WORDS, _area_within
from optisense.optics.transport.place_light import Disc, LightWay

PHOTONS = 300_000


def disc(radius: float, middle: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Disc:
    x, y, z = np.eye(3)
    return Disc(np.array(middle), z, x, y, radius)


@pytest.mark.parametrize("side", [1.0, 100.0])
def test_the_area_of_a_disc_does_not_depend_on_the_triangles(side: float) -> None:
    corners = side * np.array([(-1.0, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)])
    square = TriangleMesh(corners, np.array([(0, 1, 2), (0, 2, 3)]))
    assert _area_within(square.triangles, disc(0.7)) == pytest.approx(np.pi * 0.49, rel=0.004)
    half = disc(0.7, (side, 0.0, 0.0))
    assert _area_within(square.triangles, half) == pytest.approx(np.pi * 0.49 / 2, rel=0.01)


def test_a_white_sphere_lights_its_port_as_the_formula_says() -> None:
    """A narrow lamp shines on the wall opposite the port. All of the port's light is scattered by
    the wall: r / (1 - r (1 - f)) of the power over the area of the sphere. What is scattered once,
    1 - r (1 - f) of it, comes from straight above; the rest comes from the wall evenly, which the
    port sees up to 90 - 40 / 2 degrees off its normal, sin(45)^2 / sin(70)^2 of it within 45.
    """
    reflectance = 0.9
    found = light_at(OpticalModel(sphere(reflectance)), (0.0, 0.0), PHOTONS).groups["white"]
    area = 4 * np.pi * RADIUS**2
    once = 1 - reflectance * (1 - SHARE)
    assert found.irradiance == pytest.approx(3.0 / area * reflectance / once, rel=0.08)
    assert found.noise < 0.04
    assert found.of_mean == pytest.approx(1.0, abs=0.08)
    assert found.ways[WAY_WORDS[LightWay.SCATTERED_BY_PARTS]] == pytest.approx(1.0)
    within = once + (1 - once) * 0.5 / np.sin(np.radians(70.0)) ** 2
    assert found.sky[:4].sum() + found.sky[4].sum() / 2 == pytest.approx(within, abs=0.05)
    assert found.sky.sum() == pytest.approx(1.0)


def test_angle_and_azimuth_of_a_single_lamp_are_those_of_its_direction() -> None:
    """The camera looks along +z with +y up, so that -x is the right of the picture."""
    design = sphere(None)
    place = np.array([4.0, 1.0, -3.0])
    towards = np.array([0.0, 0.0, RADIUS]) - place
    light = design.lights["white"].lights[0]
    pose = {"position": tuple(place), "direction": tuple(towards)}
    design.lights["white"].lights = [light.model_copy(update=pose)]
    found = light_at(OpticalModel(design), (0.0, 0.0), PHOTONS).groups["white"]
    angle = np.degrees(np.arccos(towards[2] / np.linalg.norm(towards)))
    assert found.mean_angle == pytest.approx(angle, abs=0.3)
    assert found.main_azimuth == pytest.approx(np.degrees(np.arctan2(1.0, -4.0)), abs=0.5)


def test_the_groups_of_a_mini_come_from_their_sides_of_the_picture(
    plain_mini: OpticalModel,
) -> None:
    """As they do in the real one: red from the top, green from the right, blue from below."""
    model = plain_mini
    middle = light_at(model, (0.0, 0.0), PHOTONS)
    for group, azimuth in (("red", 90.0), ("green", 0.0), ("blue", -90.0)):
        assert middle.groups[group].main_azimuth == pytest.approx(azimuth, abs=12.0)
        assert sum(middle.groups[group].ways.values()) == pytest.approx(1.0)
    # Beside the lamps of one group, others lie too far off for direct light.
    corner = light_at(model, (-6.0, 4.0), PHOTONS)
    direct = WAY_WORDS[LightWay.REFRACTED]
    assert corner.groups["red"].of_mean < 0.6 < 1.2 < corner.groups["blue"].of_mean
    assert corner.groups["red"].ways[direct] < 0.5 < middle.groups["red"].ways[direct]
    # A point in the frame of the design means the same place.
    again = light_at(model, (*corner.point.tolist(),), PHOTONS)  # type: ignore[arg-type]
    assert again.groups["red"].irradiance == pytest.approx(corner.groups["red"].irradiance)


def test_noise_is_the_spread_of_other_seeds() -> None:
    model = OpticalModel(sphere(0.8))
    runs = [light_at(model, (0.0, 0.0), 20_000, seed).groups["white"] for seed in range(16)]
    stated = np.mean([run.noise for run in runs])
    spread = np.std([run.irradiance for run in runs], ddof=1) / runs[0].irradiance
    assert 0.5 * stated < spread < 2.0 * stated


def test_what_can_t_be_is_refused_and_dark_groups_are_left_out() -> None:
    design = ots.load("gelsight-mini-ideal")
    design.lights["red"].flux = 0.0
    model = OpticalModel(design)
    found = light_at(model, np.zeros(2), np.int64(20_000))  # type: ignore[arg-type]
    told = json.loads(json.dumps(found.as_data(), allow_nan=False))
    assert list(told["groups"]) == ["green", "blue"]
    assert (told["at"], told["photons"]) == ([0.0, 0.0], 20_000)
    with pytest.raises(ContactError, match="off the sensing surface"):
        light_at(model, (50.0, 0.0), 20_000)
    with pytest.raises(RenderError, match="too few"):
        light_at(model, (0.0, 0.0), 100)


def test_the_command_tells_prints_and_draws_it(tmp_path: Path) -> None:
    few = ["--photons", "20000", "--out", str(tmp_path)]
    done = CliRunner().invoke(
        app, ["ledger", "gelsight-mini-ideal", "--at", "-6,4", "--at=0,0", *few]
    )
    assert done.exit_code == 0, done.output
    assert "light at (-6, 4) mm" in done.output and "refracted only (%)" in done.output
    data = json.loads((tmp_path / "ledger.json").read_text())
    assert [place["at"] for place in data["places"]] == [[-6.0, 4.0], [0.0, 0.0]]
    page = (tmp_path / "ledger.html").read_text(encoding="utf-8")
    assert page.count('<svg class="dome"') == 6
    done = CliRunner().invoke(app, ["ledger", "gelsight-mini-ideal", "--at", "left"])
    assert done.exit_code != 0 and "place 'left'" in done.output

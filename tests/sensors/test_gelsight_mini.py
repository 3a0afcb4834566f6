"""GelSight Mini and its curved variants as built in."""

from __future__ import annotations

import math
from importlib.resources import as_file, files
from pathlib import Path

import numpy as np
import pytest

import optisense
from optisense import library, sensors
from optisense.calibration.model_pictures import levels_of, matched_exposure
from optisense.design import SensorDesign, save_design
from optisense.errors import CalibrationError, DesignError
from optisense.library import LightEntry
from optisense.picture_files import read_picture
from optisense.report.real_sensor import BALL_PLACE, PICTURE

FIELD_OF_VIEW = (18.6, 14.3)
"""Field of view (mm) on the gel, from the maker's datasheet."""


@pytest.fixture(scope="module", params=[n for n in sensors.SENSORS.names() if "mini" in n])
def sensor(request: pytest.FixtureRequest) -> SensorDesign:
    return sensors.build(request.param)


def test_the_gel_lies_flat_on_the_tray(sensor: SensorDesign) -> None:
    gel, tray = (sensor.deformed_meshes()[name].bounds for name in ("gel", "tray"))
    np.testing.assert_allclose([gel[0, 2], tray[1, 2]], -4.25, atol=1e-9)
    np.testing.assert_allclose(gel[:, :2], [[-12.625, -10.375], [12.625, 10.375]], atol=1e-9)


def test_flat_gel_volume_is_its_box() -> None:
    gel = sensors.gelsight_mini_ideal().meshes["gel"]
    assert gel.volume == pytest.approx(25.25 * 20.75 * 4.25)


def test_the_camera_sees_the_published_part_of_the_gel() -> None:
    """Trace the outermost ray of the image's width and height through the flat layers."""
    camera = sensors.gelsight_mini_ideal().camera
    half_width = math.tan(math.radians(camera.fov / 2))
    half_height = half_width * camera.resolution[1] / camera.resolution[0]
    for slope, length, tolerance in zip(
        (half_width, half_height), FIELD_OF_VIEW, (1e-3, 0.04), strict=True
    ):
        angle = math.atan(slope)
        in_acrylic = math.asin(math.sin(angle) / 1.491)
        in_gel = math.asin(math.sin(angle) / 1.41)
        seen = 13.0 * slope + 5.0 * math.tan(in_acrylic) + 4.25 * math.tan(in_gel)
        assert 2.0 * seen == pytest.approx(length, rel=tolerance)


def test_the_lights_face_the_guide_across_a_gap() -> None:
    design = sensors.gelsight_mini_ideal()
    low, high = design.meshes["guide"].bounds
    for group in design.lights.values():
        assert len(group.lights) == 5
        for light in group.lights:
            position, direction = np.array(light.position), np.array(light.direction)
            outside = np.maximum(low - position, position - high).max()
            assert outside == pytest.approx(0.2)
            inward = position + 0.3 * direction
            assert ((inward > low) & (inward < high)).all()


def test_light_comes_from_top_right_and_bottom_of_the_picture() -> None:
    """As published ball presses shade: red +94..+99, green -4..-7, blue -63..-76 degrees."""
    design = sensors.gelsight_mini_ideal()
    right, up, _ = design.camera.axes()
    for name, angle in {"red": 90, "green": 0, "blue": -90}.items():
        centre = np.mean([light.position for light in design.lights[name].lights], axis=0)
        assert math.degrees(math.atan2(centre @ up, centre @ right)) == pytest.approx(angle)


def test_the_cylinder_is_bent_along_x_only() -> None:
    skin = sensors.gelsight_mini_ideal_cylindrical().deformed_meshes()["skin"].vertices
    x = skin[:, 0] / 25.25 + 0.5
    np.testing.assert_allclose(skin[:, 2], 6.0 * 2 * x * (1 - x), atol=1e-9)


def test_the_dome_is_highest_in_the_middle() -> None:
    skin = sensors.gelsight_mini_ideal_spherical().deformed_meshes()["skin"].vertices
    x, y = skin[:, 0] / 25.25 + 0.5, skin[:, 1] / 20.75 + 0.5
    np.testing.assert_allclose(skin[:, 2], 9.0 * 4 * x * (1 - x) * y * (1 - y), atol=1e-9)


def test_the_first_sensor_marks_what_is_assumed() -> None:
    provenance = sensors.gelsight_mini_ideal().provenance
    for path in ("parts.guide", "lights.red", "camera.position", "materials.silicone-xp565.ior"):
        assert provenance[path].status == "assumed"


def test_dimensions_can_be_chosen() -> None:
    design = sensors.gelsight_mini_ideal(gel_thickness=3.0, leds_per_group=8, led_pitch=2.8)
    assert design.meshes["gel"].bounds[0, 2] == -3.0
    assert design.camera.position[2] == -3.0 - 1.0 - 17.0
    assert len(design.lights["blue"].lights) == 8
    assert sensors.check(design) == []
    assert design.description.endswith("chosen: gel_thickness 3, leds_per_group 8, led_pitch 2.8")


def test_a_bent_sensor_takes_dimensions_too() -> None:
    design = sensors.gelsight_mini_ideal_spherical(rise=4.0, gel_thickness=3.0)
    skin = design.deformed_meshes()["skin"].bounds
    assert skin[1, 2] == pytest.approx(1.0, abs=0.01)  # a quarter of the rise
    assert design.meshes["gel"].bounds[0, 2] == -3.0
    assert design.provenance["cages.skin.points"].status == "assumed"
    assert "bent to a dome, ideal camera; chosen: gel_thickness 3" in design.description
    assert sensors.check(design) == []


@pytest.mark.parametrize("name", ["gelsight-mini-ideal", "gelsight-svelte", "gelsight360"])
def test_leds_are_as_bright_as_their_weakest_colour_can_be(name: str) -> None:
    for group in sensors.build(name).lights.values():
        known = library.entry("light", group.model)
        assert isinstance(known, LightEntry)
        assert group.flux == min(light.flux or 0.0 for light in known.typical.values())


class TestLoad:
    def test_by_name(self) -> None:
        assert optisense.load("gelsight-mini-ideal").name == "gelsight-mini-ideal"

    def test_by_folder(self, tmp_path: Path) -> None:
        save_design(sensors.gelsight_mini_ideal(), tmp_path / "mine")
        assert optisense.load(tmp_path / "mine").name == "gelsight-mini-ideal"
        assert optisense.load(str(tmp_path / "mine")).name == "gelsight-mini-ideal"

    def test_a_misspelt_name(self) -> None:
        with pytest.raises(DesignError, match="Did you mean 'gelsight-mini'"):
            optisense.load("gelsight_mini")

    def test_a_name_that_is_also_a_folder(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        save_design(sensors.gelsight_mini_ideal_spherical(), tmp_path / "gelsight-mini-ideal")
        monkeypatch.chdir(tmp_path)
        with pytest.raises(DesignError, match="also a folder"):
            optisense.load("gelsight-mini-ideal")
        assert optisense.load("./gelsight-mini-ideal").name == "gelsight-mini-ideal-spherical"
        assert optisense.load("builtin:gelsight-mini-ideal").name == "gelsight-mini-ideal"

    def test_an_unknown_light_is_an_error(self) -> None:
        design = sensors.gelsight_mini_ideal()
        design.lights["red"].model = "smd-3529"
        with pytest.raises(DesignError, match="Did you mean 'smd-3528'"):
            sensors.check(design)


class TestFitted:
    """The Mini that was fitted to photographs of a real unit."""

    def test_what_was_fitted_says_so(self) -> None:
        design = sensors.gelsight_mini()
        fitted = {p for p, known in design.provenance.items() if known.status == "calibrated"}
        assert fitted >= {f"lights.{name}.flux" for name in design.lights}
        assert fitted >= {"camera.position", "camera.tone_curve", "camera.shading"}
        assert "20.3" in design.provenance["camera.fov"].source
        assert fitted >= {"parts.guide.faces", "parts.tray.faces", "camera.stray_light"}
        for path in fitted:
            assert "GelSLAM" in design.provenance[path].source
        assert design.provenance["parts.tray"].status == "sourced"

    def test_bent_ones_have_the_same_light_and_camera(self) -> None:
        flat = sensors.gelsight_mini()
        for bent in (sensors.gelsight_mini_cylindrical(), sensors.gelsight_mini_spherical()):
            assert (bent.camera, bent.lights) == (flat.camera, flat.lights)
            assert bent.parts.keys() == flat.parts.keys() and bent.cages != flat.cages

    def test_it_takes_dimensions(self) -> None:
        flat, thin = sensors.gelsight_mini(), sensors.gelsight_mini(gel_thickness=3.0)
        across, along = thin.camera.position[:2], thin.camera.position[2]
        assert across == flat.camera.position[:2]  # the fitted place across its axis
        assert along == pytest.approx(flat.camera.position[2] + 1.25)  # behind the tray, as before
        assert thin.description.endswith("of a real unit; chosen: gel_thickness 3")
        assert thin.lights["red"].flux == flat.lights["red"].flux
        assert sensors.gelsight_mini(led_flux=2.0).lights["red"].flux == 2.0

    def test_it_sees_as_much_of_the_skin_as_photographs_show(self) -> None:
        model = optisense.OpticalModel(sensors.gelsight_mini())
        points = model.chief_rays((160, 120)).points
        seen = np.linalg.norm(points[60, -1] - points[60, 0]) * 160 / 159
        assert seen == pytest.approx(20.3, rel=0.025)

    def test_its_background_is_that_of_a_real_unit(self) -> None:
        """28 dB away from the ball of a published picture, where the ideal one has far less."""
        with as_file(files("optisense.report") / "real" / PICTURE) as path:
            real = read_picture(path, CalibrationError).astype(np.float64)
        real = real.reshape(120, 2, 160, 2, 3).mean(axis=(1, 3))
        rows, columns = np.mgrid[:120, :160] + 0.5
        away = np.hypot(columns - BALL_PLACE[0] / 2, rows - BALL_PLACE[1] / 2) > 45.0
        ratios = []
        for name in ("gelsight-mini", "gelsight-mini-ideal"):
            model = optisense.OpticalModel(sensors.build(name))
            image = model.render(resolution=(160, 120), photons=200_000)
            chain = image.chain.without_noise()
            exposure = matched_exposure(image.radiance, chain, np.round(real).astype(np.uint8))
            error = levels_of(image.radiance, chain, exposure) - real
            ratios.append(20.0 * math.log10(255.0 / math.sqrt((error[away] ** 2).mean())))
        assert ratios[0] > 28.0, ratios
        assert ratios[1] < ratios[0] - 8.0, ratios

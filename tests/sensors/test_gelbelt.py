"""GelBelt: its shapes against closed forms, and what the film of air does to light."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest

from optisense import sensors
from optisense.design import SensorDesign
from optisense.geometry.containment import inside
from optisense.optics import OpticalModel
from optisense.optics.imaging.tactile_image import TactileImage
from optisense.optics.ledger import SEEN, light_ledger
from optisense.optics.transport.chief_rays import RayOutcome

WIDTH, GEL, TAPE, FILM, WINDOW = 36.0, 3.0, 0.05, 0.02, 6.0
WHEEL, ROLLER, DEFLECTION, INCLINE = 25.0, 1.0, 35.0, 25.0
"""Default dimensions, mm and degrees."""

ROLLER_AT = 25.0 + 1.0 + ROLLER
"""Distance (mm) from the middle to the point where the belt meets the small roller."""


@pytest.fixture(scope="module", params=[1, 2, 3])
def belt(request: pytest.FixtureRequest) -> SensorDesign:
    return sensors.gelbelt(light_design=request.param, tessellation=0.7)


def bent_volume(thickness: float, inner: float, degrees: float) -> float:
    """mm^3 of a layer bent over a wheel, `inner` mm from the wheel's axis to the layer."""
    outer = inner + thickness
    return WIDTH * 0.5 * math.radians(degrees) * (outer**2 - inner**2)


def layer_volume(light_design: int, thickness: float, below: float) -> float:
    """mm^3 of a layer of the belt that begins `below` mm above the belt's inner face."""
    plain = WIDTH * 45.0 * thickness + bent_volume(thickness, WHEEL + below, 90.0)
    if light_design < 3:
        return 2.0 * plain
    bent = WIDTH * (ROLLER_AT + INCLINE) * thickness
    bent += bent_volume(thickness, ROLLER + below, DEFLECTION)
    bent += bent_volume(thickness, WHEEL + below, 90.0 - DEFLECTION)
    return plain + bent


def light_design_of(belt: SensorDesign) -> int:
    return int(belt.description.split("light design ")[1][0])


class TestShapes:
    def test_gel_and_tape_are_layers_of_even_thickness(self, belt: SensorDesign) -> None:
        number = light_design_of(belt)
        gel, tape = belt.meshes["gel"], belt.meshes["tape"]
        assert gel.volume == pytest.approx(layer_volume(number, GEL, TAPE), rel=1e-4)
        assert tape.volume == pytest.approx(layer_volume(number, TAPE, 0.0), rel=1e-4)

    def test_the_skin_covers_the_gel_between_the_wheels(self, belt: SensorDesign) -> None:
        if light_design_of(belt) < 3:
            expected = WIDTH * 90.0
        else:
            turned = math.radians(DEFLECTION) * (ROLLER + TAPE + GEL)
            expected = WIDTH * (45.0 + ROLLER_AT + turned + INCLINE)
        assert belt.meshes["skin"].area == pytest.approx(expected, rel=1e-3)

    def test_coatings_look_into_the_gel(self, belt: SensorDesign) -> None:
        for name in ("skin", "far-coat"):
            coat = belt.meshes[name]
            middles = coat.triangles.mean(axis=1)[::29]
            into = 0.1 * coat.face_normals[::29]
            assert inside(middles + into, belt.meshes["gel"]).all()
            assert not inside(middles - into, belt.meshes["gel"]).any()

    def test_everything_else_is_watertight_and_looks_outward(self, belt: SensorDesign) -> None:
        sizes = {"window": 50.0 * WIDTH * WINDOW, "film": 50.0 * WIDTH * FILM}
        for name in ("gel", "tape", "film", "window", "wheels"):
            assert belt.meshes[name].is_closed, name
            assert belt.meshes[name].volume > 0.0
        for name, volume in sizes.items():
            assert belt.meshes[name].volume == pytest.approx(volume)

    def test_wheels_are_cylinders_just_clear_of_the_tape(self, belt: SensorDesign) -> None:
        radii = [WHEEL, WHEEL] + [ROLLER] * (light_design_of(belt) == 3)
        expected = sum(math.pi * (radius - 0.02) ** 2 * WIDTH for radius in radii)
        assert belt.meshes["wheels"].volume == pytest.approx(expected, rel=2e-3)
        assert not inside(belt.meshes["wheels"].vertices, belt.meshes["tape"]).any()

    def test_film_fills_the_gap_between_tape_and_window(self, belt: SensorDesign) -> None:
        film, window = (belt.meshes[name].bounds for name in ("film", "window"))
        assert film[1, 2] == -GEL - TAPE
        assert film[0, 2] == window[1, 2] == pytest.approx(-GEL - TAPE - FILM)

    def test_roller_turns_the_belt_by_the_deflection(self) -> None:
        belt = sensors.gelbelt(light_design=3, deflection=20.0, incline=40.0)
        middles = belt.meshes["skin"].triangles.mean(axis=1)
        on_incline = (middles[:, 0] < -32.0) & (middles[:, 0] > -60.0)
        normals = belt.meshes["skin"].face_normals[on_incline]
        tilt = math.radians(20.0)
        np.testing.assert_allclose(
            normals, [[math.sin(tilt), 0.0, -math.cos(tilt)]] * len(normals), atol=1e-9
        )


class TestView:
    def test_each_ray_meets_the_belt_where_snells_law_says(self) -> None:
        """Through air, acrylic, the film, tape and gel; over the whole picture."""
        belt = sensors.gelbelt()
        rays = OpticalModel(belt).chief_rays((64, 48))
        assert (rays.outcome == RayOutcome.HIT).all()
        camera = belt.camera
        right, up, forward = camera.axes()
        x, y = np.meshgrid((np.arange(64) + 0.5) / 32.0 - 1.0, 0.75 - (np.arange(48) + 0.5) / 32.0)
        half = math.tan(math.radians(camera.fov / 2.0))
        ways = (x * half)[..., None] * right + (y * half)[..., None] * up + forward
        ways /= np.linalg.norm(ways, axis=2, keepdims=True)
        level = 42.0 - GEL - TAPE - FILM - WINDOW
        layers = [(level, 1.0), (WINDOW, 1.491), (FILM, 1.0), (TAPE, 1.49), (GEL, 1.41)]
        sine = np.hypot(ways[..., 0], ways[..., 1])
        reach = sum(t * sine / np.sqrt(n**2 - sine**2) for t, n in layers)
        expected = ways[..., :2] / sine[..., None] * reach[..., None]
        np.testing.assert_allclose(rays.points[..., :2], expected, atol=2e-3)
        np.testing.assert_allclose(rays.points[..., 2], 0.0, atol=2e-3)


@cache
def image_of(light_design: int) -> TactileImage:
    """A rendered belt; each row of LEDs has its own layer."""
    belt = sensors.gelbelt(light_design=light_design)
    return OpticalModel(belt).render([], resolution=(64, 48), photons=100_000)


@cache
def red_on_the_belt(
    light_design: int, film_thickness: float = FILM, window_index: float = 1.491
) -> float:
    """Share of the red light that ends on the skin that the camera sees."""
    belt = sensors.gelbelt(light_design=light_design, film_thickness=film_thickness)
    acrylic = belt.materials["acrylic"].model_copy(update={"ior": window_index})
    belt.materials["acrylic"] = acrylic
    return light_ledger(OpticalModel(belt), 100_000).share("red", SEEN)


class TestLight:
    def test_the_film_keeps_light_from_the_side_of_the_acrylic_off_the_belt(self) -> None:
        """What enters the side of acrylic (n > sqrt 2) meets its top beyond the critical angle:
        cos(asin(1/n)) > 1/n. Only where the tape touches the acrylic, light gets to the belt."""
        without = red_on_the_belt(1, film_thickness=0.0)
        assert without > 0.1
        assert red_on_the_belt(1) < 1e-2 * without

    def test_a_window_of_low_index_would_leak_through_the_film(self) -> None:
        """Below n = sqrt 2 a part of that light meets the top within the critical angle."""
        assert red_on_the_belt(1, window_index=1.3) > 30.0 * red_on_the_belt(1)

    def test_light_through_the_sides_of_the_belt_is_not_held_up_by_the_film(self) -> None:
        assert red_on_the_belt(2) > 100.0 * red_on_the_belt(1)

    def test_green_gets_farther_along_a_belt_bent_over_a_roller(self) -> None:
        """What light design 3 is for (OptiSense paper, GelBelt)."""
        reach = []
        for image in (image_of(2), image_of(3)):
            green, x = image.layers["green"].sum(axis=2), image.points[..., 0]
            edge = green[(x > -22.0) & (x < -15.0)].mean()
            reach.append(float(green[np.abs(x) < 7.0].mean() / edge))
        assert reach[1] > 1.5 * reach[0]

    def test_red_and_blue_come_from_opposite_sides_and_green_from_minus_x(self) -> None:
        image = image_of(3)
        x, y = image.points[..., 0], image.points[..., 1]
        red, green, blue = (image.layers[name].sum(axis=2) for name in ("red", "green", "blue"))
        assert red[y > 9.0].mean() > 2.0 * red[y < -9.0].mean()
        assert blue[y < -9.0].mean() > 2.0 * blue[y > 9.0].mean()
        assert green[x < -12.0].mean() > 2.0 * green[x > 12.0].mean()


class TestDimensions:
    def test_options_are_built_and_in_order(self) -> None:
        other = sensors.gelbelt(
            light_design=2, window_size=(40.0, 30.0), window_thickness=4.0, gel_thickness=4.0,
            film_thickness=0.0, wheel_radius=22.0, wheel_distance=80.0, pupil_distance=38.0,
            leds_per_group=6, led_flux=(1.0, 2.0, 3.0), tessellation=1.5,
        )  # fmt: skip
        assert sensors.check(other) == []
        assert "film" not in other.parts
        assert [group.flux for group in other.lights.values()] == [1.0, 2.0, 3.0]
        assert other.meshes["window"].bounds[1, 2] == -4.05

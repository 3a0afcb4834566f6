"""Arguments that no sensor can have: refused by every builder, whatever is wrong with them."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from typing import Any

import pytest

from optisense import sensors
from optisense.design import SensorDesign
from optisense.errors import DesignError

Builder = Callable[..., SensorDesign]

REFUSED: dict[Builder, list[tuple[dict[str, Any], str, str]]] = {
    sensors.digit: [
        ({"led_height": 7.0}, "not on the acrylic's edge", ""),
        ({"led_pitch": 60.0}, "passes the middle of the half round", ""),
        ({"edge_roughness": 1.5}, "edge_roughness is 1.5", ""),
        ({"pupil_distance": 9.0}, "inside the acrylic", ""),
        ({"dome_rise": 3.0}, "the gel is only", ""),
        ({"edge_inset": 5.0}, "leaves no dome", ""),
        ({"straight_length": 10.0}, "leaves no straight side", ""),
    ],
    sensors.gelbelt: [
        ({"light_design": 4}, "no light_design 4", "1 (sides of the acrylic)"),
        ({"gel_thickness": 0.0}, "gel_thickness is 0", "above 0"),
        ({"gel_thickness": 2.0}, "don't fit beside a layer of 2 mm", "thicker"),
        ({"film_thickness": 0.001}, "film_thickness is 0.001", "optical contact"),
        ({"film_thickness": math.nan}, "film_thickness is nan", "optical contact"),
        ({"pupil_distance": 8.0}, "inside the belt or the window", "pupil_distance larger"),
        ({"pupil_distance": 60.0}, "meets the returning belt", "wheel_radius larger"),
        ({"wheel_distance": 40.0, "light_design": 2}, "flat run", "wheel_distance larger"),
        ({"wheel_distance": 60.0, "light_design": 2}, "cuts into", "wheel_distance"),
        ({"incline": 5.0}, "cuts into the window or the camera's view", "incline"),
        ({"roller_radius": 40.0}, "inside a wheel of radius 40 mm", "roller_radius"),
        ({"leds_per_group": 12}, "longer than a side of the window", "fewer"),
        ({"fov": 180.0}, "fov is 180", "less than 180"),
        ({"deflection": 70.0}, "deflection is 70", "at most 60"),
        ({"green_angle": 85.0}, "green_angle is 85", "0 to 80"),
        ({"specularity": 1.5}, "specularity is 1.5", "0 to 1"),
        ({"led_flux": (1.0, -2.0, 1.0)}, "led_flux", "mW"),
        ({"light_design": "3"}, "light_design is '3'", ""),
    ],
    sensors.gelsight360: [
        ({"light_colours": "GRRGGRR"}, "has 7 letters, 8 are needed", "GRRGGRRG"),
        ({"light_colours": "GRRGGRRGG"}, "has 9 letters", "8 letters"),
        ({"light_colours": "GRRGXRRG"}, "unknown colour 'X' at place 5", "R, G and B"),
        ({"base_ring": "W"}, "base_ring 'W'", "no ring"),
        ({"shell_thickness": 12.0}, "not thinner than the body", "thinner"),
        ({"gel_thickness": 5.0}, "not thinner than edge_radius", "edge_radius larger"),
        ({"edge_radius": 14.0}, "not smaller than the radius", "edge_radius smaller"),
        ({"shell_thickness": 1.0}, "don't fit into a shell of 1 mm", "at least"),
        ({"tip_design": 11.0}, "tip_design is 11", "0 to 10"),
        ({"resin_design": -1.0}, "resin_design is -1", "0 to 10"),
        ({"height": 12.0}, "the whole sensor only 12 mm", "height larger"),
        ({"board_height": 25.0}, "reach from z = 2 to 27 mm", "board_height"),
        ({"leds_per_group": 7}, "7 LEDs of 2 mm don't fit", "fewer"),
        ({"base_leds": 10}, "10 LEDs is not possible", "multiple of 4"),
        ({"gel_thickness": 0.0}, "gel_thickness is 0", "above 0"),
        ({"fov": 400.0}, "fov is 400.0: it should be less", ""),
        ({"board_thickness": 10.0}, "corners of the LED boards", "smaller"),
    ],
    sensors.gelsight_mini_ideal: [
        ({"led_gap": 0.0}, "led_gap is 0", "above 0"),
        ({"gel_thickness": math.nan}, "gel_thickness is nan", "above 0"),
        ({"gel_size": (30.0, 20.0)}, "larger than its tray", "tray_size larger"),
        ({"pupil_distance": 3.0}, "inside the light guide", "larger than guide_thickness"),
        ({"leds_per_group": 9}, "9 LEDs 4 mm apart", "fewer"),
        ({"view_width": 500.0}, "view_width 500", "smaller"),
        ({"view_width": 0.0}, "view_width 0", "above 0"),
        ({"fov": 190.0}, "the camera can't be: .* less than 180 degrees", ""),
        ({"led_flux": -1.0}, "flux is -1.0: it should be greater", ""),
        ({"leds_per_group": 2.5}, "leds_per_group is 2.5.*whole number", ""),
    ],
    sensors.gelsight_mini_ideal_cylindrical: [
        ({"rise": "high"}, "rise is 'high'", "Give a number"),
        ({"rise": -9.0}, "through its tray", "more than -8.5 mm"),
    ],
    sensors.gelsight_mini_ideal_spherical: [
        ({"gel_thickness": "3"}, "gel_thickness is '3'", ""),
    ],
    sensors.gelsight_svelte: [
        (
            {"m1_ends": ((16.8, 40.0), (16.0, 80.0))},
            "nearer than 0.5 mm to the skin",
            "at most",
        ),
        ({"m1_ends": ((21.0, 30.0), (18.0, 80.0))}, "flat mirror M1", "away from the palm"),
        ({"gel_thickness": 6.5}, "does not fit", "gel_thickness smaller"),
        ({"gel_thickness": 0.0}, "gel_thickness is 0", "above 0"),
        ({"led_gap": float("nan")}, "led_gap is nan", "above 0"),
        ({"m2_length": 24.3}, "see M1 past the gel", "m2_length smaller"),
        ({"m2_bottom": (-16.7, -2.8)}, "does not face the camera", "above 0"),
        ({"leds_per_side": 20}, "longer than the palm", "fewer"),
        ({"leds_per_side": 0}, "too small", "one LED"),
        ({"view": "back"}, "no view 'back'", "m2 or palm"),
        ({"palm_outline": ((1.0, 2.0), (3.0, 4.0))}, "three or more", "(x, z)"),
        (
            {"back_outline": ((5.0, -7.7), (5.0, 5.0), (6.6, 93.0))},
            "is not inside the body near",
            "outward",
        ),
        (
            {"m1_ends": ((14.0, 3.0), (10.4, 88.2))},
            "between the camera and M2",
            "towards the tip",
        ),
        ({"leds_per_side": 1.5}, "leds_per_side is 1.5", ""),
    ],
}
"""Arguments of each builder, words of the error, and words of its hint."""


@pytest.mark.parametrize(
    ("builder", "given", "message", "hint"),
    [(builder, *case) for builder, cases in REFUSED.items() for case in cases],
)
def test_what_no_sensor_can_have(
    builder: Builder, given: dict[str, Any], message: str, hint: str
) -> None:
    with pytest.raises(DesignError, match=message) as caught:
        builder(**given)
    assert hint in str(caught.value.hint)
    assert caught.value.where


def test_help_still_names_the_arguments() -> None:
    assert (
        inspect.signature(sensors.gelsight_mini_ideal).parameters["gel_thickness"].default == 4.25
    )
    assert "gel_thickness: thickness of the gel, mm" in str(sensors.gelsight_mini_ideal.__doc__)

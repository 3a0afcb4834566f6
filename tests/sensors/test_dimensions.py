"""Arguments that no sensor can have: refused by every builder, whatever is wrong with them."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any

import pytest

from optisense import sensors
from optisense.design import SensorDesign
from optisense.errors import DesignError

Builder = Callable[..., SensorDesign]


@pytest.mark.parametrize(
    ("builder", "given", "message"),
    [
        (
            sensors.gelsight_mini_ideal,
            {"fov": 190.0},
            "the camera can't be: .* less than 180 degrees",
        ),
        (sensors.gelsight_mini_ideal, {"led_flux": -1.0}, "flux is -1.0: it should be greater"),
        (
            sensors.gelsight_mini_ideal,
            {"leds_per_group": 2.5},
            "leds_per_group is 2.5.*whole number",
        ),
        (
            sensors.gelsight_mini_ideal_cylindrical,
            {"rise": "high"},
            "rise is 'high'.*Give a number",
        ),
        (sensors.gelsight_mini_ideal_spherical, {"gel_thickness": "3"}, "gel_thickness is '3'"),
        (sensors.gelsight360, {"fov": 400.0}, "fov is 400.0: it should be less"),
        (sensors.gelsight360, {"board_thickness": 10.0}, "corners of the LED boards.*smaller"),
        (sensors.gelsight_svelte, {"leds_per_side": 1.5}, "leds_per_side is 1.5"),
        (sensors.gelbelt, {"light_design": "3"}, "light_design is '3'"),
    ],
)
def test_what_no_sensor_can_have(builder: Builder, given: dict[str, Any], message: str) -> None:
    with pytest.raises(DesignError, match=message):
        builder(**given)


def test_help_still_names_the_arguments() -> None:
    assert (
        inspect.signature(sensors.gelsight_mini_ideal).parameters["gel_thickness"].default == 4.25
    )
    assert "gel_thickness: thickness of the gel, mm" in str(sensors.gelsight_mini_ideal.__doc__)

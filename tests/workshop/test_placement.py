"""Where LEDs go: the table says again what the design says, and boards are flat."""

from __future__ import annotations

import csv
import io

import numpy as np
import pytest

from optisense.design import Light, LightGroup, SensorDesign
from optisense.design.lights import frame_of
from optisense.workshop import placements
from optisense.workshop._placement import placement_csv

DIRECTIONS = [
    (1, 0, 0),
    (0, -2, 0),
    (0, 0, 1),
    (0, 0, -1),
    (1, 2, 3),
    (0.3, -0.1, -5),
    (0, 1e-9, 1),
]


def with_lights(design: SensorDesign, *lights: Light, **changes: object) -> SensorDesign:
    """The design with these lights as its only group."""
    result = design.copy()
    group = {"model": "smd-3528", "colour": (0, 1, 0), "flux": 2.0, **changes}
    result.lights = {"only": LightGroup.model_validate({**group, "lights": list(lights)})}
    return result


@pytest.mark.parametrize("direction", DIRECTIONS)
@pytest.mark.parametrize("angle", [-170.0, -90.0, 0.0, 33.0, 180.0])
def test_rotation_is_how_far_up_is_turned(
    flat: SensorDesign, direction: tuple[float, float, float], angle: float
) -> None:
    """Counter-clockwise from in front: a quarter turn brings up to where left was."""
    right, up, forward = frame_of(direction, None)
    turn = np.radians(angle)
    turned = 3.0 * (np.cos(turn) * up - np.sin(turn) * right) + 0.5 * forward
    light = Light(position=(1, 2, 3), direction=direction, up=tuple(turned.tolist()))
    (led,) = placements(with_lights(flat, light))
    assert led.rotation == pytest.approx(angle, abs=1e-6)


def test_a_camera_in_front_sees_right_to_the_right() -> None:
    """The viewer looks against the light: right = looking direction x up."""
    for direction in DIRECTIONS:
        right, up, forward = frame_of(direction, None)
        np.testing.assert_allclose(np.cross(-forward, up), right, atol=1e-12)


def test_the_table_reads_back(flat: SensorDesign) -> None:
    rows = list(csv.DictReader(io.StringIO(placement_csv(placements(flat)))))
    lights = [(name, light) for name, g in flat.lights.items() for light in g.lights]
    assert [row["designator"] for row in rows] == [f"D{n}" for n in range(1, len(lights) + 1)]
    for row, (name, light) in zip(rows, lights, strict=True):
        group = flat.lights[name]
        place = [float(row[f"{axis}_mm"]) for axis in "xyz"]
        np.testing.assert_allclose(place, light.position, atol=1e-4)
        direction = [float(row[f"direction_{axis}"]) for axis in "xyz"]
        np.testing.assert_allclose(np.cross(direction, light.direction), 0.0, atol=1e-6)
        assert np.dot(direction, light.direction) > 0.0
        assert (row["group"], row["model"]) == (name, group.model)
        assert [float(row[f"colour_{c}"]) for c in "rgb"] == list(group.colour)
        assert float(row["flux_mW"]) == group.flux
    assert "-0.0000" not in placement_csv(placements(flat))


def test_the_part_is_that_of_the_colour(flat: SensorDesign) -> None:
    parts = {led.group: led.part for led in placements(flat)}
    assert parts["red"].startswith("DL-TOP3528SR")
    assert parts["blue"].startswith("DL-TOP3528B")
    here = Light(position=(0, 0, 5), direction=(0, 0, 1))
    dim_red = with_lights(flat, here, colour=(0.2, 0, 0))
    assert placements(dim_red)[0].part == parts["red"]
    purple = with_lights(flat, here, colour=(0.5, 0, 0.5))
    assert placements(purple)[0].part == ""
    unknown = with_lights(
        flat, here, model="ours", emitter={"kind": "spot", "cutoff": 9, "beam": 5}
    )
    assert (placements(unknown)[0].model, placements(unknown)[0].part) == ("ours", "")

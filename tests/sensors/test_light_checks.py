"""Checks of the windows and bodies of lights, and of lights outside of the housing."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from optisense import library, sensors
from optisense.design import Light, Part, Role, SensorDesign
from optisense.geometry import TriangleMesh
from optisense.sensors.light_checks import light_problems


def messages(design: SensorDesign) -> list[str]:
    found = light_problems(design)
    assert all(each.severity == "warning" for each in found)
    return [each.message for each in found]


def with_green(mini: SensorDesign, lights: Sequence[Light]) -> SensorDesign:
    """The green group has these lights instead."""
    group = mini.lights["green"].model_copy(update={"lights": list(lights)})
    return mini.model_copy(update={"lights": {**mini.lights, "green": group}})


def shifted(mini: SensorDesign, z: float) -> SensorDesign:
    def up(light: Light) -> Light:
        x, y, low = light.position
        return light.model_copy(update={"position": (x, y, low + z)})

    return with_green(mini, [up(light) for light in mini.lights["green"].lights])


@pytest.fixture
def mini() -> SensorDesign:
    return sensors.load("gelsight-mini-ideal")


def test_windows_that_are_half_in_a_part(mini: SensorDesign) -> None:
    """The rim of the tray is above the lights, whose windows are 2.4 mm high."""
    below = mini.meshes["tray"].bounds[0, 2] - mini.lights["green"].lights[0].position[2]
    assert messages(shifted(mini, below - 1.25)) == []
    (found,) = messages(shifted(mini, below - 0.7))
    assert found == (
        "the windows of 5 of 5 lights of group 'green' are partly inside part 'tray', up to "
        "0.5 mm deep"
    )


def test_a_window_that_is_wholly_in_a_clear_part_is_cast_into_it(mini: SensorDesign) -> None:
    gel = mini.meshes["gel"].bounds.mean(axis=0)
    cast = mini.lights["green"].lights[0].model_copy(update={"position": tuple(gel)})
    assert messages(with_green(mini, [cast])) == []
    divided = with_green(mini, [cast])
    low, high = divided.meshes["gel"].bounds
    divided.parts["upper"] = divided.parts["gel"]
    for part, ends in (("gel", (low, (*high[:2], gel[2]))), ("upper", ((*low[:2], gel[2]), high))):
        divided.meshes[part] = TriangleMesh.box(*ends)
    assert messages(divided) == []
    glass = divided.parts["upper"].model_copy(update={"material": "acrylic"})
    other = divided.model_copy(update={"parts": {**divided.parts, "upper": glass}})
    assert any("partly inside part 'upper'" in found for found in messages(other))


def test_lights_closer_than_their_bodies(mini: SensorDesign) -> None:
    one = mini.lights["green"].lights[0]
    x, y, z = one.position
    beside = one.model_copy(update={"position": (x + 1.0, y, z)})
    assert (
        "are 1.00 mm apart, but a smd-3528 is 2.8 x 3.5 mm"
        in messages(with_green(mini, [one, beside]))[0]
    )


def test_windows_of_two_groups_that_overlap(mini: SensorDesign) -> None:
    """Lights of two groups at one place are the dies of one LED, which is fine."""
    lights = mini.lights["green"].lights
    x, y, z = lights[0].position
    for shift, up, count in (
        (0.0, lights[0].up, 0),
        (0.0, (0.3, 0.2, 0.9), 0),  # round windows
        (0.5, lights[0].up, 1),
        (4.0, lights[0].up, 0),
    ):
        beside = lights[0].model_copy(update={"position": (x, y + shift, z), "up": up})
        blue = mini.lights["green"].model_copy(update={"lights": [beside]})
        alone = with_green(mini, lights[:1])
        both = alone.model_copy(update={"lights": {"green": alone.lights["green"], "blue": blue}})
        found = messages(both)
        assert len(found) == count and all(
            "'green' overlap those of group 'blue'" in f for f in found
        )


def test_lights_outside_of_the_housing(mini: SensorDesign) -> None:
    """A wall before the green lights keeps their light away, unless it is white."""
    away = [
        light.model_copy(update={"position": (-40.0, *light.position[1:])})
        for light in mini.lights["green"].lights
    ]
    wall = Part(role=Role.BLOCKER, mesh="meshes/wall.obj")
    walled = with_green(mini, away).model_copy(update={"parts": {**mini.parts, "wall": wall}})
    walled.meshes["wall"] = TriangleMesh.box((-31, -200, -200), (-30, 200, 200))
    assert messages(walled)[0].startswith("5 of 5 lights of group 'green' send no straight ray")
    white = library.material("white-plastic")
    painted = wall.model_copy(update={"material": "white"})
    bright = walled.model_copy(
        update={
            "parts": {**mini.parts, "wall": painted},
            "materials": {**mini.materials, "white": white},
        }
    )
    assert messages(bright) == []

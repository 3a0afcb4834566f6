"""Dotted paths reach every number of a design."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from optisense import sensors
from optisense.design import Point, SensorDesign, SpotEmitter, get_value, set_value, set_values
from optisense.errors import DesignError


@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("coating.specularity", 0.25),
        ("coating.reflectance.g", 0.2),
        ("lights.red.flux", 12.5),
        ("lights.own-ies.lights[1].position[2]", -4.0),
        ("lights.red.lights[0].position.z", -4.0),
        ("cages.skin.points[1].z", 0.5),
        ("cages.mirror.blend[3].y", 0.25),
        ("cages.skin.box[1].x", 5.0),
        ("camera.fov", 150.0),
        ("materials.gel.ior", 1.41),
        ("name", 'every field: a "test" # 1'),
    ],
)
def test_reading(design: SensorDesign, path: str, value: object) -> None:
    assert get_value(design, path) == value


def numbers(value: Any, path: str = "") -> Iterator[tuple[str, float]]:
    """Yield the numbers of a design's data with their paths."""
    if isinstance(value, dict):
        for key, item in value.items():
            yield from numbers(item, f"{path}.{key}" if path else key)
    elif isinstance(value, list):
        for index, item in enumerate(value):
            yield from numbers(item, f"{path}[{index}]")
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield path, float(value)


def test_every_number_can_be_read_and_set(design: SensorDesign) -> None:
    count = 0
    for path, value in numbers(design.model_dump(mode="json", exclude={"provenance"})):
        assert get_value(design, path) == value
        assert get_value(set_value(design, path, get_value(design, path)), path) == value
        count += 1
    assert count > 150


def test_setting_leaves_the_given_design_alone_and_shares_meshes(design: SensorDesign) -> None:
    changed = set_value(design, "cages.skin.points[1].z", 2)
    assert (changed.cages["skin"].points[1].z, design.cages["skin"].points[1].z) == (2.0, 0.5)
    assert changed.meshes["gel"] is design.meshes["gel"]
    changed.lights["red"].flux = 1.0
    assert design.lights["red"].flux == 12.5


def test_setting_numpy_values_vectors_and_sections(design: SensorDesign) -> None:
    assert set_value(design, "camera.fov", np.float32(30)).camera.fov == 30.0
    moved = set_value(design, "camera.position", np.array([1.0, 2.0, -3.0]))
    assert moved.camera.position == (1.0, 2.0, -3.0)
    point = Point(x=1.0, y=2.0, z=3.0)
    assert set_value(design, "cages.skin.points[0]", point).cages["skin"].points[0] == point
    assert set_value(design, "cages.mirror.blend", 0.5).cages["mirror"].blend == 0.5


def test_another_model_of_lights_replaces_their_own_emitter(design: SensorDesign) -> None:
    own = set_value(design, "lights.red.emitter", {"kind": "spot", "beam": 10, "cutoff": 20})
    before = own.lights["red"]
    assert set_value(own, "lights.red.model", before.model).lights["red"] == before
    assert set_value(own, "lights.red.model", "ws2812b").lights["red"].emitter is None
    renamed = {"lights.red.emitter.beam": 5, "lights.red.model": "our-spot"}
    assert set_values(own, renamed).lights["red"].emitter == SpotEmitter(beam=5, cutoff=20)


@pytest.mark.parametrize(
    ("path", "hint"),
    [
        ("coating.specularty", "'specularity'"),
        ("lights.rd.flux", "'red'"),
        ("cages.skin.point[3].z", "'points'"),
        ("cages.skin.points[99].z", "from 0 to 7"),
        ("camera.position.w", "x, y, z"),
        ("camera.fov.x", "is a single value"),
        ("coatings", "'coating'"),
    ],
)
def test_unknown_paths_name_the_near_match(design: SensorDesign, path: str, hint: str) -> None:
    for attempt in (lambda: get_value(design, path), lambda: set_value(design, path, 1.0)):
        with pytest.raises(DesignError) as caught:
            attempt()
        assert hint in str(caught.value)


@pytest.mark.parametrize("path", ["", ".", "camera.", "camera..fov", "[0]", "a b", "x[-1]", "x[1"])
def test_malformed_paths(design: SensorDesign, path: str) -> None:
    with pytest.raises(DesignError, match="not a path"):
        get_value(design, path)


@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("coating.specularity", 1.5),
        ("camera.fov", float("nan")),
        ("camera.position", [1.0, 2.0]),
        ("lights.red.flux", "bright"),
        ("parts.gel.material", "jelly"),
    ],
)
def test_values_that_do_not_fit(design: SensorDesign, path: str, value: object) -> None:
    with pytest.raises(DesignError) as caught:
        set_value(design, path, value)
    assert path in str(caught.value)


def test_private_attributes_are_out_of_reach(design: SensorDesign) -> None:
    for path in ("_meshes", "model_fields", "__class__", "camera.__dict__", "lights.keys"):
        with pytest.raises(DesignError):
            get_value(design, path)


def test_points_of_a_cage_with_a_blend_are_refused_in_words() -> None:
    with pytest.raises(DesignError, match="has 0 entries") as refused:
        get_value(sensors.load("gelsight-svelte"), "cages.M1.points[3].y")
    assert "blend" in str(refused.value.hint)

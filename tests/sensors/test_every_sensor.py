"""What holds for every built-in sensor."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from optisense import sensors
from optisense.design import SensorDesign, load_design, save_design
from optisense.design.parts import TRANSPARENT_SOLIDS


@pytest.fixture(scope="module", params=list(sensors.BUILDERS))
def sensor(request: pytest.FixtureRequest) -> SensorDesign:
    return sensors.build(request.param)


def test_the_design_is_in_order(sensor: SensorDesign) -> None:
    assert sensors.check(sensor) == []


def test_it_survives_a_trip_through_a_folder(sensor: SensorDesign, tmp_path: Path) -> None:
    save_design(sensor, tmp_path / "sensor")
    again = load_design(tmp_path / "sensor")
    assert again.model_dump() == sensor.model_dump()
    for name, mesh in sensor.meshes.items():
        np.testing.assert_array_equal(again.meshes[name].vertices, mesh.vertices)


def test_solids_are_closed_and_look_outward(sensor: SensorDesign) -> None:
    meshes = sensor.deformed_meshes()
    for name in sensor.parts_of(*TRANSPARENT_SOLIDS):
        assert meshes[name].is_closed, name
        assert meshes[name].volume > 0.0, name


def test_the_skin_stays_on_the_gel(sensor: SensorDesign) -> None:
    """Each vertex of the skin is, bit for bit, one of the gel, also when bent."""
    meshes = sensor.deformed_meshes()
    gel = {tuple(vertex) for vertex in meshes["gel"].vertices.tolist()}
    assert all(tuple(vertex) in gel for vertex in meshes["skin"].vertices.tolist())
    assert meshes["skin"].area <= meshes["gel"].area


def test_what_is_assumed_is_marked(sensor: SensorDesign) -> None:
    """Each light group, the camera's place and the parts say where their numbers come from."""
    for name in sensor.lights:
        assert f"lights.{name}" in sensor.provenance
    assert "camera.position" in sensor.provenance
    assert any(entry.status == "assumed" for entry in sensor.provenance.values())

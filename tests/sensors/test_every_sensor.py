"""What holds for every built-in sensor."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from optisense import sensors
from optisense.design import Role, SensorDesign, load_design, save_design
from optisense.design.parts import TRANSPARENT_SOLIDS
from optisense.geometry import (
    Contact,
    Cylinder,
    Indenter,
    MeshIndenter,
    Plane,
    Sphere,
    TriangleMesh,
)
from optisense.geometry.containment import inside
from optisense.optics import OpticalModel, TactileImage
from optisense.optics.transport.chief_rays import RayOutcome

from .conftest import ModelOf

SMALL: dict[str, Any] = {"resolution": (80, 60), "photons": 50_000}
FINE: dict[str, Any] = {**SMALL, "resolution": (160, 120)}
"""For sensors whose camera sees so much that contacts are small in the picture."""
WIDE = ("gelsight360", "gelsight-svelte")
LAST = "gelsight360"
"""The last to be tested, as another file uses its model again."""
FLAT_AND_BENT = ("gelsight-mini-ideal", "gelsight-mini-ideal-spherical")
"""Sensors into which every indenter is pressed."""


@pytest.fixture(scope="module", params=sorted(sensors.SENSORS.names(), key=LAST.__eq__))
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


def test_the_skin_looks_into_the_gel(sensor: SensorDesign) -> None:
    meshes = sensor.deformed_meshes()
    skin, gel = meshes["skin"], meshes["gel"]
    middles, into = skin.triangles.mean(axis=1)[::37], 0.05 * skin.face_normals[::37]
    assert inside(middles + into, gel).all()
    assert not inside(middles - into, gel).any()


def test_what_is_assumed_is_marked(sensor: SensorDesign) -> None:
    """Each light group, the camera's place and the parts say where their numbers come from."""
    for name in sensor.lights:
        assert f"lights.{name}" in sensor.provenance
    assert "camera.position" in sensor.provenance
    assert any(entry.status == "assumed" for entry in sensor.provenance.values())


@pytest.fixture(scope="module")
def model(sensor: SensorDesign, model_of: ModelOf) -> OpticalModel:
    return model_of(sensor.name)


def test_no_ray_of_the_picture_is_lost(model: OpticalModel) -> None:
    """Each ray meets the sensing surface, or ends on a part that absorbs it."""
    rays = model.chief_rays((160, 120))
    assert set(np.unique(rays.outcome)) <= {RayOutcome.HIT, RayOutcome.ABSORBED}
    if not model.design.parts_of(Role.BLOCKER):
        assert rays.hit.all()


def shows(
    model: OpticalModel, indenter: Indenter, untouched: TactileImage, size: dict[str, Any]
) -> bool:
    """Whether an indenter that is pressed into the middle of the view changes the picture there."""
    middle = model.nine_contacts()[4].point
    image = model.render([Contact(indenter, point=middle, depth=0.6)], **size)
    pressed = image.contact_mask
    change = np.abs(image.radiance - untouched.radiance).max(axis=2)
    # A plate shows by its rim: its flat face looks as the skin did. The ratio is 4.7 for a plate on
    # the tip of GelSight360, where little light comes from the sides, and 19 for a ball there.
    return bool(
        pressed.sum() > 15 and np.quantile(change[pressed], 0.9) > 4.0 * np.median(change[~pressed])
    )


@pytest.mark.slow
def test_indenters_show(model: OpticalModel, tmp_path: Path) -> None:
    """A ball on every sensor, and every indenter on a flat skin and on a bent one."""
    indenters: list[Indenter] = [Sphere(radius=2.5)]
    if model.design.name in FLAT_AND_BENT:
        brick = tmp_path / "brick.obj"
        TriangleMesh.box((-2, -1.5, 0), (2, 1.5, 4)).save_obj(brick)
        indenters += [Cylinder(radius=2.0, length=4.0), Plane(size=4.0), MeshIndenter(brick)]
    size = FINE if model.design.name in WIDE else SMALL
    untouched = model.render([], **size)
    for each in indenters:
        assert shows(model, each, untouched, size), each

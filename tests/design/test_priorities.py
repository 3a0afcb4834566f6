"""What solids of higher priority leave of a gel, for its mechanics and its manufacture."""

from __future__ import annotations

import pytest

from optisense import sensors
from optisense.design import SensorDesign, set_value
from optisense.design.arrangement import carved
from optisense.geometry import TriangleMesh
from optisense.optics.scene.assembly import assemble
from optisense.workshop.shapes import shapes


@pytest.fixture(scope="module")
def ridged() -> SensorDesign:
    """A gel of 20 x 16 x 4.25 mm into which a bar of 8 x 2.25 mm reaches along its length."""
    design = sensors.gelsight_mini_ideal()
    design.cages = {}
    design.meshes["gel"] = TriangleMesh.box((-10.0, -8.0, -4.25), (10.0, 8.0, 0.0))
    design.meshes["tray"] = TriangleMesh.box((-10.0, -4.0, -4.25), (10.0, 4.0, -2.0))
    return design


@pytest.mark.parametrize(("priority", "volume"), [(2, 1000.0), (0, 1360.0)])
def test_the_solid_of_higher_priority_is_cut_out(
    ridged: SensorDesign, priority: int, volume: float
) -> None:
    design = set_value(ridged, "parts.tray.priority", priority)
    (made,) = [shape for shape in shapes(design) if shape.name == "gel"]
    assert made.volume == pytest.approx(volume, rel=1e-9)
    (pressed,) = assemble(design).gels
    assert pressed.volume == pytest.approx(volume, rel=1e-9)


@pytest.mark.parametrize("gel_is_first", [True, False])
def test_the_common_space_of_two_bodies_is_cut_out_once(
    ridged: SensorDesign, gel_is_first: bool
) -> None:
    """The bar is two overlapping bodies, and the order of the parts does not matter."""
    design = set_value(ridged, "parts.tray.priority", 2)
    design.parts = dict(sorted(design.parts.items(), reverse=not gel_is_first))
    bar = design.meshes["tray"]
    bars = [(-10.0, -4.0, -4.25), (2.0, 4.0, -2.0)], [(-2.0, -4.0, -4.25), (10.0, 4.0, -2.0)]
    design.meshes["tray"] = TriangleMesh.joined([TriangleMesh.box(*ends) for ends in bars])
    (made,) = [shape for shape in shapes(design) if shape.name == "gel"]
    assert made.volume == pytest.approx(1360.0 - bar.volume, rel=1e-9)
    (pressed,) = assemble(design).gels
    assert pressed.volume == pytest.approx(1360.0 - bar.volume, rel=1e-9)


def test_parts_that_touch_are_whole(ridged: SensorDesign) -> None:
    design = set_value(ridged, "parts.tray.priority", 2)
    design.meshes["tray"] = TriangleMesh.box((-10.0, -4.0, -6.0), (10.0, 4.0, -4.25))
    meshes = design.deformed_meshes()
    assert carved(design, meshes, "gel") is meshes["gel"]

"""What a design computes from its fields."""

from __future__ import annotations

import copy
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import Field, ValidationError

import optisense as ots
from optisense.design import (
    Cage,
    Camera,
    LightGroup,
    Point,
    Provenance,
    SensorDesign,
    Status,
    load_design,
    save_design,
)
from optisense.design.fields import Model, Number
from optisense.errors import DesignError


def test_channel_flux_adds_up_to_the_flux(design: SensorDesign) -> None:
    np.testing.assert_allclose(
        design.lights["red"].channel_flux(), [12.5 / 1.5, 0.0, 12.5 * 0.5 / 1.5]
    )


def test_a_light_without_colour_is_refused(design: SensorDesign) -> None:
    group = design.lights["red"].model_dump()
    with pytest.raises(ValidationError, match="colour"):
        LightGroup.model_validate(group | {"colour": (0, 0, 0)})


@pytest.mark.parametrize("value", [500.0, 0.5, 1e13, -1e13])
def test_bounds_of_a_field_of_a_bounded_type_count(value: float) -> None:
    """Also where they are given with the default, as other packages write their kinds."""

    class Lamp(Model):
        power: Number = Field(default=4.0, ge=1.0, le=200.0)
        shift: Number = 0.0

    with pytest.raises(ValidationError, match="power"):
        Lamp(power=value)
    assert Lamp(shift=0.5).shift == 0.5
    if abs(value) > 1e12:
        with pytest.raises(ValidationError, match="shift"):
            Lamp(shift=value)


def test_camera_axes_are_a_picture_that_is_not_mirrored() -> None:
    camera = Camera(
        model="x", fov=50, resolution=(4, 3), position=(0, 0, 0), direction=(0, 0, 2), up=(0, 3, 1)
    )
    right, up, forward = camera.axes()
    np.testing.assert_allclose(forward, [0, 0, 1])
    np.testing.assert_allclose(up, [0, 1, 0], atol=1e-15)
    np.testing.assert_allclose(right, np.cross(forward, up))
    np.testing.assert_allclose(right, [-1, 0, 0])


def test_blend_mixes_the_two_ends(design: SensorDesign) -> None:
    cage = design.cages["mirror"]
    low = np.array([(p.x, p.y, p.z) for p in cage.c_min or []])
    high = np.array([(p.x, p.y, p.z) for p in cage.c_max or []])
    share = np.array([0.5, 0.25, 0.75])
    np.testing.assert_allclose(cage.current_points(), (1 - share) * low + share * high)
    cage.blend = 1.0
    np.testing.assert_allclose(cage.current_points(), high)


def test_cage_index_is_x_slowest_z_fastest() -> None:
    cage = Cage.around(["gel"], [[0, 0, 0], [2, 3, 4]], (3, 4, 5))
    for i, j, k in [(0, 0, 1), (2, 3, 4), (1, 2, 3)]:
        expected = Point(x=float(i), y=float(j), z=float(k))
        assert cage.points[cage.index(i, j, k)] == expected


def test_a_cage_moves_all_its_parts_alike(design: SensorDesign) -> None:
    meshes = design.deformed_meshes()
    assert meshes["gel"].bounds[1, 2] == pytest.approx(0.5)
    assert meshes["skin"].bounds[1, 2] == pytest.approx(0.5)
    np.testing.assert_array_equal(meshes["wall"].vertices, design.meshes["wall"].vertices)


def test_bounds_enclose_all_parts(design: SensorDesign) -> None:
    np.testing.assert_allclose(design.bounds(), [[-20, -20, -30], [8.5, 20, 0]])


def test_copies_of_all_kinds_are_equal_and_independent(
    design: SensorDesign, tmp_path: Path
) -> None:
    save_design(design, tmp_path)
    loaded = load_design(tmp_path)
    copies = [
        design.copy(), design.model_copy(), copy.copy(design), copy.deepcopy(design),
        pickle.loads(pickle.dumps(design)),
    ]  # fmt: skip
    assert pickle.loads(pickle.dumps(loaded)) == loaded == copy.deepcopy(loaded)
    for other in copies:
        assert other == design
        other.lights["red"].flux = 1.0
        assert other != design
        other.lights["red"].flux = design.lights["red"].flux
        gel = other.meshes["gel"]
        other.meshes["gel"] = gel.with_vertices(gel.vertices + 0.1)
        assert other != design
    other = design.model_copy(update={"name": "other"})
    other.meshes.clear()
    assert other.name == "other" and design.meshes


def test_changes_in_place_are_checked(design: SensorDesign) -> None:
    with pytest.raises(DesignError, match="fov"):
        design.camera.fov = float("inf")
    with pytest.raises(DesignError, match="specularity"):
        design.coating.specularity = 2.0
    without_skin = {name: part for name, part in design.parts.items() if name != "skin"}
    with pytest.raises(DesignError, match="no part is a sensing_surface"):
        design.parts = without_skin
    assert "skin" in design.parts  # as before


def test_a_changed_number_loses_its_source(design: SensorDesign) -> None:
    known = Provenance(status=Status.DERIVED, source="a data sheet")
    design.provenance["lights.red.flux"] = known
    kept = ots.set_value(design, "lights.red.flux", design.lights["red"].flux)
    assert kept.provenance["lights.red.flux"] == known
    changed = ots.set_value(design, "lights.red.flux", 9.0)
    assert "lights.red.flux" not in changed.provenance
    assert design.provenance["lights.red.flux"] == known
    position = ots.get_value(design, "camera.position")
    for path, value, told, kept_at in (
        ("lights.red", {**design.lights["red"].model_dump(), "flux": 9.0},
         "lights.red.flux", "lights.red.colour"),
        ("camera.position.z", position[2] + 1.0, "camera.position", "camera.position.x"),
    ):  # fmt: skip
        design.provenance |= {told: known, kept_at: known}
        changed = ots.set_value(design, path, value)
        assert told not in changed.provenance
        assert changed.provenance[kept_at] == known


def test_designs_with_wrong_meshes_can_be_compared(design: SensorDesign) -> None:
    other = design.copy()
    assert other == design
    for wrong in (None, "a file"):
        other.meshes["gel"] = wrong
        assert other != design and design != other


def test_a_name_that_no_folder_can_have() -> None:
    with pytest.raises(DesignError, match="no built-in sensor and no folder"):
        ots.load("a" * 5000)
    with pytest.raises(DesignError, match=r"no folder 'gelsight-mini'\. Give the name .* as text"):
        ots.load(Path("gelsight-mini"))


@pytest.mark.parametrize("given", ["gelsight-mini-ideal", Path("my-sensor"), None])
def test_a_name_in_place_of_a_design_says_how_to_load_it(given: Any) -> None:
    for use in (
        ots.OpticalModel,
        ots.check,
        lambda each: ots.save_design(each, "sensor"),
        lambda each: ots.get_value(each, "camera.fov"),
        lambda each: ots.set_value(each, "camera.fov", 30.0),
        lambda each: ots.search.search(each, {"camera.fov": (40, 60)}, "aoap"),
        *([lambda each: ots.evaluate(each, "aoap")] if given is not None else []),
    ):
        with pytest.raises(DesignError, match=r"a design is needed.*optisense\.load"):
            use(given)

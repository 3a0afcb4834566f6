"""Refractive indices that no transparent material has, and media that absorb all light."""

from __future__ import annotations

import re

import pytest

import optisense as ots
from optisense import library, sensors
from optisense.design import SensorDesign, check_design, set_value
from optisense.design.limits import index_problems
from optisense.design.materials import Dielectric
from optisense.errors import DesignError


@pytest.mark.parametrize("name", sensors.SENSORS.names())
def test_materials_of_the_built_in_sensors_are_fine(name: str) -> None:
    assert index_problems(sensors.load(name)) == []


@pytest.mark.parametrize("name", library.names("material"))
def test_materials_of_the_library_are_fine(mini: SensorDesign, name: str) -> None:
    """Every transparent one serves as a plate."""
    material = library.material(name)
    if isinstance(material, Dielectric):
        assert index_problems(set_value(mini, "materials.acrylic.ior", material.ior)) == []


@pytest.mark.parametrize(
    ("material", "ior", "said"),
    [
        ("silicone-xp565", 4.0, "no clear elastomer has a refractive index of 4"),
        ("silicone-xp565", 1.7, "no clear elastomer has a refractive index of 1.7"),
        ("silicone-xp565", 1.62, None),
        ("silicone-xp565", 1.2, "no clear elastomer has a refractive index of 1.2"),
        ("silicone-xp565", 1.0, None),  # a membrane filled with air
        ("acrylic", 4.0, "no transparent solid has a refractive index of 4"),
        ("acrylic", 2.0, None),
        ("acrylic", 1.1, "no transparent solid has a refractive index of 1.1"),
        ("acrylic", 1.0, None),  # a film of air
    ],
)
def test_indices(mini: SensorDesign, material: str, ior: float, said: str | None) -> None:
    design = set_value(mini, f"materials.{material}.ior", ior)
    errors = [problem for problem in check_design(design) if problem.severity == "error"]
    if said is None:
        assert errors == []
    else:
        (problem,) = errors
        assert said in problem.message and problem.where == f"materials.{material}.ior"


def test_a_sensor_of_an_impossible_material_has_no_score(mini: SensorDesign) -> None:
    design = set_value(mini, "materials.silicone-xp565.ior", 4.0)
    score = ots.evaluate(ots.OpticalModel(design), "aoap", ray_resolution=(40, 30))
    assert "refractive index of 4" in str(score.failure)


@pytest.mark.parametrize(
    ("absorption", "words", "told"),
    [
        ((0.2, 0.2, 0.2), "absorbs practically all light: .*4.25 mm", False),
        ((50.0, 1.0, 50.0), "absorbs practically all light: .*4.25 mm", False),
        ((2.0, 2.0, 2.0), "absorbs practically all light: .*4.25 mm, material 'silicone", True),
        ((0.05, 0.2, 0.1), "too bright", False),
        ((0.05, 0.3, 0.1), "too bright", True),
    ],
)
def test_a_gel_that_absorbs_much_is_a_warning(
    mini: SensorDesign, absorption: tuple[float, float, float], words: str, told: bool
) -> None:
    """Over 4.25 mm, 1/mm leaves a seventieth of one channel, and 2/mm a five-thousandth."""
    dark = set_value(mini, "materials.silicone-xp565.absorption", absorption)
    said = [one for one in check_design(dark) if re.search(words, one.message)]
    assert [one.severity for one in said] == ["warning"] * told


def test_one_number_for_three_is_refused_in_words() -> None:
    with pytest.raises(DesignError, match="should be a list of values"):
        set_value(sensors.gelsight_mini_ideal(), "materials.acrylic.absorption", -1)

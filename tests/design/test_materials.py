"""Kinds of materials and coatings define what is displayed and simulated."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
import pytest

from optisense import sensors
from optisense.design import (
    SensorDesign,
    check_design,
    get_value,
    load_design,
    save_design,
    set_value,
)
from optisense.design.difference import fingerprint
from optisense.design.fields import Colour, Fraction, RelativePath
from optisense.design.materials import (
    Absorber,
    Coating,
    CoatingModel,
    Conductor,
    Dielectric,
    Diffuse,
    Material,
    Reflection,
    flake_lobe,
    kinds_for,
)
from optisense.design.parts import Role
from optisense.design.reflectance import fresnel_metal, ggx_density, smith_shadowing
from optisense.errors import DesignError

SILVER: dict[str, Any] = {"eta": (0.15, 0.13, 0.14), "k": (3.9, 3.1, 2.4)}


class Plastic(Material):
    """A matt plastic with some gloss."""

    roles: ClassVar[tuple[Role, ...]] = (Role.BLOCKER,)

    kind: Literal["test-plastic"] = "test-plastic"
    colour: Colour
    gloss: Fraction = 0.1

    def reflection(self) -> Reflection:
        return Reflection(self.colour, self.gloss, 0.3, (1.5, 1.5, 1.5), (0.0, 0.0, 0.0))


class Chalk(CoatingModel):
    """A coating without flake."""

    kind: Literal["test-chalk"] = "test-chalk"
    white: Fraction

    def reflection(self) -> Reflection:
        return Reflection(reflectance=(self.white, self.white, self.white))


class Measured(Material):
    """A surface whose reflectance is in a file beside the design."""

    roles: ClassVar[tuple[Role, ...]] = (Role.BLOCKER,)

    kind: Literal["test-measured"] = "test-measured"
    table: RelativePath

    def reflection(self) -> Reflection:
        red, green, blue = np.loadtxt(self.path("table")).tolist()
        return Reflection(reflectance=(red, green, blue))

    def check(self) -> None:
        self.contents()


def test_the_file_of_a_material_goes_where_its_design_goes(tmp_path: Path) -> None:
    (tmp_path / "white.txt").write_text("0.9 0.8 0.7")
    design = sensors.load("builtin:gelsight-mini-ideal")
    design.materials["white"] = Measured(table="white.txt").located(tmp_path)
    before = fingerprint(design)
    save_design(design, tmp_path / "saved")
    again = load_design(tmp_path / "saved")
    copied = again.copy().materials["white"]
    assert copied.reflection().reflectance == (0.9, 0.8, 0.7)
    assert fingerprint(again) == before
    (tmp_path / "saved" / "white.txt").write_text("0.1 0.1 0.1")
    assert fingerprint(again) != before
    (tmp_path / "saved" / "white.txt").unlink()
    problems = [each for each in check_design(again) if "can't read" in each.message]
    assert [each.severity for each in problems] == ["error"]
    file = tmp_path / "saved" / "design.yaml"
    file.write_text(file.read_text().replace("white.txt", "../white.txt"))
    with pytest.raises(DesignError, match="inside the design folder"):
        load_design(tmp_path / "saved")


def test_each_role_takes_the_kinds_that_say_so() -> None:
    assert kinds_for(Role.ELASTOMER) == ("dielectric",)
    assert set(kinds_for(Role.MIRROR)) == {"conductor", "diffuse"}
    assert "test-plastic" in kinds_for(Role.BLOCKER)
    assert kinds_for(Role.SENSING_SURFACE) == ()


def test_a_part_of_a_kind_that_does_not_suit_it_is_refused() -> None:
    data = sensors.load("builtin:gelsight-mini-ideal").model_dump(mode="json")
    gel = next(name for name, part in data["parts"].items() if part["role"] == "elastomer")
    data["materials"]["grey"] = {"kind": "test-plastic", "colour": [0.5, 0.5, 0.5]}
    data["parts"][gel]["material"] = "grey"
    with pytest.raises(ValueError, match=f"part '{gel}' .* can't be made of 'grey'"):
        SensorDesign.model_validate(data)


def test_head_on_reflection_is_the_blend_of_both_lobes() -> None:
    metal = Conductor(**SILVER).reflection().normal_reflectance()
    paint = Diffuse(reflectance=(0.2, 0.4, 0.6)).reflection().normal_reflectance()
    both = (
        Coating(reflectance=(0.2, 0.4, 0.6), specularity=0.25, **SILVER)
        .reflection()
        .normal_reflectance()
    )
    np.testing.assert_allclose(both, 0.75 * paint + 0.25 * metal)
    assert (
        Absorber().reflection().is_black and not Absorber().reflection().normal_reflectance().any()
    )
    n = 1.5  # Fresnel: the index alone tells what a clear face reflects
    glass = Reflection(specularity=1.0, eta=(n, n, n)).normal_reflectance()
    np.testing.assert_allclose(glass, ((n - 1) / (n + 1)) ** 2)


READINGS = {  # share of the metal's lobe and its GGX alpha at a specularity of 0, 0.3 and 1
    "blend": ((0.0, 1.0), (0.3, 0.7), (1.0, 0.05)),
    "blend-fixed-roughness": ((0.0, 0.1), (0.3, 0.1), (1.0, 0.1)),
    "conductor": ((1.0, 1.0), (1.0, 0.7), (1.0, 0.05)),
}


@pytest.mark.parametrize("scattering", READINGS)
def test_each_reading_of_specularity_is_its_formula(scattering: Any) -> None:
    white = (1.0, 1.0, 1.0)
    for specularity, (share, alpha) in zip((0.0, 0.3, 1.0), READINGS[scattering], strict=True):
        coating = Coating(
            reflectance=white, specularity=specularity, scattering=scattering, **SILVER
        )
        surface = coating.reflection()
        assert (surface.specularity, surface.roughness) == pytest.approx((share, alpha))
        assert (
            f"{100 * share:.0f} % metal flake of roughness {alpha:g}" in coating.consequences()[0]
        )
        assert SINGLE_BOUNCE < energy(surface) <= 1.0 + QUADRATURE
        metal = fresnel_metal(1.0, SILVER["eta"], SILVER["k"])
        np.testing.assert_allclose(surface.normal_reflectance(), 1.0 - share + share * metal)


SINGLE_BOUNCE = 0.3
"""A GGX surface of roughness 1 reflects at least so much of light from 45 degrees: Mitsuba's has
0.36 without absorption, as it leaves out what meets a second facet."""

QUADRATURE = 1e-3
"""Error of the sum over the hemisphere, of a narrow lobe too."""


def energy(surface: Reflection) -> float:
    """Most of R, G, B light from 45 degrees that is scattered, by a sum over the hemisphere."""
    tilt, turn = np.meshgrid(
        (np.arange(400) + 0.5) * np.pi / 800, (np.arange(400) + 0.5) * np.pi / 200, indexing="ij"
    )
    incoming = np.array([np.sqrt(0.5), 0.0, np.sqrt(0.5)])
    towards = np.stack([np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), np.cos(tilt)], -1)
    half = towards + incoming
    half /= np.linalg.norm(half, axis=-1, keepdims=True)
    alpha, share = surface.roughness, surface.specularity
    metal = ggx_density(half[..., 2], alpha) / (4.0 * incoming[2])
    metal *= smith_shadowing(incoming[2], alpha) * smith_shadowing(towards[..., 2], alpha)
    fresnel = fresnel_metal((half @ incoming).ravel(), surface.eta, surface.k)
    solid_angle = np.sin(tilt) * (np.pi / 800) * (np.pi / 200)
    shiny = (fresnel * (metal * solid_angle).reshape(-1, 1)).sum(axis=0)
    return float((share * shiny + (1.0 - share) * np.array(surface.reflectance)).max())


def test_the_usual_reading_is_in_no_file_and_changes_no_design(tmp_path: Path) -> None:
    design = sensors.load("builtin:gelsight-mini-ideal")
    usual = fingerprint(design)
    assert "scattering" not in design.model_dump(mode="json")["coating"]
    assert get_value(design, "coating.scattering") == "blend"
    other = set_value(design, "coating.scattering", "conductor")
    assert fingerprint(other) != usual
    assert other.coating.in_words() == "specularity 0 (conductor)"
    assert fingerprint(set_value(other, "coating.scattering", "blend")) == usual
    save_design(other, tmp_path)
    assert load_design(tmp_path).coating == other.coating
    file = tmp_path / "design.yaml"
    file.write_text(file.read_text().replace("scattering: conductor", "scattering: conductro"))
    with pytest.raises(DesignError, match=r"'coating\.scattering' = 'conductro'") as raised:
        load_design(tmp_path)
    assert raised.value.hint == "Did you mean 'conductor'?"
    with pytest.raises(ValueError, match="it must be one of blend"):
        flake_lobe(0.5, "mirror")  # type: ignore[arg-type]


def test_an_index_in_a_medium_is_relative_to_it() -> None:
    seen = Conductor(**SILVER).reflection().in_medium(2.0)
    np.testing.assert_allclose(seen.eta, np.array(SILVER["eta"]) / 2.0)
    assert Dielectric(ior=1.4).medium().ior == 1.4


def test_a_coating_of_another_kind_is_in_files_and_the_usual_one_need_not_be_named(
    tmp_path: Path,
) -> None:
    design = sensors.load("builtin:gelsight-mini-ideal")
    save_design(design, tmp_path / "usual")
    assert "kind: flake" not in (tmp_path / "usual" / "design.yaml").read_text()
    assert isinstance(load_design(tmp_path / "usual").coating, Coating)
    design.coating = Chalk(white=0.75)
    save_design(design, tmp_path / "chalk")
    again = load_design(tmp_path / "chalk").coating
    assert isinstance(again, Chalk) and again.white == 0.75
    file = tmp_path / "chalk" / "design.yaml"
    file.write_text(file.read_text().replace("test-chalk", "tset-chalk"))
    with pytest.raises(DesignError, match=r"unknown kind 'tset-chalk' at 'coating\.kind'"):
        load_design(tmp_path / "chalk")

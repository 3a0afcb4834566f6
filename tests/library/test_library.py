"""The library: every entry reads, has sources, and numbers agree with their own formulas."""

from __future__ import annotations

import math

import numpy as np
import pytest

from optisense import library
from optisense.design import Coating, IesEmitter, LightGroup
from optisense.errors import LibraryError

KINDS = ("material", "coating", "light", "camera")


@pytest.mark.parametrize("kind", KINDS)
def test_every_entry_reads_and_names_its_sources(kind: str) -> None:
    names = library.names(kind)
    assert names == library.names(kind + "s")
    assert len(names) >= (4 if kind == "material" else 2)
    for name in names:
        entry = library.entry(kind, name)
        assert getattr(library, kind)(name) is not None
        fields = set(entry.value.model_dump(exclude_none=True)) - {"kind", "shape", "library"}
        if kind != "light":
            assert fields <= set(entry.sources) | {"kind"}, name
        for source in entry.sources.values():
            assert source.source and source.date


def test_names_are_unique_within_the_whole_library() -> None:
    names = [name for kind in KINDS for name in library.names(kind)]
    assert len(names) == len(set(names))


def test_all_kinds_of_light_are_there() -> None:
    kinds = {library.light(name).kind for name in library.names("light")}
    assert kinds == {"area", "ies", "spot"}


IES_LIGHTS = [n for n in library.names("light") if isinstance(library.light(n), IesEmitter)]


@pytest.mark.parametrize("name", IES_LIGHTS)
def test_flux_of_an_ies_light_equals_its_lumens(name: str) -> None:
    light = library.light(name)
    assert isinstance(light, IesEmitter)
    profile = light.intensity_table()
    assert profile.lumens == pytest.approx(profile.rated_lumens, rel=1e-5)


def test_the_derived_lens_led_halves_at_15_degrees() -> None:
    light = library.light("osram-topled-black-30")
    assert isinstance(light, IesEmitter)
    table = light.intensity_table()
    at_15 = np.interp(15, table.vertical_angles, table.candela[0])
    assert at_15 == pytest.approx(0.5 * table.candela[0, 0], rel=1e-5)
    power = math.log(0.5) / math.log(math.cos(math.radians(15)))
    closed_form = 2 * math.pi * table.candela[0, 0] / (power + 1)
    assert table.lumens == pytest.approx(closed_form, rel=1e-3)


@pytest.mark.parametrize(
    ("kind", "name", "near"),
    [
        ("material", "acrilic", "acrylic"),
        ("light", "smd3528", "smd-3528"),
        ("coating", "diffuse-gray", "diffuse-grey"),
        ("camera", "pi_v2", "pi-v2"),
    ],
)
def test_unknown_names_give_the_near_match(kind: str, name: str, near: str) -> None:
    with pytest.raises(LibraryError, match=f"Did you mean '{near}'"):
        getattr(library, kind)(name)


def test_an_unknown_kind() -> None:
    with pytest.raises(LibraryError, match="Did you mean 'material'"):
        library.names("matrial")


def test_what_is_handed_out_can_be_changed_without_harm() -> None:
    coating = library.coating("diffuse-grey")
    assert isinstance(coating, Coating) and coating.library == "diffuse-grey"
    coating.specularity = 0.9
    assert library.coating("diffuse-grey").specularity == 0.0


def test_a_group_uses_its_own_emitter_before_the_library() -> None:
    light = {"position": (0, 0, 0), "direction": (0, 0, 1)}
    group = {"model": "smd-3528", "colour": (1, 1, 1), "flux": 1.0, "lights": [light]}
    assert library.emitter(LightGroup.model_validate(group)).kind == "area"
    group["emitter"] = {"kind": "spot", "cutoff": 30, "beam": 10}
    assert library.emitter(LightGroup.model_validate(group)).kind == "spot"


def test_specularity_runs_from_diffuse_to_nearly_a_mirror() -> None:
    assert library.specularity_to_roughness(0.0) == 1.0
    assert library.specularity_to_roughness(0.4) == pytest.approx(0.6)
    assert library.specularity_to_roughness(1.0) == 0.05
    with pytest.raises(ValueError, match="within 0"):
        library.specularity_to_roughness(1.1)

"""The library: every entry reads, has sources, and numbers agree with their own formulas."""

from __future__ import annotations

import math

import numpy as np
import pytest

from optisense import library
from optisense.design import AreaEmitter, Coating, Dielectric, IesEmitter, LightGroup
from optisense.errors import LibraryError
from optisense.library import LightEntry

KINDS = ("material", "coating", "light", "camera")

AT_LEAST = {"material": 7, "coating": 3, "light": 7, "camera": 6}

RED, GREEN, BLUE, YELLOW = 0.630, 0.528, 0.465, 0.5893
"""Micrometres: the three channels, and where `ior` is given."""

INDEX_DIGITS = 0.0006
"""Indices are given to three decimals."""

FLUX_DIGITS = 0.03
"""Fluxes are given to two digits."""

LUMENS_PER_WATT = {"red": 210.0, "green": 535.0, "blue": 84.0}
"""Luminous efficacy of LEDs at 622, 530 and 470 nm (Broadcom ASMT-QTB4 datasheet)."""

MILLICANDELA = {
    "smd-3528": {"red": 140, "blue": 480},
    "ws2812b": {"red": 405, "green": 690, "blue": 190},
    "ws2812b-2020": {"red": 200, "green": 600, "blue": 160},
    "osram-topled-120": {"red": 925},
    "round-5mm-30": {"red": 5100, "green": 10490, "blue": 2100},
    "round-5mm-15": {"green": 38300, "blue": 9900},
    "osram-topled-black-30": {"green": 6795, "blue": 2130},
}
"""Luminous intensities on the axis that the datasheets give."""


@pytest.mark.parametrize("kind", KINDS)
def test_every_entry_reads_and_each_number_has_a_source(kind: str) -> None:
    names = library.names(kind)
    assert names == library.names(kind + "s")
    assert len(names) >= AT_LEAST[kind]
    for name in names:
        entry = library.entry(kind, name)
        assert getattr(library, kind)(name) is not None
        assert entry.numbers() or name == "black-absorber"
        assert entry.unsourced() == [], name
        for source in entry.sources.values():
            assert source.source and source.date


def test_names_are_unique_within_the_whole_library() -> None:
    names = [name for kind in KINDS for name in library.names(kind)]
    assert len(names) == len(set(names))


def test_the_materials_of_the_sensors_are_there() -> None:
    wanted = {"pdms", "silicone-xp565", "acrylic", "epoxy-rough", "clear-resin", "black-absorber"}
    assert wanted <= set(library.names("material"))
    epoxy = library.material("epoxy-rough")
    assert isinstance(epoxy, Dielectric)
    assert (epoxy.ior, epoxy.roughness) == (1.5403, 0.3)


def test_all_kinds_of_light_are_there() -> None:
    kinds = {library.light(name).kind for name in library.names("light")}
    assert kinds == {"area", "ies", "spot"}


def sellmeier(wavelength: float, *terms: tuple[float, float]) -> float:
    square = wavelength**2
    return math.sqrt(1.0 + sum(b * square / (square - c) for b, c in terms))


@pytest.mark.parametrize(
    ("name", "terms"),
    [
        ("pdms", [(1.0093, 0.013185)]),
        ("acrylic", [(1.1819, 0.011313)]),
        ("polycarbonate", [(1.4182, 0.021304)]),
        (
            "glass-bk7",
            [(1.03961212, 0.00600069867), (0.231792344, 0.0200179144), (1.01046945, 103.560653)],
        ),
    ],
)
def test_indices_follow_the_published_formulas(name: str, terms: list[tuple[float, float]]) -> None:
    material = library.material(name)
    assert isinstance(material, Dielectric) and material.dispersion is not None
    assert material.ior == pytest.approx(sellmeier(YELLOW, *terms), abs=INDEX_DIGITS)
    for index, wavelength in zip(material.dispersion, (RED, GREEN, BLUE), strict=True):
        assert index == pytest.approx(sellmeier(wavelength, *terms), abs=INDEX_DIGITS)


def test_clear_materials_bend_blue_most_and_yellow_in_between() -> None:
    materials = [library.material(name) for name in library.names("material")]
    clear = [m for m in materials if isinstance(m, Dielectric) and m.dispersion is not None]
    assert len(clear) >= 5
    for material in clear:
        assert material.dispersion is not None
        red, green, blue = material.dispersion
        assert red < material.ior < green < blue


@pytest.mark.parametrize("name", MILLICANDELA)
def test_fluxes_follow_from_intensity_and_efficacy(name: str) -> None:
    """A cos^m lamp of axial intensity I0 gives 2 pi I0 / (m + 1) lumens."""
    entry = library.entry("light", name)
    assert isinstance(entry, LightEntry)
    power = 1.0
    if isinstance(entry.value, IesEmitter):
        half = 7.5 if name.endswith("-15") else 15.0
        power = math.log(0.5) / math.log(math.cos(math.radians(half)))
    for colour, millicandela in MILLICANDELA[name].items():
        lumens = 2.0 * math.pi * millicandela / 1000.0 / (power + 1.0)
        milliwatts = 1000.0 * lumens / LUMENS_PER_WATT[colour]
        assert entry.typical[colour].flux == pytest.approx(milliwatts, rel=FLUX_DIGITS)


@pytest.mark.parametrize("name", library.names("light"))
def test_every_light_has_colours_with_flux_and_a_window_inside_its_package(name: str) -> None:
    entry = library.entry("light", name)
    assert isinstance(entry, LightEntry)
    assert entry.typical
    assert all(colour.flux is not None and colour.flux > 0 for colour in entry.typical.values())
    if isinstance(entry.value, AreaEmitter):
        assert entry.package is not None
        assert entry.value.size[0] <= entry.package[0] and entry.value.size[1] <= entry.package[1]


IES_LIGHTS = [n for n in library.names("light") if isinstance(library.light(n), IesEmitter)]


@pytest.mark.parametrize("name", IES_LIGHTS)
def test_flux_of_an_ies_light_equals_its_lumens(name: str) -> None:
    light = library.light(name)
    assert isinstance(light, IesEmitter)
    lamps, lumens = light.path("file").read_text().split("TILT=NONE\n")[1].split()[:2]
    assert light.intensity_table().lumens == pytest.approx(int(lamps) * float(lumens), rel=1e-5)


@pytest.mark.parametrize(
    ("name", "half"),
    [("osram-topled-black-30", 15.0), ("round-5mm-30", 15.0), ("round-5mm-15", 7.5)],
)
def test_the_derived_lens_leds_halve_where_their_datasheets_say(name: str, half: float) -> None:
    light = library.light(name)
    assert isinstance(light, IesEmitter)
    table = light.intensity_table()
    at_half = np.interp(half, table.vertical_angles, table.candela[0])
    assert at_half == pytest.approx(0.5 * table.candela[0, 0], rel=1e-5)
    power = math.log(0.5) / math.log(math.cos(math.radians(half)))
    closed_form = 2 * math.pi * table.candela[0, 0] / (power + 1)
    assert table.lumens == pytest.approx(closed_form, rel=1e-3)


@pytest.mark.parametrize("name", [n for n in library.names("camera") if n.startswith("pi-v")])
def test_focal_length_and_pixels_of_a_pi_camera_give_its_angle(name: str) -> None:
    """Within 3 degrees: the documentation rounds, and focusing changes the angle."""
    camera = library.camera(name)
    assert camera.focal_length is not None and camera.pixel_size is not None
    half = camera.resolution[0] * camera.pixel_size / 2000.0
    assert 2 * math.degrees(math.atan(half / camera.focal_length)) == pytest.approx(
        camera.fov, abs=3.0
    )


@pytest.mark.parametrize("diagonal", [120, 160])
def test_fisheyes_see_their_diagonal(diagonal: int) -> None:
    camera = library.camera(f"ov5647-fisheye-{diagonal}")
    assert camera.projection == "equidistant"
    assert camera.angles() == pytest.approx((0.8 * diagonal, 0.6 * diagonal, diagonal))
    assert camera.focal_length is not None and camera.pixel_size is not None
    corner = math.hypot(*camera.resolution) / 2 * camera.pixel_size / 1000.0
    assert math.degrees(2 * corner / camera.focal_length) == pytest.approx(diagonal, rel=0.005)


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


@pytest.mark.parametrize(
    ("colour", "flux", "led"),
    [
        ((2.0, 0.0, 0.0), 1.5, "red"),
        ((1.0, 1.0, 1.0), 4.5, "red"),
        ((1.0, 0.02, 0.0), 1.53, "red"),
        ((0.1, 0.9, 0.0), 2.2 / 0.9, "green"),
    ],
)
def test_the_nominal_flux_of_a_colour_is_that_of_its_weakest_led(
    colour: tuple[float, float, float], flux: float, led: str
) -> None:
    found = library.nominal_flux("smd-0805", colour)
    assert found is not None and found.colour == led
    assert found.flux == pytest.approx(flux, abs=1e-6)
    assert library.nominal_flux("round-5mm-15", (1.0, 1.0, 0.0)) is None  # it has no red LED

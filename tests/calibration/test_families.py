"""What a calibration may change in the bodies of sensors, and how."""

from __future__ import annotations

import numpy as np
import pytest

import optisense as ots
from optisense.calibration._body_changes import with_single_lights
from optisense.calibration._camera_families import notes_on_kinds
from optisense.calibration.families import FAMILIES, LEDS, USUAL, chosen_families
from optisense.calibration.quantities import chain_with, designed, quantities_of
from optisense.design import SensorDesign, get_value, set_value
from optisense.sensors import check, gelsight_mini, gelsight_mini_ideal

BODY = [name for name in FAMILIES if name not in (*USUAL, LEDS)]


def changed(design: SensorDesign, family: str, word: str, value: float) -> SensorDesign:
    """The design with one number of a family, found by a word of its description."""
    each = next(q for q in quantities_of(design, [family]) if word in q.words)
    step = np.log(value / each.start) if each.logarithmic else value - each.start
    return designed(design, [each], np.array([step / each.plausible_range]))


@pytest.mark.parametrize(
    "name", ["gelsight-mini-ideal", "gelbelt", "gelsight360", "gelsight-svelte"]
)
def test_every_family_leaves_a_sensor_that_can_be_simulated(name: str) -> None:
    design = with_single_lights(ots.load(name))
    before = design.model_dump()
    chosen = quantities_of(design, chosen_families([], list(FAMILIES)))
    assert {each.path.split(".")[0] for each in chosen} >= {"lights", "camera", "materials"}
    made = designed(design, chosen, np.full(len(chosen), 0.3))
    assert check(made) == check(design)
    for each in chosen:
        if each.change is None:
            assert get_value(made, each.path) == pytest.approx(each.value(0.3))
    assert design.model_dump() == before
    assert all(each.low <= each.start <= each.high for each in chosen)
    assert all(each.renders for each in quantities_of(design, BODY))


def test_lights_move_along_the_axis_of_the_camera_and_tilt_towards_the_skin() -> None:
    design = gelsight_mini_ideal()
    moved = changed(design, "lights", "place of the red", 0.5).lights["red"].lights
    for one, other in zip(design.lights["red"].lights, moved, strict=True):
        assert np.subtract(other.position, one.position) == pytest.approx([0.0, 0.0, 0.5])
    tilted = changed(design, "lights", "tilt of the green", 20.0).lights["green"].lights
    cosine, sine = np.cos(np.radians(20.0)), np.sin(np.radians(20.0))
    assert tilted[0].direction == pytest.approx((cosine, 0.0, sine))


def test_rows_of_lights_become_longer_about_their_middle() -> None:
    design = gelsight_mini_ideal(leds_per_group=3)
    made = changed(design, "rows", "row of green", 12.0).lights["green"].lights
    assert [light.position[1] for light in made] == pytest.approx([-6.0, 0.0, 6.0])
    for one, other in zip(design.lights["green"].lights, made, strict=True):
        assert one.position[::2] == pytest.approx(other.position[::2])
        assert one.direction == other.direction
    assert quantities_of(gelsight_mini_ideal(leds_per_group=1), ["rows"]) == []
    rings = quantities_of(ots.load("gelsight360"), ["rows"])
    assert "length of the row of base lights" not in [each.words for each in rings]


def test_edges_are_those_towards_the_sides_of_the_picture() -> None:
    made = changed(gelsight_mini_ideal(), "edges", "roughness", 0.4)
    for name in ("guide", "tray"):
        faces = made.parts[name].faces
        assert faces is not None
        assert set(faces) == {"edge-right", "edge-left", "edge-top", "edge-bottom"}
        assert {face.roughness for face in faces.values()} == {0.4}


def test_a_thicker_gel_keeps_its_base() -> None:
    design = gelsight_mini_ideal()
    made = changed(design, "gel", "thickness", 4.5)
    gel = made.deformed_meshes()["gel"].bounds
    assert gel[:, 2] == pytest.approx([-4.25, 0.25])
    assert made.deformed_meshes()["skin"].bounds[:, 2] == pytest.approx([0.25, 0.25])
    bent = quantities_of(ots.load("gelsight-mini-ideal-spherical"), ["gel"])
    assert [each.words for each in bent] == ["Poisson ratio of the gel"]


def test_emission_and_coating_change_by_factors() -> None:
    design = gelsight_mini_ideal()
    wide = changed(design, "emission", "width", 0.5)
    emitter = wide.lights["blue"].emitter
    assert emitter is not None
    assert emitter.size == pytest.approx((1.2, 1.2))  # type: ignore[attr-defined]
    dark = changed(design, "coating", "reflectance", 0.6)
    assert dark.coating.reflectance == pytest.approx((0.3, 0.3, 0.3))  # type: ignore[attr-defined]


def test_channels_without_light_have_no_share_and_no_dimming() -> None:
    svelte = ots.load("gelsight-svelte")  # its lights are red and green
    chosen = {each.path for each in quantities_of(svelte, ["colours", "shading"])}
    assert chosen == {
        "camera.colour_matrix[0][1]",
        "camera.colour_matrix[1][0]",
        "camera.colour_matrix[2][0]",
        "camera.colour_matrix[2][1]",
        "camera.shading.falloff",
        "camera.shading.red_falloff",
        "camera.shading.power",
    }


def test_curves_and_shadings_of_other_kinds_stay_as_they_are() -> None:
    """Those of the library's cameras have no exponent, and no strength."""
    other = set_value(
        gelsight_mini_ideal(),
        "camera.tone_curve",
        {"kind": "points", "points": [[0.0, 0.0], [0.1, 0.3], [1.0, 1.0]]},
    )
    other = set_value(other, "camera.shading", {"kind": "table", "gain": [[1.0, 1.2], [1.3, 1.1]]})
    assert quantities_of(other, ["tone", "shading"]) == []
    notes = notes_on_kinds(other, USUAL)
    assert ["'tone'" in note or "'shading'" in note for note in notes] == [True, True]
    assert "'points'" in notes[0] and "'table'" in notes[1]
    assert notes_on_kinds(other, ["powers"]) == notes_on_kinds(gelsight_mini_ideal(), USUAL) == []


def test_a_fitted_shading_is_corrected_as_before() -> None:
    shading = {"kind": "radial", "falloff": 0.6, "power": 2.0, "corrected": 0.8}
    design = set_value(gelsight_mini_ideal(), "camera.shading", shading)
    chosen = quantities_of(design, ["shading"])
    steps = np.full(len(chosen), 0.3)
    made = designed(design, chosen, steps).camera
    assert made.shading is not None and made.shading.corrected == 0.8
    assert made.shading.falloff == pytest.approx(0.6 + 0.3 * 0.3)  # type: ignore[attr-defined]
    chain = chain_with(design.camera.picture_chain(), chosen, steps)
    assert chain.shading == made.shading


def test_single_lights_together_are_the_group() -> None:
    design = gelsight_mini_ideal()
    single = with_single_lights(design)
    assert list(single.lights)[:2] == ["red-1", "red-2"] and len(single.lights) == 15
    for name, group in design.lights.items():
        own = [single.lights[each] for each in single.lights if each.startswith(name)]
        assert [light for each in own for light in each.lights] == group.lights
        assert {each.flux for each in own} == {group.flux}
    assert check(single) == check(design)
    assert [each.path for each in quantities_of(single, chosen_families(USUAL, ["leds"]))] == [
        f"lights.{name}.flux" for name in single.lights
    ]


def test_the_flake_of_a_coating_becomes_rougher_where_there_is_one() -> None:
    shiny = set_value(gelsight_mini_ideal(), "coating.specularity", 0.3)
    made = changed(shiny, "coating", "roughness", 0.5)
    assert made.coating.reflection().roughness == pytest.approx(0.5)
    assert "roughness" not in shiny.coating.model_dump()
    words = [each.words for each in quantities_of(gelsight_mini_ideal(), ["coating"])]
    assert not any("roughness" in each for each in words)


def test_edges_that_were_fitted_are_fitted_again() -> None:
    (edges,) = quantities_of(gelsight_mini(), ["edges"])
    assert 0.1 < edges.start < 0.2
    (again,) = quantities_of(designed(gelsight_mini(), [edges], np.ones(1)), ["edges"])
    assert again.start == pytest.approx(edges.start + edges.plausible_range)

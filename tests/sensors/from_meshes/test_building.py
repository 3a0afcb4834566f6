"""From recipes and CAD files to designs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from step_extra import needs_step, write_step

from optisense import library, load
from optisense.design import (
    Provenance,
    Role,
    SensorDesign,
    Status,
    add_cage,
    cage_problems,
    move_points,
)
from optisense.errors import DesignError
from optisense.geometry.containment import inside
from optisense.sensors import check, save_design
from optisense.sensors.from_meshes import design_from_meshes, guess_recipe, read_recipe, save_recipe
from optisense.sensors.from_meshes.files import Use
from optisense.sensors.from_meshes.guessing import guess_use
from optisense.sensors.from_meshes.recipe_parts import ShapeReference
from optisense.workshop import export


def assert_same(one: SensorDesign, other: SensorDesign) -> None:
    """Equal but for rounding in the files (STL has single precision)."""
    places, expected = ([d.camera.position, d.camera.direction] for d in (one, other))
    assert list(one.lights) == list(other.lights)
    for name, group in one.lights.items():
        places += [x for light in group.lights for x in (light.position, light.direction)]
        twin = other.lights[name].lights
        expected += [x for light in twin for x in (light.position, light.direction)]
    np.testing.assert_allclose(places, expected, atol=1e-5)
    assert one.parts == other.parts
    for name, mesh in one.meshes.items():
        assert mesh.area == pytest.approx(other.meshes[name].area, rel=1e-5)
        np.testing.assert_allclose(mesh.bounds, other.meshes[name].bounds, atol=1e-5)


def test_a_design_in_order(cad: Any, tmp_path: Path) -> None:
    made = design_from_meshes(cad.write())
    design = made.design
    assert made.notes == [] and check(design) == []
    assert design.meshes["gel"].volume == pytest.approx(20 * 16 * 4)
    skin = design.meshes["skin"]
    assert skin.area == pytest.approx(20 * 16)
    np.testing.assert_allclose(skin.face_normals, [[0, 0, -1]] * len(skin.faces), atol=1e-12)
    assert design.provenance["parts.gel"].status is Status.SOURCED
    assert design.provenance["parts.gel.material"].status is Status.ASSUMED
    save_design(design, tmp_path / "saved")
    assert_same(load(tmp_path / "saved"), design)


@pytest.mark.parametrize("suffix", ["obj", "ply", "STL"])
def test_every_format_gives_the_same_design(cad: Any, suffix: str) -> None:
    expected = design_from_meshes(cad.write()).design
    assert_same(design_from_meshes(cad.write(suffix=suffix.lower())).design, expected)


@pytest.mark.parametrize(("units", "mm"), [("m", 1000.0), ("inch", 25.4), ("cm", 10.0)])
def test_every_unit_gives_the_same_design(cad: Any, units: str, mm: float) -> None:
    expected = design_from_meshes(cad.write()).design
    recipe = f"units: {units}\n" + cad.recipe
    assert_same(design_from_meshes(cad.write(recipe, scale=1.0 / mm)).design, expected)


def test_a_part_in_a_unit_of_its_own(cad: Any) -> None:
    expected = design_from_meshes(cad.write()).design
    gel = cad.shapes()["gel"].apply_scale(1.0 / 25.4)
    recipe = cad.recipe.replace("{file: gel.stl,", "{file: gel.stl, units: inch,")
    assert_same(design_from_meshes(cad.write(recipe, gel=gel)).design, expected)


def test_a_saved_recipe_gives_the_same_design_from_elsewhere(cad: Any, tmp_path: Path) -> None:
    text = cad.recipe.replace(
        "camera: {model: pi-v2}", "camera: {model: pi-v2, at: {file: lens.stl}, up: -y}"
    )
    text = text.replace(
        "lights:\n",
        "lights:\n  blue: {model: ws2812b, colour: [0, 0.2, 1], "
        "over: {file: leds.stl, towards: -x, patches: all}}\n"
        "  one: {model: smd-3528, colour: white, at: [{position: [0, 0, -9], "
        "direction: [0, 0, 1]}]}\n"
        "  table: {model: smd-3528, colour: green, "
        "from: {file: leds.csv, units: mm, origin: [0, 0, -9]}}\n",
    )
    text = text.replace("gel: {file: gel.stl,", "gel: {file: gel.stl, on: plate,")
    file = cad.write(text)
    (cad.folder / "leds.csv").write_text("Ref,PosX,PosY,Rot,Side\nD1,1,2,0,top\n")
    recipe = read_recipe(file)
    save_recipe(recipe, tmp_path / "deep" / "down" / "recipe.yaml")
    again = read_recipe(tmp_path / "deep" / "down" / "recipe.yaml")
    assert_same(design_from_meshes(again).design, design_from_meshes(recipe).design)
    (light,) = design_from_meshes(again).design.lights["table"].lights
    assert light.position == pytest.approx((1.0, 2.0, -8.95))
    assert again.camera.up == recipe.camera.up and again.lights["one"] == recipe.lights["one"]


def test_a_curved_skin_is_taken_whole_along_smooth_faces(cad: Any) -> None:
    """Half a ball: by direction alone its cap is chosen, with tangent: true all of it."""
    radius = 10.0
    ball = trimesh.creation.icosphere(subdivisions=4, radius=radius)
    half = trimesh.intersections.slice_mesh_plane(ball, (0, 0, 1), (0, 0, 0), cap=True)
    cap = design_from_meshes(cad.write(gel=half)).design.meshes["skin"]
    assert cap.area == pytest.approx(2 * np.pi * radius**2 * (1 - np.cos(np.radians(30))), rel=0.02)
    text = cad.recipe.replace("towards: +z", "towards: +z, tangent: true")
    made = design_from_meshes(cad.write(text, gel=half))
    skin = made.design.meshes["skin"]
    assert skin.area == pytest.approx(2 * np.pi * radius**2, rel=0.01)
    inward = -skin.triangles.mean(axis=1)
    assert (np.einsum("ij,ij->i", inward, skin.face_normals) > 0).all()


def test_small_gaps_are_closed_and_wide_ones_are_told(cad: Any) -> None:
    low = cad.block((-12, -10, -3.02), (12, 10, -0.02))
    made = design_from_meshes(cad.write(plate=low))
    assert made.design.meshes["gel"].bounds[0, 2] == pytest.approx(-0.02, abs=1e-6)
    assert any("gap of up to 0.020 mm was closed" in note for note in made.notes)

    film = cad.write(cad.recipe + "air_films: [[gel, plate]]\n", plate=low)
    made = design_from_meshes(film)
    assert made.design.meshes["gel"].bounds[0, 2] == 0.0 and made.notes == []

    far = cad.block((-12, -10, -3.2), (12, 10, -0.2))
    made = design_from_meshes(cad.write(plate=far))
    assert made.design.meshes["gel"].bounds[0, 2] == 0.0
    assert any("air_films" in note for note in made.notes)


def test_round_shells_cut_into_other_triangles_have_no_air_between(cad: Any) -> None:
    """Two half shells meet at a radius of 11 mm, the one cut into 60 segments, the other 47."""

    def shell(outer: float, inner: float, steps: int, segments: int) -> trimesh.Trimesh:
        turn = np.linspace(0.0, np.pi / 2, steps)
        arc = np.column_stack([np.cos(turn), np.sin(turn)])
        arc[-1, 0] = 0.0
        outline = np.concatenate([outer * arc, inner * arc[::-1], outer * arc[:1]])
        return trimesh.creation.revolve(outline, sections=segments)

    made = design_from_meshes(
        cad.write(
            cad.recipe.replace("towards: +z", "towards: +z, tangent: true"),
            gel=shell(13.0, 11.0, 24, 60),
            plate=shell(11.0, 8.0, 17, 47),
        )
    )
    assert [note for note in made.notes if "was closed by moving curved faces of gel" in note]
    assert not [note for note in made.notes if "film of air" in note]
    ways = np.random.default_rng(1).normal(size=(300, 3))
    ways[:, 2] = np.abs(ways[:, 2]) + 0.5
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    for radius in (10.8, 10.95, 11.0, 11.05, 11.2):
        points = radius * ways
        solid = inside(points, made.design.meshes["gel"])
        solid |= inside(points, made.design.meshes["plate"])
        assert solid.all(), radius


def test_overlapping_solids_are_told_and_the_rigid_one_keeps_its_place(cad: Any) -> None:
    made = design_from_meshes(cad.write(plate=cad.block((-12, -10, -3), (12, 10, 1))))
    assert any("plate keeps the place" in note for note in made.notes)
    parts = made.design.parts
    assert parts["plate"].priority > parts["gel"].priority
    assert check(made.design) == []


def test_a_skin_of_its_own_is_laid_on_the_gel_and_looks_inward(cad: Any) -> None:
    sheet = trimesh.Trimesh([[-10, -8, 4.01], [10, -8, 4.01], [10, 8, 4.01], [-10, 8, 4.01]],
                            [[0, 1, 2], [0, 2, 3]])  # fmt: skip
    text = cad.recipe.replace("{faces_of: gel, towards: +z,", "{file: skin.stl,")
    made = design_from_meshes(cad.write(text, skin=sheet))
    skin = made.design.meshes["skin"]
    assert (skin.vertices[:, 2] == 4.0).all()
    assert (skin.face_normals @ [0, 0, -1] > 0.999).all()
    assert any("faces of gel take its place" in note for note in made.notes)


def test_an_inverted_part_is_turned_over(cad: Any) -> None:
    gel = cad.shapes()["gel"]
    gel.invert()
    made = design_from_meshes(cad.write(gel=gel))
    assert made.design.meshes["gel"].volume > 0
    assert any("inside out" in note for note in made.notes)


def test_what_looks_odd_is_told(cad: Any) -> None:
    away = cad.recipe.replace("pi-v2}", "pi-v2, at: [0, 0, -20], direction: -z}")
    assert any("sees about 0 %" in note for note in design_from_meshes(cad.write(away)).notes)
    far = cad.recipe.replace("pi-v2}", "pi-v2, at: [0, 0, -300]}")
    assert any("far away" in note for note in design_from_meshes(cad.write(far)).notes)
    above = cad.recipe.replace("pi-v2}", "pi-v2, at: [0, 0, 30]}")  # it sees the back of the skin
    assert any("sees about 0 %" in note for note in design_from_meshes(cad.write(above)).notes)


@pytest.mark.parametrize(("z", "told"), [(-22, ""), (-60, "fills only about 8 % of the area")])
def test_the_share_of_the_picture_does_not_depend_on_the_triangles(
    cad: Any, z: float, told: str
) -> None:
    """64 mm away, the view is 77 x 58 mm wide, of which the skin of 20 x 16 mm fills 7 %."""
    text = cad.recipe.replace("pi-v2}", f"pi-v2, at: [0, 0, {z}]}}")
    gel = cad.shapes()["gel"]
    for shape in (gel, gel.subdivide().subdivide().subdivide()):
        notes = design_from_meshes(cad.write(text, gel=shape)).notes
        seen = [note for note in notes if "picture" in note or "camera sees" in note]
        assert len(seen) == bool(told) and all(told in note for note in seen)


def test_a_row_longer_than_its_side_is_told(cad: Any) -> None:
    """Four lights 10 mm apart are 30 mm; the plate is 24 mm long."""
    notes = design_from_meshes(cad.write(cad.recipe.replace("pitch: 4.5", "pitch: 10"))).notes
    assert any("lights red: 2 of 4 are beyond the ends of plate" in note for note in notes)
    assert not any("beyond" in note for note in design_from_meshes(cad.write()).notes)


class TestGuessing:
    def test_names_say_what_is_what(self, cad: Any) -> None:
        cad.write()
        recipe = guess_recipe(cad.folder)
        roles = {name: part.role for name, part in recipe.parts.items()}
        assert roles == {
            "gel": Role.ELASTOMER,
            "skin": Role.SENSING_SURFACE,
            "plate": Role.SUPPORT,
        }
        assert recipe.parts["skin"].towards == "+z"  # away from the lens, LEDs and plate
        over = recipe.lights["leds"].over
        assert over is not None and over.towards == "-x"
        design = design_from_meshes(recipe).design
        assert len(design.lights["leds"].lights) == 3
        assert design.camera.position == pytest.approx((0, 0, -20))
        assert check(design) == []

    @pytest.mark.parametrize(
        ("names", "use"),
        [
            ("light_guide LightGuide lightguide light-guide-plate acrylic_cover", Role.SUPPORT),
            (
                "camera_mount lens-barrel led_holder GelFrame mirror_mount window_frame",
                Role.BLOCKER,
            ),
            ("led_board LEDs_red", "lights"),
            ("camera camera_board", "camera"),
            ("mirror_plate", Role.MIRROR),
            ("base_gel", Role.ELASTOMER),
        ],
    )
    def test_a_holder_is_not_what_it_holds(self, names: str, use: Use) -> None:
        assert {name: guess_use(name) for name in names.split()} == dict.fromkeys(
            names.split(), use
        )

    def test_a_body_of_unknown_use_that_carries_the_gel_is_clear(self, cad: Any) -> None:
        cad.write()
        (cad.folder / "plate.stl").rename(cad.folder / "core.stl")
        low, high = cad.shapes()["gel"].bounds
        cad.block((high[0], low[1], low[2]), (high[0] + 1, high[1], high[2])).export(
            cad.folder / "thing.stl"
        )  # beside the gel
        parts = guess_recipe(cad.folder).parts
        assert parts["core"].role is Role.SUPPORT
        assert parts["thing"].role is Role.BLOCKER

    def test_a_lens_that_carries_the_gel_is_not_the_camera_s(self, cad: Any) -> None:
        cad.write()
        (cad.folder / "plate.stl").rename(cad.folder / "shaping_lens.stl")
        recipe = guess_recipe(cad.folder)
        assert recipe.parts["shaping_lens"].role is Role.SUPPORT
        assert isinstance(recipe.camera.at, ShapeReference)
        assert recipe.camera.at.file == "lens.stl"

    @pytest.mark.parametrize("share", [1.0, 0.5])
    @pytest.mark.parametrize("name", ["gel", "plate"])
    def test_faces_that_are_inside_out_do_not_hide_what_carries_the_gel(
        self, cad: Any, name: str, share: float
    ) -> None:
        shape = cad.shapes()[name].subdivide()
        turned = np.random.default_rng(0).random(len(shape.faces)) < share
        shape.faces[turned] = shape.faces[turned][:, ::-1]
        cad.write(**{name: shape})
        (cad.folder / "plate.stl").rename(cad.folder / "core.stl")
        assert guess_recipe(cad.folder).parts["core"].role is Role.SUPPORT

    def test_a_single_file_gets_lights_and_a_camera(self, cad: Any) -> None:
        cad.write()
        design = design_from_meshes(guess_recipe(cad.folder / "gel.stl")).design
        assert set(design.lights) == {"red", "green", "blue"}
        assert design.meshes["skin"].area == pytest.approx(20 * 16)
        assert check(design) == []

    def test_the_only_fair_unit_is_found(self, cad: Any) -> None:
        cad.write(scale=0.001)
        recipe = guess_recipe(cad.folder)
        assert recipe.units == "m"
        assert design_from_meshes(recipe).design.meshes["gel"].volume == pytest.approx(1280)


def test_an_indenter_is_kept_for_reference(cad: Any) -> None:
    text = cad.recipe.replace("lights:\n", "  screw: {file: lens.stl, role: indenter}\nlights:\n")
    made = design_from_meshes(cad.write(text))
    assert made.design.parts["screw"].role is Role.INDENTER
    assert any("--contact mesh:" in note for note in made.notes)


@needs_step
@pytest.mark.usefixtures("forks")
class TestStep:
    """All parts in one STEP file, exact and in millimetres."""

    def step(self, cad: Any) -> tuple[SensorDesign, str]:
        design = design_from_meshes(cad.write()).design
        (file,) = export(design, cad.folder / "out", ["step"])[:1]
        text = cad.recipe
        for name in ("gel", "plate"):
            text = text.replace(f"file: {name}.stl,", f"file: out/{file.name}, solid: {name},")
        return design, text

    def test_bodies_are_named_and_one_that_is_not_there_is_told(self, cad: Any) -> None:
        expected, text = self.step(cad)
        assert_same(design_from_meshes(cad.write(text)).design, expected)
        guess = guess_recipe(next((cad.folder / "out").glob("*.step")))
        assert guess.parts["gel"].role is Role.ELASTOMER and guess.parts["gel"].solid == "gel"

        # A recipe that names no body, or one that is not there.
        with pytest.raises(DesignError, match="no body 'jelly'") as caught:
            design_from_meshes(cad.write(text.replace("solid: gel", "solid: jelly")))
        assert "gel, " in str(caught.value.hint) and "part gel" in str(caught.value.where)
        with pytest.raises(DesignError, match="solid must name one of them"):
            design_from_meshes(cad.write(text.replace(", solid: gel", "")))
        with pytest.raises(DesignError, match="states its units"):
            design_from_meshes(cad.write(text.replace("solid: gel", "solid: gel, units: cm")))

    def test_copies_of_one_led_are_one_group_on_each_side(self, tmp_path: Path) -> None:
        from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
        from OCP.gp import gp_Pnt

        gel = BRepPrimAPI_MakeBox(gp_Pnt(-20, -2, 0), 40.0, 20.0, 4.0).Shape()
        led = BRepPrimAPI_MakeBox(gp_Pnt(0, -4, 1), 1.0, 1.0, 1.0).Shape()
        file = write_step(tmp_path / "pad.step", {"Gel": (gel, 0.0), "LED": (led, -3, 0, 30, 3)})
        recipe = guess_recipe(file)
        assert set(recipe.lights) == {"LED", "LED-3"}
        front = recipe.lights["LED"].over
        assert front is not None and front.towards == "+y"
        assert front.solid == ["LED", "LED-2", "LED-4"]
        lights = design_from_meshes(recipe).design.lights
        assert [len(group.lights) for group in lights.values()] == [3, 1]
        at = sorted(light.position[0] for light in lights["LED"].lights)
        assert at == pytest.approx([-2.5, 0.5, 3.5])


class TestFlux:
    """The flux of a group whose recipe names none is that of the library, with its source."""

    @staticmethod
    def group(cad: Any, light: str) -> tuple[float, Provenance]:
        made = design_from_meshes(cad.write(cad.recipe.replace("smd-3528, colour: red", light)))
        return made.design.lights["red"].flux, made.design.provenance["lights.red.flux"]

    def test_nominal(self, cad: Any) -> None:
        entry: Any = library.entry("light", "smd-3528")
        for colour in ("blue", "[0, 0, 0.5]"):
            flux, source = self.group(cad, f"smd-3528, colour: {colour}")
            assert flux == entry.typical["blue"].flux
            assert source.status is entry.source("flux.blue").status
            assert "blue smd-3528 in the library, 18 mW at 20 mA" in source.source
            assert source.source.endswith(entry.source("flux.blue").source)

    def test_no_led_of_a_mixed_colour_exceeds_its_nominal_flux(self, cad: Any) -> None:
        flux, source = self.group(cad, "smd-3528, colour: white")
        assert flux == pytest.approx(3 * 2.1)  # red is the weakest of 2.1, 2.3 and 18 mW
        assert "of which its red LED gives 2.1 mW at 20 mA" in source.source

    def test_unknown_to_the_library(self, cad: Any) -> None:
        """The library states no flux of a red LED."""
        flux, source = self.group(cad, "round-5mm-15, colour: white")
        assert flux == 10.0 and source.status is Status.ASSUMED
        assert "neither the recipe nor the library" in source.source

    def test_of_the_recipe(self, cad: Any) -> None:
        flux, source = self.group(cad, "smd-3528, colour: red, flux: 3.5")
        assert flux == 3.5 and source.source.startswith("from the recipe")


def test_a_part_that_is_cut_follows_its_cage(cad: Any) -> None:
    gel = "gel: {file: gel.stl, role: elastomer"
    fine = cad.recipe.replace(gel, gel + ", cut_every: 1")
    for recipe, coarse in ((cad.recipe, True), (fine, False)):
        design = design_from_meshes(cad.write(recipe)).design
        assert check(design) == []
        assert design.meshes["gel"].volume == pytest.approx(20 * 16 * 4)
        moved = move_points(add_cage(design, "bump", ["gel", "skin"]), "bump", {"1,1,2": (0, 0, 3)})
        told = [p for p in cage_problems(moved) if "too large triangles" in p.message]
        assert bool(told) is coarse
        assert all("cut_every" in str(problem.hint) for problem in told)

    with pytest.raises(DesignError, match=r"part 'gel': .* more than 200,000 triangles") as caught:
        design_from_meshes(cad.write(fine.replace("cut_every: 1", "cut_every: 0.001")))
    assert str(caught.value.where).endswith("sensor.yaml:3")
    with pytest.raises(DesignError, match="cut_every is for files only"):
        design_from_meshes(cad.write(cad.recipe.replace("faces_of", "cut_every: 1, faces_of")))

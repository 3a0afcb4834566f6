"""Parts in frames of their own, lights along outlines, and lights of pick-and-place files."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from optisense import sensors
from optisense.errors import DesignError
from optisense.geometry import TriangleMesh
from optisense.geometry.rotations import turn_about_axes
from optisense.sensors.from_meshes import design_from_meshes, guess_recipe
from optisense.sensors.from_meshes._part_poses import laid_on, posed
from optisense.sensors.from_meshes._pick_and_place import BoardPart, read_pick_and_place
from optisense.sensors.from_meshes._strips import along, from_table
from optisense.sensors.from_meshes.recipe_lights import FromTable, LightsAlong
from optisense.sensors.from_meshes.recipe_parts import PartChoice
from optisense.workshop import placements
from optisense.workshop._placement import placement_csv
from tests.sensors.from_meshes.conftest import Cad

BOX = TriangleMesh.box((0.0, 0.0, 0.0), (2.0, 4.0, 6.0))


def choice(**fields: Any) -> PartChoice:
    return PartChoice.model_validate({"file": "a.stl", "role": "support", **fields})


class TestMoves:
    def test_mirror_then_turn_then_move(self) -> None:
        moved = posed(BOX, choice(mirror="x", turn=[0, 0, 90], move=[10, 0, 0]))
        np.testing.assert_array_equal(moved.bounds, [[6.0, -2.0, 0.0], [10.0, 0.0, 6.0]])
        assert moved.volume == pytest.approx(BOX.volume)  # a mirrored solid still faces out

    def test_turns_follow_one_another_about_standing_axes(self) -> None:
        turned = turn_about_axes(90.0, 0.0, 90.0) @ np.array([0.0, 1.0, 0.0])
        np.testing.assert_array_equal(turned, [0.0, 0.0, 1.0])
        turned = turn_about_axes(30.0, 0.0, 0.0) @ np.array([0.0, 1.0, 0.0])
        np.testing.assert_allclose(turned, [0.0, math.sqrt(0.75), 0.5])

    def test_on_puts_a_flat_face_in_the_middle_of_a_face(self) -> None:
        plate = TriangleMesh.box((-10.0, -10.0, -3.0), (20.0, 10.0, 1.0))
        laid = laid_on(BOX, plate, choice(on="plate", gap=0.5))
        np.testing.assert_allclose(laid.bounds, [[4.0, -2.0, 1.5], [6.0, 2.0, 7.5]])
        laid = laid_on(BOX, plate, choice(on="plate", side="-x", flush=["+z"], move=[0, 1, 0]))
        np.testing.assert_allclose(laid.bounds, [[-12.0, -1.0, -5.0], [-10.0, 3.0, 1.0]])

    def test_the_flat_face_counts_and_not_what_stands_out_beside_it(self) -> None:
        """A plate with a high and narrow post at one end: what lies on it lies on the post."""
        post = TriangleMesh.joined([BOX, TriangleMesh.box((0.0, 0.0, 6.0), (1.0, 1.0, 9.0))])
        laid = laid_on(BOX, post, choice(on="post"))
        np.testing.assert_allclose(laid.bounds.mean(axis=0), [0.5, 0.5, 12.0])


RECIPE = """\
name: block
parts:
  gel: {file: gel.stl, role: elastomer, on: plate}
  skin: {faces_of: gel, towards: +z, role: sensing_surface}
  plate: {file: plate.stl, role: support, turn: [180, 0, 0], move: [0, 0, 5]}
lights:
  red: {model: smd-3528, colour: red, row: {part: plate, side: +y, count: 4, pitch: 4.5}}
camera: {model: pi-v2}
"""


def test_a_recipe_moves_its_parts(cad: Cad) -> None:
    gel = trimesh.creation.box(bounds=[(100, 100, 100), (120, 116, 104)])
    made = design_from_meshes(cad.write(RECIPE, gel=gel))
    np.testing.assert_allclose(
        made.design.meshes["plate"].bounds, [[-12, -10, 5], [12, 10, 8]], atol=1e-5
    )
    np.testing.assert_allclose(
        made.design.meshes["gel"].bounds, [[-10, -8, 8], [10, 8, 12]], atol=1e-5
    )
    assert sensors.check(made.design) == []
    assert made.design.provenance["parts.gel"].source == "CAD file gel.stl, laid on plate"


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("on: plate", "on: gel"), "lies on itself"),
        (("on: plate", "on: skin"), "consists of faces of another part"),
        (("on: plate", "on: plat"), "no part 'plat'"),
        (("on: plate", "gap: 1"), "gap needs on"),
        (("on: plate", "on: plate, flush: [+z]"), "flush can't name z"),
        (("towards: +z,", "towards: +z, move: [0, 0, 1],"), "faces move with their part"),
        (("turn: [180, 0, 0]", "on: gel"), "lie on one another"),
    ],
)
def test_moves_that_cannot_be(cad: Cad, change: tuple[str, str], words: str) -> None:
    with pytest.raises(DesignError, match=words):
        design_from_meshes(cad.write(RECIPE.replace(*change)))


def test_a_single_light_beside_a_long_side_is_not_beyond_it(cad: Cad) -> None:
    """The range of a single place is 0 along each axis, which says nothing about its row."""
    text = RECIPE.replace("side: +y, count: 4, pitch: 4.5", "side: +x, count: 1")
    assert not [note for note in design_from_meshes(cad.write(text)).notes if "beyond" in note]
    text = RECIPE.replace("count: 4, pitch: 4.5", "count: 1, shift: 13")
    (note,) = [n for n in design_from_meshes(cad.write(text)).notes if "beyond" in n]
    assert "1 of 1 are beyond the ends of plate, which is 24 mm long along x" in note


@pytest.mark.usefixtures("forks")
def test_file_names_tell_what_a_nameless_body_is(tmp_path: Path) -> None:
    pytest.importorskip("OCP")
    from optisense.design import Role
    from optisense.workshop._step_format import write_step
    from optisense.workshop.shapes import Shape

    for file in ("Pinki Gel", "Top Housing"):
        write_step(tmp_path / f"{file}.step", [Shape("Part-1", Role.BLOCKER, None, BOX)])
    recipe = guess_recipe(tmp_path)
    assert recipe.parts["Pinki-Gel"].role is Role.ELASTOMER
    assert recipe.parts["Top-Housing"].role is Role.BLOCKER


class TestAlong:
    def test_it_follows_the_outline_around_corners(self) -> None:
        lights = along(
            LightsAlong(edge_of="p", start="-y", count=3, pitch=10.0, gap=0.5, height=0.0),
            TriangleMesh.box((-4.0, -10.0, -1.0), (4.0, 10.0, 2.0)),
        )
        places = np.array([light.position for light in lights])
        np.testing.assert_allclose(
            places, [[-4.5, -4.0, 0.0], [0.0, -10.5, 0.0], [4.5, -4.0, 0.0]], atol=1e-6
        )
        np.testing.assert_allclose(
            [light.direction for light in lights], [[1, 0, 0], [0, 1, 0], [-1, 0, 0]], atol=1e-6
        )

    def test_on_a_round_part_lights_look_to_its_axis(self) -> None:
        cylinder = trimesh.creation.cylinder(radius=5.0, height=4.0, sections=64)
        mesh = TriangleMesh(cylinder.vertices, cylinder.faces)
        lights = along(LightsAlong(edge_of="p", start="+x", shift=2.0, count=7, gap=0.0), mesh)
        places = np.array([light.position for light in lights])
        ways = np.array([light.direction for light in lights])
        np.testing.assert_allclose(np.linalg.norm(places, axis=1), 5.0, rtol=2e-3)
        np.testing.assert_allclose(ways, -places / 5.0, atol=5e-3)
        steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
        np.testing.assert_allclose(steps, steps[0], rtol=1e-2)

    def test_it_finds_digits_leds(self) -> None:
        digit = sensors.digit()
        for name, shift in (("red", 34.0), ("green", -34.0), ("blue", 0.0)):
            (found,) = along(
                LightsAlong(edge_of="acrylic", start="-y", shift=shift, height=-5.62),
                digit.meshes["acrylic"],
            )
            (built,) = digit.lights[name].lights
            np.testing.assert_allclose(found.position, built.position, atol=0.03)
            np.testing.assert_allclose(found.direction, built.direction, atol=0.02)  # of a polygon

    def test_a_height_beside_the_part_is_told(self) -> None:
        with pytest.raises(
            DesignError, match=r"no outline at height 9 mm: along z it reaches from"
        ):
            along(LightsAlong(edge_of="p", start="+x", height=9.0), BOX)


KICAD_POS = """\
### Footprint positions - created on 2026-01-01 ###
### Printed by KiCad
## Unit = mm, Angle = deg.
## Side : All
# Ref     Val       Package                PosX       PosY       Rot  Side
D1        RED       LED_0603            25.4000   -12.7000   90.0000  top
D2        GREEN     LED_0603           -25.4000    12.7000  180.0000  bottom
## End
"""
KICAD_CSV = """\
Ref,Val,Package,PosX,PosY,Rot,Side
"D1","RED","LED_0603",25.400000,-12.700000,90.000000,top
"D2","GREEN","LED_0603",-25.400000,12.700000,180.000000,bottom
"""
ALTIUM = """\
Altium Designer Pick and Place Locations
C:\\Boards\\strip.PcbDoc

Units used: mil

"Designator","Comment","Layer","Footprint","Center-X(mil)","Center-Y(mil)","Rotation","Description"
"D1","RED","TopLayer","0603","1000.000","-500.000","90","LED, red"
"D2","GREEN","BottomLayer","0603","-1000.000","500.000","180","LED"
"""
EASYEDA = (
    "Designator\tFootprint\tMid X\tMid Y\tRef X\tRef Y\tPad X\tPad Y\tLayer\tRotation\tComment\n"
    "D1\tLED\t1000mil\t-500mil\t0mil\t0mil\t0mil\t0mil\tT\t90\tRED\n"
    "D2\tLED\t-1000mil\t500mil\t0mil\t0mil\t0mil\t0mil\tB\t180\tGREEN\n"
)


OTHER = (
    "Ref;X [mm];Y [mm];Rotation_deg;Mount side\n"
    "D1;25.4;-12.7;90,00;component side\nD2;-25.4;12.7;180°;solder side\n"
)


@pytest.mark.parametrize(
    ("text", "coding", "units"),
    [
        (KICAD_POS, "utf-8", None),
        (KICAD_CSV, "utf-8-sig", "mm"),
        (ALTIUM, "latin-1", None),
        (EASYEDA, "utf-16", None),
        (OTHER, "latin-1", None),
    ],
)
def test_pick_and_place_files_of_all_programs(
    tmp_path: Path, text: str, coding: str, units: Any
) -> None:
    file = tmp_path / "leds.txt"
    file.write_text(text, encoding=coding)
    found, notes = read_pick_and_place(file, units)
    assert notes == []
    assert list(found) == ["D1", "D2"]
    first, second = found["D1"], found["D2"]
    assert isinstance(first, BoardPart) and isinstance(second, BoardPart)
    assert first.x == pytest.approx(25.4)
    assert first.y == pytest.approx(-12.7)
    assert (first.rotation, first.bottom) == (90.0, False)
    assert (second.rotation, second.bottom) == (180.0, True)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (KICAD_CSV, "does not state the unit"),
        ("a,b\n1,2\n", "no pick-and-place file"),
        (ALTIUM.replace("-500.000", "here"), "'here' is no length"),
        (ALTIUM.split('"D1"')[0], "has no parts"),
        (ALTIUM.replace("-500.000", "1" * 31), "too large a number: at most 10,000 mm"),
        (placement_csv(placements(sensors.gelsight360())), "z of 'D1', is not 0: .* in space"),
        (ALTIUM.replace('"180"', '"N/A"'), r"'N/A' is no rotation .*csv:8"),
        (ALTIUM.replace("BottomLayer", "2"), r"'2' is no side of a board .*csv:8"),
        (ALTIUM.replace("D2", "D1"), r"'D1' is also in line 7 .*csv:8"),
        ("[" * 200_000, "no pick-and-place file: the line has 200,000 characters"),
    ],
)
def test_files_that_cannot_be_read(tmp_path: Path, text: str, words: str) -> None:
    file = tmp_path / "leds.csv"
    file.write_text(text)
    with pytest.raises(DesignError, match=words):
        from_table(FromTable(file=file.name, origin=(0.0, 0.0, 0.0)), read_pick_and_place(file)[0])


def test_rows_that_are_not_chosen_may_be_faulty(tmp_path: Path) -> None:
    """KiCad calls all holes REF**, and other programs give parts without a side or an angle."""
    file = tmp_path / "leds.csv"
    file.write_text(
        "Ref,X_mm,Y_mm,Z_mm,Rot,Side\nREF**,1,1,,0,top\nREF**,9,1,0,0,top\n"
        "X1,5,5,0,N/A,top\nX2,6,6,0,0,MultiLayer\nD1,2,3,0.0,90,top\n"
        'D2,4,3,"-0,00 mm",90,top\nH1,7,7,1.6,0,top\nH2,7,9,"1,6",0,top\nH3,7,9,3.,0,top\n'
        'D3,6,3,0 thou,90,top\nD4,8,3,0.0",90,top\nD5,9,3,1e-17,90,top\n'
        "H4,7,7,-,0,top\nH5,7,7,e5,0,top\nH6,7,7,mm,0,top\n"
    )
    found = read_pick_and_place(file)[0]
    choice = FromTable(file=file.name, only="D*", origin=(0.0, 0.0, 0.0), gap=0.0)
    lights = from_table(choice, found)
    assert [light.position for light in lights] == [
        (x, 3.0, 0.0) for x in (2.0, 4.0, 6.0, 8.0, 9.0)
    ]
    faults = {"REF**": "also in line 2", "X1": "'N/A' is no", "X2": "no side"}
    faults |= {"H1": "'1.6', .* is not 0.*csv:8", "H2": "'1,6', .* not 0", "H3": "'3.', .* not 0"}
    faults |= {"H4": "'-' is no length", "H5": "'e5' is no", "H6": "'mm' is no"}
    for only, words in faults.items():
        with pytest.raises(DesignError, match=words):
            from_table(choice.model_copy(update={"only": only}), found)


def test_columns_that_a_table_lacks_are_noted(tmp_path: Path) -> None:
    file = tmp_path / "leds.csv"
    file.write_text("Ref,X_mm,Y_mm,Mirror\nD1,1.0,2.0,yes\n")
    found, notes = read_pick_and_place(file)
    assert found["D1"] == BoardPart("D1", 1.0, 2.0, 0.0, False)
    assert [note.split(" (")[0] for note in notes] == [
        "leds.csv has no column of a rotation",
        "leds.csv has no column of a side",
    ]


TABLE = {
    "D1": BoardPart("D1", 3.0, 1.0, 90.0, False),
    "D2": BoardPart("D2", 3.0, 6.0, 0.0, True),
    "D3": BoardPart("D3", -4.0, 1.0, 0.0, False),
}


class TestFromTable:
    def test_an_origin_and_two_directions(self) -> None:
        chosen = FromTable(
            file="f", only="D1", origin=(10.0, 0.0, 0.0), right="+y", normal="+x", gap=0.5
        )
        (light,) = from_table(chosen, TABLE)
        assert light.position == pytest.approx((10.5, 3.0, 1.0))
        assert light.direction == pytest.approx((1.0, 0.0, 0.0))
        assert light.up == pytest.approx((0.0, -1.0, 0.0))

    @pytest.mark.parametrize("count", [2, 3])
    def test_points_give_the_places_back(self, count: int) -> None:
        turn = turn_about_axes(20.0, 110.0, -40.0)
        there = {
            n: tuple(float(v) for v in turn @ (p.x, p.y, 0.0) + (1.0, 2.0, 3.0))
            for n, p in TABLE.items()
        }
        points = dict(list(there.items())[:count])
        normal = tuple(turn[:, 2].tolist()) if count == 2 else None
        chosen = FromTable.model_validate(
            {"file": "f", "points": points, "normal": normal, "gap": 0.0}
        )
        for light, name in zip(from_table(chosen, TABLE), TABLE, strict=True):
            np.testing.assert_allclose(light.position, there[name], atol=1e-5)
            sign = -1.0 if TABLE[name].bottom else 1.0
            np.testing.assert_allclose(light.direction, sign * turn[:, 2], atol=1e-5)

    def test_what_does_not_fit_is_told(self) -> None:
        with pytest.raises(DesignError, match="no part 'D7'"):
            from_table(FromTable(file="f", only="D7", origin=(0, 0, 0)), TABLE)
        far = {"D1": (0.0, 0.0, 0.0), "D2": (0.0, 50.0, 0.0)}
        with pytest.raises(DesignError, match=r"5\.000 mm apart in the file, but 50\.000 mm"):
            from_table(FromTable(file="f", points=far, normal="+z"), TABLE)
        with pytest.raises(ValueError, match="two points need normal"):
            FromTable(file="f", points=far)

"""The bill of materials: amounts by closed forms, and what the library knows of the parts."""

from __future__ import annotations

import csv
import io
import math

import pytest

from optisense import sensors
from optisense.design import Conductor, Dielectric, LightGroup, Part, Provenance, Role, SensorDesign
from optisense.geometry import TriangleMesh
from optisense.workshop import bill_of_materials
from optisense.workshop._bill_of_materials import Item


def items(design: SensorDesign, kind: str) -> dict[str, Item]:
    """The lines of a kind, by what they are used for."""
    return {i.used_for.split()[0]: i for i in bill_of_materials(design).items if i.kind == kind}


def test_lights_are_counted_by_model_and_group(flat: SensorDesign) -> None:
    lights = items(flat, "light")
    assert {name: item.quantity for name, item in lights.items()} == dict.fromkeys(
        ("red", "green", "blue"), 5
    )
    assert lights["red"].name == "smd-3528"
    assert lights["red"].package == "2.8 x 3.5 x 1.9"
    assert lights["red"].part == "DL-TOP3528SRC-1SR120"
    assert lights["green"].part == "Everlight 67-21/GHC-BV1/2T"
    assert lights["green"].note.endswith("nominal 2.3 mW at 20 mA (assumed)")
    assert "(assumed)" not in lights["red"].note


def test_where_no_order_number_is_known_the_bill_says_what_will_do(flat: SensorDesign) -> None:
    design = flat.copy()
    design.lights["red"].model = "chanzon-5730"
    design.lights["blue"].model = "our-own"
    lights = items(design, "light")
    assert lights["red"].part == (
        "no order number known: any red LED of 5.7 x 3 x 0.9 mm "
        "with a dominant wavelength of 622 nm"
    )
    assert lights["blue"].part == "no order number known: any LED"


def test_a_light_that_must_give_more_than_it_can_is_remarked_on(flat: SensorDesign) -> None:
    assert "times" not in "".join(item.note for item in items(flat, "light").values())
    bright = flat.copy()
    for group in bright.lights.values():
        group.flux = 10.0
    lights = items(bright, "light")
    assert "4.8 times its nominal flux" in lights["red"].note  # 10 mW of 2.1
    assert "times" not in lights["blue"].note  # 10 mW of 18
    assert "nominal 18 mW at 20 mA" in lights["blue"].note
    bright.lights["blue"].colour = (1.0, 0.0, 1.0)
    mixed = items(bright, "light")["blue"].note
    assert "nominal 4.2 mW, of which its red LED gives 2.1 mW" in mixed
    assert "2.4 times its nominal flux" in mixed


def test_solids_have_their_volume_and_sheets_their_area(flat: SensorDesign) -> None:
    materials = items(flat, "material")
    assert materials["guide"].quantity == pytest.approx(25.25 * 20.75 * 4.0 / 1000)
    assert materials["tray"].quantity == pytest.approx(28.23 * 23.73 * 1.0 / 1000)
    assert materials["gel"].unit == "cm^3"
    coating = items(flat, "coating")["skin"]
    assert coating.quantity == pytest.approx(25.25 * 20.75 / 100)
    assert (coating.name, coating.unit) == ("diffuse-grey", "cm^2")
    assert "skin" not in materials


def test_mirrors_and_blockers_are_listed(flat: SensorDesign) -> None:
    design = flat.copy()
    silver = Conductor(eta=(0.1, 0.1, 0.1), k=(3.0, 3.0, 3.0))
    design.materials = {**design.materials, "silver": silver}
    design.parts = {
        **design.parts,
        "mirror": Part(role=Role.MIRROR, mesh="meshes/mirror.obj", material="silver"),
        "wall": Part(role=Role.BLOCKER, mesh="meshes/wall.obj"),
    }
    design.meshes["mirror"] = TriangleMesh.grid((20.0, 10.0))
    design.meshes["wall"] = TriangleMesh.box((0, 0, 0), (10, 10, 20))
    materials = items(design, "material")
    mirror, wall = materials["mirror"], materials["wall"]
    assert (mirror.quantity, mirror.unit) == (pytest.approx(2.0), "cm^2")
    assert mirror.description == "described in the design, conductor"
    assert (wall.quantity, wall.unit, wall.name) == (pytest.approx(2.0), "cm^3", "any black")


def test_what_a_design_has_changed_of_a_material_is_told(flat: SensorDesign) -> None:
    design = flat.copy()
    changed = Dielectric(ior=1.45)
    design.materials = {**design.materials, "silicone-xp565": changed}
    gel = items(design, "material")["gel"]
    assert gel.maker == "Silicones Inc."
    assert "index 1.45" in gel.note and "the library has index 1.41" in gel.note
    assert "library" not in items(flat, "material")["gel"].note


def test_lights_and_cameras_that_the_library_lacks(flat: SensorDesign) -> None:
    design = flat.copy()
    red = design.lights["red"].model_dump()
    emitter = {"kind": "area", "size": [1.0, 1.0]}
    design.lights["red"] = LightGroup.model_validate({**red, "model": "ours", "emitter": emitter})
    design.camera.model = "our-camera"
    light = items(design, "light")["red"]
    assert (light.name, light.maker, light.package) == ("ours", "", "")
    assert light.description == "described in the design: disc 1 mm"
    assert items(design, "camera")["camera"].description == "described in the design"


def test_the_table_holds_every_line(dome: SensorDesign) -> None:
    bill = bill_of_materials(dome)
    rows = list(csv.DictReader(io.StringIO(bill.csv())))
    assert len(rows) == len(bill.items)
    for row, item in zip(rows, bill.items, strict=True):
        assert float(row["quantity"]) == pytest.approx(item.quantity, rel=1e-3)
        assert (row["kind"], row["name"], row["note"]) == (item.kind, item.name, item.note)


def test_the_readable_bill_names_everything(dome: SensorDesign) -> None:
    bill = bill_of_materials(dome)
    text = bill.markdown()
    assert text.startswith("# Bill of materials: gelsight-mini-ideal-spherical\n")
    for heading in ("Lights", "Camera", "Materials", "Coating"):
        assert f"## {heading}\n" in text
    for item in bill.items:
        assert item.name in text and item.used_for in text
    widths = {line.count("|") for line in text.split("## Materials")[1].split("##")[0].splitlines()}
    assert len(widths - {0}) == 1


def test_bars_and_newlines_do_not_break_the_table(flat: SensorDesign) -> None:
    design = flat.copy()
    design.name = "a | b\nc"
    assert bill_of_materials(design).markdown().splitlines()[0].endswith(r"a \| b c")


def test_the_bill_tells_what_is_assumed_and_what_is_not_drawn() -> None:
    belt = items(sensors.gelbelt(), "material")
    # Half a turn around a wheel of 25 mm, and the straight run between wheels whose axes are apart
    # by dx and dz: gel of 3 mm on tape of 0.05 mm, 36 mm wide.
    low, high = sensors.gelbelt(light_design=1).meshes["wheels"].bounds
    run = high[0] - low[0] - 2 * (25.0 - 0.02)
    assert run == pytest.approx(90.0, abs=0.1)
    volume = 36.0 * (math.pi / 2 * (28.05**2 - 25.05**2) + 3.0 * run) / 1000.0
    plain = items(sensors.gelbelt(light_design=1), "material")["gel"].note
    assert f"way back is left out, {math.pi * 25.0 + run:.0f} of" in plain
    assert f"it takes {volume:.1f} cm^3 more" in plain
    assert "the belt's way back is left out" in belt["gel"].note
    assert "36 mm assumed" in belt["gel"].note
    assert belt["far-coat"].unit == "cm^3"
    assert "a sheet, made 0.1 mm thick (assumed: 0.1 mm, usual for" in belt["far-coat"].note
    sheet = sensors.gelbelt()
    sheet.parts["far-coat"].thickness = None
    line = items(sheet, "material")["far-coat"]
    assert line.unit == "cm^2" and "a sheet without thickness" in line.note
    design = sensors.gelsight_mini_ideal().copy()
    design.provenance["parts.gel"] = Provenance(status="sourced", source="its data sheet")
    note = items(design, "material")["gel"].note
    assert "assumed" not in note and "sheet" not in note


def test_a_sheet_is_billed_by_the_thickness_that_it_is_made_with() -> None:
    materials = items(sensors.gelsight_svelte(mirror_thickness=2.0), "material")
    m2 = materials["M2"]
    assert (m2.quantity, m2.unit) == (pytest.approx(2 * 0.32674, rel=1e-3), "cm^3")
    assert m2.note.startswith("a sheet, made 2 mm thick")
    assert "(assumed: " in materials["body"].note
    assert not any("without thickness" in item.note for item in materials.values())

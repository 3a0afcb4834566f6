"""Drawings of plates, read back by number."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pytest
import shapely
import trimesh

from optisense import sensors
from optisense.design import Role
from optisense.geometry import TriangleMesh
from optisense.workshop import export
from optisense.workshop._drawings import cut_file, drawing
from optisense.workshop._plates import Circle, Plate, plates
from optisense.workshop._sheet import LETTER, TEXT
from optisense.workshop.shapes import Shape, shapes

SVG = "{http://www.w3.org/2000/svg}"


def entities(text: str) -> list[dict[str, str]]:
    """The entities of a DXF drawing, by group code."""
    lines = text.split("\n")
    found: list[dict[str, str]] = []
    for code, value in zip(lines[::2], lines[1::2], strict=False):
        if code == "0":
            found.append({})
        found[-1][code] = value
    return [each for each in found if each["0"] in {"LINE", "ARC", "CIRCLE"}]


def enclosed(found: list[dict[str, str]]) -> float:
    """mm2 within lines and arcs that join into one outline."""
    parts = []
    for each in found:
        if each["0"] == "LINE":
            parts.append([(float(each["10"]), float(each["20"])),
                          (float(each["11"]), float(each["21"]))])  # fmt: skip
        elif each["0"] == "ARC":
            start, end = float(each["50"]), float(each["51"])
            angle = np.radians(np.linspace(start, end + 360.0 * (end < start), 2001))
            centre, radius = (float(each["10"]), float(each["20"])), float(each["40"])
            parts.append([(centre[0] + radius * math.cos(a), centre[1] + radius * math.sin(a))
                          for a in angle])  # fmt: skip
    merged = shapely.line_merge(shapely.set_precision(shapely.MultiLineString(parts), 1e-3))
    assert merged.geom_type == "LineString" and merged.is_ring, "one closed outline"
    return float(shapely.Polygon(merged).area)


def texts(svg: str) -> list[str]:
    return [each.text or "" for each in ElementTree.fromstring(svg).iter(f"{SVG}text")]


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("digit")
    return {file.name: file for file in export(sensors.digit(), folder, [])}


def test_the_acrylic_of_digit_is_cut_along_its_arcs(files: dict[str, Path]) -> None:
    """18.3 x 25 mm with a half round end of radius 9.15 and corners of 0.5 mm."""
    found = entities(files["acrylic-cut.dxf"].read_text())
    assert {each["8"] for each in found} == {"CUT"}
    radii = [float(each["40"]) for each in found if each["0"] == "ARC"]
    assert sorted(radii) == [0.5, 0.5, 9.15]
    area = 18.3 * (25.0 - 9.15) + math.pi / 2 * 9.15**2 - 2 * (1 - math.pi / 4) * 0.5**2
    assert enclosed(found) == pytest.approx(area, rel=1e-4)


def test_the_cut_file_states_its_unit(files: dict[str, Path]) -> None:
    """4 are millimetres, and 1 is metric; without them, readers guess the unit."""
    lines = files["acrylic-cut.dxf"].read_text().split("\n")
    pairs = list(zip(lines[::2], lines[1::2], strict=False))
    header = pairs[pairs.index(("2", "HEADER")) + 1 : pairs.index(("0", "ENDSEC"))]
    names = [value for code, value in header if code == "9"]
    values = dict(zip(names, header[1::2], strict=True))
    assert values == {
        "$ACADVER": ("1", "AC1009"), "$INSUNITS": ("70", "4"), "$MEASUREMENT": ("70", "1"),
    }  # fmt: skip


def test_the_sheet_has_three_views_and_all_dimensions(files: dict[str, Path]) -> None:
    svg = files["acrylic-drawing.svg"].read_text(encoding="utf-8")
    assert {"25", "18.3", "6.15", "R9.15", "R0.5"} <= set(texts(svg))
    assert "acrylic: 1 x 6.15 mm, acrylic" in texts(svg)
    root = ElementTree.fromstring(svg)
    assert root.attrib["width"] == f"{float(root.attrib['viewBox'].split()[2]):.2f}mm", "1:1"
    closed = [each.attrib["d"] for each in root.iter(f"{SVG}path")
              if each.attrib["class"] == "edge" and each.attrib["d"].endswith("Z")]  # fmt: skip
    assert len(closed) == 3
    boxes = [np.array([p.split()[:2] for p in d.removesuffix(" Z")[2:].split(" L ")], float)
             for d in closed[1:]]  # fmt: skip
    sides = [sorted(np.ptp(box, axis=0).tolist()) for box in boxes]
    assert sides[0] == pytest.approx([6.15, 25.0], abs=2e-3)
    assert sides[1] == pytest.approx([6.15, 18.3], abs=2e-3)


def test_holes_have_diameters_and_places() -> None:
    ring = trimesh.creation.annulus(r_min=3.0, r_max=10.0, height=2.0, sections=48)
    mesh = TriangleMesh(ring.vertices, ring.faces).welded()
    (plate,) = plates([Shape("ring", Role.BLOCKER, None, mesh)])
    assert [type(each) for each in plate.outlines] == [Circle, Circle]
    assert [each.radius for each in plate.outlines if isinstance(each, Circle)] == pytest.approx(
        [10.0, 3.0]
    )
    told = texts(drawing(plate, "a <design>"))
    assert {"A", "B", "A: ⌀20 at (10, 10)", "B: ⌀6 at (10, 10)"} <= set(told)
    assert "a <design>; mm, 1:1" in told
    assert [each["0"] for each in entities(cut_file(plate))] == ["CIRCLE", "CIRCLE"]


def extruded(outline: shapely.Polygon, name: str = "it") -> Plate:
    """A plate of 3 mm with this outline."""
    solid = trimesh.creation.extrude_polygon(outline, 3.0)
    mesh = TriangleMesh(solid.vertices, solid.faces).welded()
    (plate,) = plates([Shape(name, Role.BLOCKER, None, mesh)])
    return plate


def boxes_of_texts(svg: str) -> list[shapely.Polygon]:
    """What each text covers on the sheet, mm, with letters as wide as the widest usual font's."""
    found = []
    for each in ElementTree.fromstring(svg).iter(f"{SVG}text"):
        wide = LETTER * len(each.text or "")
        left = {"start": 0.0, "middle": -0.5 * wide, "end": -wide}[each.attrib["text-anchor"]]
        x, y = float(each.attrib["x"]), float(each.attrib["y"])
        box = shapely.box(x + left, y - TEXT, x + left + wide, y)
        is_upright = "transform" in each.attrib
        found.append(shapely.affinity.rotate(box, -90.0, origin=(x, y)) if is_upright else box)
    return found


def test_holes_are_lettered_and_no_text_covers_another() -> None:
    outline = shapely.box(0, 0, 40, 25).buffer(-4).buffer(4, quad_segs=16)
    for x, y, radius in ((8, 8, 1.6), (8, 12.5, 1.6), (32, 17, 2.5)):
        outline = outline.difference(shapely.Point(x, y).buffer(radius, quad_segs=16))
    slot = shapely.LineString([(21, 10), (21, 16)]).buffer(1.5, quad_segs=16)
    outline = outline.difference(slot).difference(shapely.box(25, 4, 29, 10))
    svg = drawing(extruded(outline), "a design")
    rows = {text.split(": ", 1)[1] for text in texts(svg) if text[1:3] == ": "}
    assert rows == {
        "⌀3.2 at (8, 8)", "⌀3.2 at (8, 12.5)", "⌀5 at (32, 17)",
        "slot 9 x 3 at (21, 13), 90 degrees to x", "opening 4 x 6, lower left corner at (25, 4)",
    }  # fmt: skip
    assert {"A", "B", "C", "D", "E", "R4"} <= set(texts(svg))
    boxes = boxes_of_texts(svg)
    assert not [
        (one, other) for k, one in enumerate(boxes) for other in boxes[:k]
        if one.intersection(other).area > 1e-9
    ]  # fmt: skip


def test_steps_have_their_distances_from_the_corner() -> None:
    outline = shapely.box(0, 0, 20, 20).difference(shapely.box(8, 5, 20, 15))
    told = texts(drawing(extruded(outline), "a design"))
    assert sorted(told[:8]) == sorted(["20", "20", "3", "0", "8", "0", "5", "15"])
    window = shapely.box(0, 0, 20, 20).difference(shapely.box(8, 5, 12, 15))
    assert "0" not in texts(drawing(extruded(window), "a design")), "the table has its sides"
    plain = texts(drawing(extruded(shapely.box(0, 0, 20, 10)), "a design"))
    assert sorted(plain[:3]) == ["10", "20", "3"] and "0" not in plain


def test_distances_of_steps_stay_on_the_sheet() -> None:
    notches = [shapely.box(x, 6, x + 1, 8) for x in range(1, 11, 2)]
    outline = shapely.box(0, 0, 12, 8).difference(shapely.union_all(notches))
    svg = drawing(extruded(outline), "a design")
    wide, high = (float(x) for x in ElementTree.fromstring(svg).attrib["viewBox"].split()[2:])
    left, low, right, top = shapely.total_bounds(boxes_of_texts(svg))
    assert left >= 0 and low >= 0 and right <= wide and top <= high


def test_a_sheet_is_as_wide_as_its_longest_line() -> None:
    svg = drawing(extruded(shapely.box(0, 0, 20, 10), name="w" * 64), "a design")
    wide = float(ElementTree.fromstring(svg).attrib["viewBox"].split()[2])
    assert max(box.bounds[2] for box in boxes_of_texts(svg)) < wide


def test_edges_behind_a_plate_are_hidden() -> None:
    """A trapezium whose long side is in front: its corners behind are dashed in that view."""
    outline = [(0.0, 0.0), (30.0, 0.0), (20.0, 10.0), (5.0, 10.0)]
    solid = trimesh.creation.extrude_polygon(shapely.Polygon(outline), 2.0)
    (plate,) = plates([Shape("it", Role.SUPPORT, None, TriangleMesh(solid.vertices, solid.faces))])
    root = ElementTree.fromstring(drawing(plate, "it"))
    hidden = [
        each.attrib["d"] for each in root.iter(f"{SVG}path") if each.attrib["class"] == "hidden"
    ]
    assert len(hidden) == 2


def test_the_view_at_the_right_is_from_the_right() -> None:
    """The notch at the right of a plate is seen there, and one at the left is hidden."""
    for notch, expected in ((18, "edge"), (0, "hidden")):
        outline = shapely.box(0, 0, 20, 20).difference(shapely.box(notch, 5, notch + 2, 15))
        root = ElementTree.fromstring(drawing(extruded(outline), "it"))
        lines = [each.attrib for each in root.iter(f"{SVG}path") if "Z" not in each.attrib["d"]]
        found = {each["class"] for each in lines if each["class"] in ("edge", "hidden")
                 and each["d"].split()[2] == each["d"].split()[5]}  # fmt: skip
        assert found == {expected}


def test_which_parts_are_plates() -> None:
    mini = {each.name: each for each in plates(shapes(sensors.gelsight_mini_ideal()))}
    assert {name: each.thickness for name, each in mini.items()} == pytest.approx(
        {"tray": 1.0, "guide": 4.0}
    )
    svelte = {each.name: each for each in plates(shapes(sensors.gelsight_svelte(m1_grid=(20, 5))))}
    assert svelte["side-walls"].count == 2
    assert sorted(svelte["M2"].size) == pytest.approx([18.0, 18.1524], abs=1e-3), "tilted"
    boards = [each for each in plates(shapes(sensors.gelsight360())) if "boards" in each.name]
    assert [each.count for each in boards] == [4]

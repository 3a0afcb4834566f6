"""A section through a design against solids whose sections are known."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest

from optisense.design import SensorDesign
from optisense.design.section import cut, section
from optisense.design.section_drawing import section_svg
from optisense.geometry import Sphere, TriangleMesh
from optisense.sensors import SENSORS, load


def area(loop: np.ndarray) -> float:
    x, y = loop[:-1].T
    return 0.5 * abs(float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))))


def test_a_box_is_cut_into_a_closed_rectangle() -> None:
    (loop,) = cut(TriangleMesh.box((-1, -2, -3), (1, 2, 3)), np.zeros(3), np.array([0.0, 1, 0]))
    assert np.array_equal(loop[0], loop[-1])
    assert np.abs(loop[:, 1]).max() < 1e-9
    assert area(loop[:, [0, 2]]) == pytest.approx(2 * 6)


def test_a_slanted_cut_of_a_box_is_longer_by_the_slant() -> None:
    slant = np.array([0.0, np.cos(0.3), np.sin(0.3)])
    (loop,) = cut(TriangleMesh.box((-1, -2, -3), (1, 2, 3)), np.zeros(3), slant)
    # It leaves through the faces z = -3 and 3, and lies in the plane.
    assert np.abs(loop @ slant).max() < 1e-9
    assert area(loop[:, [0, 2]]) == pytest.approx(2 * 6)


def test_a_plane_through_vertices_and_faces_still_gives_one_loop() -> None:
    cube = TriangleMesh.box((0, 0, 0), (2, 2, 2), (2, 2, 2))
    loops = cut(cube, np.array([1.0, 1, 1]), np.array([0.0, 0, 1]))
    assert [area(loop[:, :2]) for loop in loops] == pytest.approx([4.0])


def test_an_open_mesh_gives_an_open_line() -> None:
    cap = Sphere(2.0).mesh(1.0)
    (line,) = cut(cap, np.zeros(3), np.array([1.0, 0, 0]))
    assert not np.array_equal(line[0], line[-1])
    assert np.linalg.norm(line - [0, 0, 2], axis=1) == pytest.approx(2.0, abs=2e-3)


def test_a_plane_beside_a_mesh_cuts_nothing() -> None:
    cube = TriangleMesh.box((0, 0, 0), (1, 1, 1))
    assert cut(cube, np.array([0.0, 0, 5]), np.array([0.0, 0, 1])) == []


def test_gelsight_mini_is_cut_along_its_longer_side() -> None:
    design = load("gelsight-mini-ideal")
    found = section(design)
    assert np.abs(found.across @ [1, 0, 0]) == pytest.approx(1.0)
    assert found.along @ design.camera.axes()[2] == pytest.approx(1.0)
    assert found.missed == []
    box = design.bounds()
    corners = np.concatenate([line for outline in found.outlines for line in outline.lines])
    assert np.ptp(corners[:, 0]) == pytest.approx(box[1, 0] - box[0, 0])
    # The camera looks at the part that is last along its view: the skin.
    skin = next(outline for outline in found.outlines if outline.name == "skin")
    assert skin.lines[0][:, 1].min() > found.camera[1]


@pytest.mark.parametrize("name", SENSORS.names())
def test_designs_show_themselves_with_all_labels(name: str) -> None:
    design = load(name)
    text = design._repr_html_()
    svg = re.search(r"<svg.*</svg>", text, re.DOTALL)
    assert svg
    drawn = ElementTree.fromstring(svg[0])
    texts = [each.text for each in drawn.iter() if each.tag.endswith("text")]
    found = section(design)
    for outline in found.outlines:
        assert outline.name.replace("_", " ") in texts
    for group in design.lights:
        assert f"{group} lights" in texts
    # Labels stand below each other, and inside the drawing.
    heights = [float(e.attrib["y"]) for e in drawn.iter() if e.tag.endswith("text")]
    assert max(heights) < float(drawn.attrib["height"])
    in_column = sorted(heights[:-1])
    assert min(np.diff(in_column)) > 10


def test_texts_of_a_design_stay_texts(design: SensorDesign) -> None:
    evil = design.copy()
    evil.name = "</svg><img src=x onerror=alert(1)>"
    assert "<img" not in evil._repr_html_()


def test_a_design_without_meshes_lists_its_parts(design: SensorDesign) -> None:
    bare = design.copy()
    bare.meshes.clear()
    assert all(name in bare._repr_html_() for name in bare.parts)


def test_lights_behind_one_another_show_all_their_colours() -> None:
    # In a Mini the red row lies behind the blue one, and the green one stands by itself.
    svg = section_svg(load("gelsight-mini-ideal"))
    drawn = list(ElementTree.fromstring(svg).iter())
    sectors = [
        e.attrib["fill"] for e in drawn if e.tag.endswith("path") and "A3.2" in e.attrib["d"]
    ]
    assert sorted(sectors) == ["rgb(0,0,255)"] * 5 + ["rgb(255,0,0)"] * 5
    dots = [e.attrib["fill"] for e in drawn if e.attrib.get("r") == "3.2"]
    assert sorted(dots) == ["none"] * 5 + ["rgb(0,255,0)"]

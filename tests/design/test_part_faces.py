"""Frosted and painted faces: which triangles they are, and what is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from optisense.design import SensorDesign, check_design, get_value, set_value
from optisense.design.part_faces import finished_faces
from optisense.design.parts import FaceFinish
from optisense.errors import DesignError
from optisense.geometry import TriangleMesh

BLOCK = TriangleMesh.box((0, 0, 0), (4, 3, 2), (4, 3, 2))


def chosen(**finish: Any) -> TriangleMesh:
    faces = finished_faces(BLOCK, FaceFinish(**{"roughness": 0.3, **finish}), "here", "there")
    return BLOCK.with_faces(BLOCK.faces[faces]).compacted()


def test_faces_are_named_by_the_way_that_they_look() -> None:
    side = chosen(direction=(2, 0, 0), within=10)
    assert side.area == pytest.approx(6.0)
    assert np.all(side.vertices[:, 0] == 4)


def test_a_box_names_a_part_of_a_side() -> None:
    assert chosen(box=((4, 0, 0), (4, 3, 1))).area == pytest.approx(3.0)
    assert chosen(direction=(1, 0, 0), box=((0, 0, 1), (4, 3, 2))).area == pytest.approx(3.0)


def test_a_face_that_is_not_there_is_told_with_what_is() -> None:
    with pytest.raises(DesignError, match=r"no faces here.*nearest face looks 45.0 degrees off"):
        chosen(direction=(1, 1, 0), within=20)
    with pytest.raises(DesignError, match=r"no faces here.*spans \(0, 0, 0\) to \(4, 3, 2\)"):
        chosen(box=((9, 9, 9), (10, 10, 10)))


def test_a_finish_is_addressed_by_its_name(design: SensorDesign) -> None:
    rougher = set_value(design, "parts.gel.faces.side.roughness", 0.5)
    assert get_value(rougher, "parts.gel.faces.side.roughness") == 0.5
    with pytest.raises(DesignError, match="Did you mean 'side'"):
        set_value(design, "parts.gel.faces.sied.roughness", 0.5)


def test_check_finds_faces_that_are_not_there(design: SensorDesign) -> None:
    turned = set_value(design, "parts.gel.faces.side.direction", (1, 1, 1))
    (problem,) = check_design(turned)
    assert "'side' of part 'gel'" in problem.message and "54.7 degrees" in str(problem.hint)


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        (
            "parts.skin.faces",
            {"a": {"direction": (0, 0, 1), "paint": "black"}},
            "has the coating",
        ),
        ("parts.wall.faces", {"a": {"direction": (0, 0, 1), "roughness": 0.1}}, "no transparent"),
        ("parts.gel.faces.end.paint", "blakc", "Did you mean 'black'"),
        ("parts.gel.faces.end.paint", "gel", "no paint: it is a dielectric"),
        ("parts.gel.faces.end.roughness", 0.1, "either a roughness or a paint"),
        ("parts.gel.faces.side.roughness", -0.1, "greater than or equal to 0"),
        ("parts.gel.faces.end", {"paint": "black"}, "does not say which faces"),
        ("parts.gel.faces.side.box", ((5, 4, 0), (5, -4, -2)), "Swap the corners"),
        ("parts.gel.faces.end.direction", (0, 0, 0), "zero vector"),
        ("parts.gel.faces.end.within", 0, "greater than 0"),
    ],
)
def test_what_can_not_be_is_refused(
    design: SensorDesign, path: str, value: object, message: str
) -> None:
    with pytest.raises(DesignError, match=message):
        set_value(design, path, value)

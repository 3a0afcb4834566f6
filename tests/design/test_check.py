"""Problems of a design that are found without rendering it."""

from __future__ import annotations

import re
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from optisense.design import Diagnostic, SensorDesign, check_design, set_value
from optisense.design.arrangement import may_overlap
from optisense.design.cage_checks import _overlap
from optisense.design.camera_checks import view_shares
from optisense.errors import DesignError, MeshError
from optisense.geometry import TriangleMesh
from optisense.search.space.constraints import NoCrossings

LIGHTS = ["smd-3528", "generic-spot"]


def only(problems: list[Diagnostic], severity: str = "error") -> Diagnostic:
    found = [problem for problem in problems if problem.severity == severity]
    assert len(found) == 1, found
    return found[0]


def test_a_good_design_has_no_problems(design: SensorDesign) -> None:
    assert check_design(design, LIGHTS) == []


def turned(mesh: TriangleMesh, count: int) -> TriangleMesh:
    """The mesh with its first faces turned over."""
    return mesh.with_faces(np.concatenate([mesh.faces[:count, ::-1], mesh.faces[count:]]))


def broken(mesh: TriangleMesh) -> TriangleMesh:
    """The mesh with a coordinate that is not a number."""
    return mesh.with_vertices(np.where(np.arange(3 * len(mesh.vertices)).reshape(-1, 3), 1, np.nan))


MESHES: dict[str, tuple[str, Callable[[TriangleMesh], TriangleMesh], str]] = {
    "part 'gel': the solid is not closed": ("gel", lambda m: m.with_faces(m.faces[1:]), "error"),
    "part 'wall': 1 vertices are not finite": ("wall", broken, "error"),
    "looks like metres": ("wall", lambda m: m.transformed(1e-3 * np.eye(3)), "error"),
    "faces outward:": ("skin", TriangleMesh.flipped, "error"),
    "faces outward on 25 %": ("skin", lambda m: turned(m, len(m.faces) // 4), "warning"),
}
"""Meshes that are told, by a part of the message: the part, the change, and the severity."""


@pytest.mark.parametrize("message", MESHES)
def test_meshes_that_cannot_be(design: SensorDesign, message: str) -> None:
    part, change, severity = MESHES[message]
    design.meshes[part] = change(design.meshes[part])
    assert message in only(check_design(design), severity).message


def test_a_missing_mesh(design: SensorDesign) -> None:
    del design.meshes["wall"]
    assert "'wall' has no mesh" in only(check_design(design)).message


def test_a_sensing_surface_away_from_the_gel(design: SensorDesign) -> None:
    skin = design.meshes["skin"]
    design.meshes["skin"] = skin.with_vertices(skin.vertices + [0, 0, 3])
    del design.cages["skin"]
    assert "does not lie on" in only(check_design(design), "warning").message


@pytest.mark.parametrize(
    ("path", "value", "told"),
    [
        ("lights.red.model", "smd3528", "'smd3528'.*smd-3528"),
        ("lights.red.lights[0].position.x", 30_000, "millimetres"),
        ("cages.skin.points[3].z", 1e11, "control point"),
        ("cages.skin.box[1].x", 4.0, "cage 'skin', part 'skin'"),
    ],
)
def test_values_that_cannot_be(design: SensorDesign, path: str, value: object, told: str) -> None:
    assert re.search(told, str(only(check_design(set_value(design, path, value), LIGHTS))))


EDITS: dict[str, Callable[[Any], object]] = {
    "unknown material 'nope'": lambda design: setattr(design.parts["gel"], "material", "nope"),
    "unknown part 'nope'": lambda design: design.cages["skin"].parts.append("nope"),
    "unknown part 'gel'": lambda design: design.parts.pop("gel"),
    "is made of an unknown material": lambda design: design.materials.clear(),
    "letters, digits": lambda design: design.parts.update({"ü b": design.parts["gel"]}),
    "points has 7 entries": lambda design: design.cages["skin"].points.pop(),
    "lights[1]": lambda design: design.lights["red"].lights.append("x"),
    "wrong type": lambda design: design.lights["red"].lights.append(object()),
}
"""Edits inside lists and sections that make a design invalid, by a part of the message."""


@pytest.mark.parametrize("message", EDITS)
def test_edits_inside_sections_are_told_alike_by_all(design: SensorDesign, message: str) -> None:
    EDITS[message](design)
    assert any(message in problem.message for problem in check_design(design))
    for use in (SensorDesign.copy, lambda given: set_value(given, "camera.fov", 30.0)):
        with pytest.raises(DesignError, match=re.escape(message)):
            use(design)


def test_an_object_that_is_no_mesh(design: SensorDesign) -> None:
    design.meshes["gel"] = SimpleNamespace(vertices=(), faces=())  # type: ignore[assignment]
    problem = only(check_design(design))
    assert "SimpleNamespace" in problem.message and "TriangleMesh(" in str(problem.hint)
    with pytest.raises(DesignError, match="SimpleNamespace"):
        design.deformed_meshes()


@pytest.mark.parametrize("faces", [[], [[0, 1, 2]]])
def test_a_mesh_without_vertices(design: SensorDesign, faces: list[list[int]]) -> None:
    design.meshes["gel"] = TriangleMesh([], faces)
    assert "part 'gel'" in only(check_design(design)).message
    with pytest.raises(MeshError, match="part 'gel'"):
        design.deformed_meshes()


@pytest.mark.parametrize("path", ["lights.red.lights[0].position", "camera.position"])
def test_lights_and_camera_inside_a_blocker(design: SensorDesign, path: str) -> None:
    problem = only(check_design(set_value(design, path, [-17, 0, -10])))
    assert "inside the opaque part 'wall'" in problem.message and path == problem.where


def test_a_light_in_the_gel_is_fine(design: SensorDesign) -> None:
    embedded = set_value(design, "lights.red.lights[0].position", [0, 0, -1])
    assert check_design(embedded, LIGHTS) == []


def test_darkness_and_idle_provenance_are_warnings(design: SensorDesign) -> None:
    for name in design.lights:
        design.lights[name].flux = 0.0
    design.provenance["parts.gell"] = design.provenance.pop("parts.gel")
    problems = check_design(design)
    assert {problem.severity for problem in problems} == {"warning"}
    assert [("black" in p.message, "parts.gell" in p.message) for p in problems] == [
        (True, False),
        (False, True),
    ]


def with_plate(design: SensorDesign, bottom: float, priority: int, ior: float) -> SensorDesign:
    """The design with a plate of glass under, or in, the gel, which reaches down to z = -2."""
    data = design.model_dump(mode="json")
    data["parts"]["plate"] = {
        "role": "support", "mesh": "meshes/plate.obj", "material": "glass", "priority": priority,
    }  # fmt: skip
    data["materials"]["glass"] = {"kind": "dielectric", "ior": ior}
    made = SensorDesign.model_validate(data)
    made.meshes.update(design.meshes)
    made.meshes["plate"] = TriangleMesh.box((-4, -3, bottom), (4, 3, bottom + 1.0), (3, 3, 1))
    for name, group in made.lights.items():
        if group.emitter is not None and group.emitter.kind == "ies":
            group.emitter._folder = design.lights[name].emitter._folder  # type: ignore[union-attr]
    return made


class TestOverlaps:
    def test_solids_of_one_priority_may_not_share_space(self, design: SensorDesign) -> None:
        gel = design.parts["gel"].priority
        problem = only(check_design(with_plate(design, -2.5, gel, 1.49)))
        assert "'gel' and 'plate' overlap near (0.00, 0.00, -1.75) mm" in problem.message
        assert problem.where == "parts.plate.priority" and "larger priority" in str(problem.hint)

    @pytest.mark.parametrize(
        ("bottom", "more", "ior"),
        [(-2.5, 1, 1.49), (-2.5, 0, 1.41), (-3.0, 0, 1.49), (-2.999, 0, 1.49)],
    )
    def test_a_priority_one_medium_and_a_touch_are_fine(
        self, design: SensorDesign, bottom: float, more: int, ior: float
    ) -> None:
        priority = design.parts["gel"].priority + more
        assert check_design(with_plate(design, bottom, priority, ior)) == []

    def test_searches_and_cages_know_the_same_medium(self, design: SensorDesign) -> None:
        gel = design.parts["gel"].priority
        start = with_plate(design, -3.5, gel, 1.41)
        moved = with_plate(design, -2.5, gel, 1.41)
        assert may_overlap(moved, "gel", "plate") and NoCrossings(start).meeting(moved) is None
        tinted = set_value(moved, "materials.glass.absorption", [0.1, 0.1, 0.1])
        assert not may_overlap(tinted, "gel", "plate")
        crossing = NoCrossings(start).meeting(tinted)
        assert crossing is not None and {crossing.one, crossing.other} == {"gel", "plate"}
        assert [_overlap(each, "gel", "plate") for each in (moved, tinted)] == ["yes", "no"]

    def test_a_film_of_air_beside_a_contact(self, design: SensorDesign) -> None:
        """A vertex of a common face is off it; a gap all over is intended."""
        apart = with_plate(design, -3.02, 0, 1.49)
        assert check_design(apart) == []
        for drop, films in ((0.02, 1), (0.001, 0)):
            sunk = with_plate(design, -3.0, 0, 1.49)
            vertices = sunk.meshes["plate"].vertices.copy()
            inner = np.argmin(np.linalg.norm(vertices - (1.3, 1.0, -2.0), axis=1))
            vertices[inner, 2] -= drop
            sunk.meshes["plate"] = sunk.meshes["plate"].with_vertices(vertices)
            found = [problem.message for problem in check_design(sunk)]
            assert len(found) == films
            assert all("'gel' and 'plate' touch, but leave a film of air" in f for f in found)
            hollow = set_value(sunk, "materials.glass.ior", 1.0)
            assert not [each for each in check_design(hollow) if "film" in each.message], "a gas"

    def test_a_solid_wholly_inside_another(self, design: SensorDesign) -> None:
        gel = design.parts["gel"].priority
        assert "overlap" in only(check_design(with_plate(design, -1.5, gel, 1.49))).message


class TestView:
    @pytest.fixture
    def plain(self, design: SensorDesign) -> SensorDesign:
        """The design has no mirror and a narrow lens."""
        data = design.model_dump(mode="json")
        del data["parts"]["mirror"], data["cages"]["mirror"]
        data["camera"] |= {"projection": "perspective", "fov": 20.0}
        del data["camera"]["distortion"], data["camera"]["blur"]
        made = SensorDesign.model_validate(data)
        made.meshes.update({n: m for n, m in design.meshes.items() if n != "mirror"})
        made.lights["own-ies"].emitter._folder = design.lights["own-ies"].emitter._folder  # type: ignore[union-attr]
        return made

    @pytest.mark.parametrize(
        ("direction", "seen"),
        [
            ([0, 0, 1], True),
            ([0.05, 0, 1], True),
            ([0, 0, -1], False),
            ([1, 0, 1], False),
            ([0, 1, 0.3], False),
        ],
    )
    def test_a_camera_that_looks_elsewhere(
        self, plain: SensorDesign, direction: list[float], seen: bool
    ) -> None:
        problems = check_design(set_value(plain, "camera.direction", direction))
        if seen:
            assert problems == []
        else:
            problem = only(problems, "warning")
            assert "not in the camera's field of view" in problem.message
            assert problem.where == "camera.direction"

    def test_a_surface_whose_corners_are_all_out_of_the_picture_is_seen(
        self, plain: SensorDesign
    ) -> None:
        plain.meshes["skin"] = TriangleMesh.grid((6, 5), (1, 1)).flipped()
        assert check_design(set_value(plain, "camera.position", [0, 0, -10])) == []

    @pytest.mark.parametrize("divisions", [1, 50])
    def test_the_share_in_the_picture_is_that_of_the_area(
        self, plain: SensorDesign, divisions: int
    ) -> None:
        plain.meshes["skin"] = TriangleMesh.grid((8, 7), (divisions, divisions)).flipped()
        design = set_value(plain, "camera.position", [0, 0, -10])
        shares = view_shares(design, design.meshes)
        half = 10.0 * np.tan(np.radians(design.camera.fov / 2.0))
        width, height = design.camera.resolution
        assert shares is not None
        assert shares.skin == pytest.approx(4 * half**2 * height / width / 56.0, abs=0.015)
        assert (
            "of the sensing surface is in the picture"
            in only(check_design(design), "warning").message
        )

    def test_a_blocker_that_hides_the_skin_is_named(self, plain: SensorDesign) -> None:
        plain.meshes["skin"] = TriangleMesh.grid((6, 5), (1, 1)).flipped()
        screen = TriangleMesh.grid((30, 30), (1, 1))
        plain.meshes["wall"] = screen.with_vertices(screen.vertices + [14.5, 0, -5])
        design = set_value(plain, "camera.position", [0, 0, -10])
        problem = only(check_design(design), "warning")
        shares = view_shares(design, design.meshes)
        assert shares is not None
        # The screen begins 0.5 mm left of the axis, half way to the skin, so it hides x > -1 mm.
        width = 2 * 10.0 * np.tan(np.radians(design.camera.fov / 2.0))
        assert shares.hidden["wall"] == pytest.approx(
            shares.skin * (width / 2 + 1.0) / (width / 2 - 1.0), rel=0.1
        )
        assert problem.message.startswith("part 'wall' (blocker) hides 2")
        assert problem.where == "parts.wall.role" and "its role is support" in str(problem.hint)

    def test_a_fisheye_sees_what_is_beside_it(self, plain: SensorDesign) -> None:
        wide = set_value(plain, "camera.projection", "equidistant")
        wide = set_value(set_value(wide, "camera.fov", 240.0), "camera.direction", [1, 0, 0])
        assert "fills 2 % of the picture" in only(check_design(wide), "warning").message
        narrow = set_value(wide, "camera.fov", 100.0)
        assert "not in the camera" in only(check_design(narrow), "warning").message

    def test_a_surface_that_is_a_spot_in_the_picture(self, plain: SensorDesign) -> None:
        far = set_value(plain, "camera.position", [0, 0, -300])
        problem = only(check_design(far), "warning")
        assert "fills 0 % of the picture" in problem.message

    def test_the_outside_of_the_coating_is_not_seen(self, plain: SensorDesign) -> None:
        plain.meshes["skin"] = TriangleMesh.grid((6, 5), (1, 1)).flipped()
        above = set_value(
            set_value(plain, "camera.position", [0, 0, 20]), "camera.direction", [0, 0, -1]
        )
        shares = view_shares(above, above.meshes)
        assert shares is not None and shares.skin == 0.0 and shares.picture == 0.0
        assert "the outside of the coating on 100 %" in only(check_design(above), "warning").message

    @pytest.mark.parametrize("distance", [9.0, 15.0, 19.0])
    def test_the_share_of_the_picture_that_a_rectangle_fills(
        self, plain: SensorDesign, distance: float
    ) -> None:
        plain.meshes["skin"] = TriangleMesh.grid((6, 5), (1, 1)).flipped()
        design = set_value(plain, "camera.position", [0, 0, -distance])
        shares = view_shares(design, design.meshes)
        width = 2.0 * distance * np.tan(np.radians(design.camera.fov / 2.0))
        height = width * design.camera.resolution[1] / design.camera.resolution[0]
        assert shares is not None
        assert shares.picture == pytest.approx(
            min(6.0 / width, 1.0) * min(5.0 / height, 1.0), abs=0.02
        )

    def test_a_spot_of_the_surface(self, plain: SensorDesign) -> None:
        plain.meshes["skin"] = TriangleMesh.grid((10, 8), (100, 80)).flipped()
        near = set_value(plain, "camera.position", [0, 0, -6])
        warnings = [p for p in check_design(near) if "in the picture" in p.message]
        # 20 degrees from 6 mm: 2.12 mm by 1.59 mm of 10 mm by 8 mm, and a little more where the
        # cage bends the surface away.
        assert [p.message[:3] in ("4 %", "5 %") for p in warnings] == [True]

    def test_mirrors_may_show_it(self, design: SensorDesign) -> None:
        away = set_value(design, "camera.direction", [0, 0, -1])
        assert check_design(set_value(away, "camera.fov", 20.0)) == []

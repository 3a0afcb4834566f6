"""What cages do to whole designs, and editing them."""

from __future__ import annotations

import numpy as np
import pytest

from optisense import sensors
from optisense.design import (
    Part,
    Role,
    SensorDesign,
    add_cage,
    cage_problems,
    check_design,
    move_points,
    refine_cage,
    remove_cage,
    set_range,
    set_value,
    settle_cage,
)
from optisense.design.cage_edit import select_points
from optisense.errors import DesignError
from optisense.geometry import TriangleMesh


@pytest.fixture(scope="module")
def svelte() -> SensorDesign:
    return sensors.gelsight_svelte()


def shape(design: SensorDesign, part: str) -> np.ndarray:
    return design.deformed_meshes()[part].vertices


class TestChecks:
    def test_lights_that_a_part_leaves_behind_are_told(self, mini: SensorDesign) -> None:
        """The green lights are 0.2 mm beside the guide, and 3 mm from a wall."""
        walled = mini.model_copy(deep=True)
        walled.parts["wall"] = Part(role=Role.BLOCKER, mesh="wall.obj")
        walled.meshes["wall"] = TriangleMesh.box((-17, -9, -9), (-16, 9, -6))
        caged = add_cage(walled, "g", ["guide", "wall"], (2, 2, 2))
        for way, parts in ((0.5, ""), (2.0, "guide"), (6.0, "guide, wall")):
            moved = move_points(caged, "g", {"*,*,*": (way, 0.0, 0.0)})
            said = [each.message for each in check_design(moved) if "'green' stay" in each.message]
            assert len(said) == bool(parts) and all(each.endswith(f": {parts}") for each in said)
            assert all(each.startswith("5 of 5 lights") for each in said)

    def test_built_in_bends_are_fine(self) -> None:
        for build in (
            sensors.gelsight_mini_ideal_cylindrical,
            sensors.gelsight_mini_ideal_spherical,
        ):
            assert cage_problems(build()) == []

    def test_the_whole_range_of_sveltes_mirror_is_fine(self, svelte: SensorDesign) -> None:
        rng = np.random.default_rng(1)
        names = ("x", "y", "z")
        for blend in (0.0, 0.5, 1.0, *rng.uniform(size=(3, 27, 3))):
            value = blend
            if isinstance(blend, np.ndarray):
                value = [dict(zip(names, row, strict=True)) for row in blend.tolist()]
            problems = cage_problems(set_value(svelte, "cages.M1.blend", value))
            assert not [p for p in problems if "through" in p.message or "inside" in p.message]

    @pytest.mark.parametrize(("caged", "other"), [("skin", "gel"), ("gel", "skin")])
    def test_skin_or_gel_caged_alone_is_told_before_they_are_torn_apart(
        self, mini: SensorDesign, caged: str, other: str
    ) -> None:
        bare = remove_cage(mini, "skin")
        alone = add_cage(bare, "half", [caged], margin=0.5)
        (problem,) = check_design(alone)
        assert problem.severity == "warning" and problem.where == "cages.half.parts"
        assert f"'{caged}'" in problem.message and f"'{other}'" in problem.message
        assert problem.hint == f"Put '{other}' into the cage too"
        height = alone.cages["half"].points[14].z
        bent = set_value(alone, "cages.half.points[14].z", height + 1.0)
        torn = [each for each in check_design(bent) if f"'{other}'" in each.message]
        assert torn and all("tears" not in each.message for each in torn), "told once, as it is"
        assert any(f"put '{other}' into the cage too" in str(each).lower() for each in torn)
        for parts in (["skin", "gel"], ["guide"]):
            assert check_design(add_cage(bare, "whole", parts)) == []

    def test_a_part_whose_triangles_are_too_large_to_bend(self, mini: SensorDesign) -> None:
        """Only the corners of the guide are vertices: raising the middle of its face by 4 mm,
        which is to lift that face by 1 mm there, lifts nothing."""
        caged = add_cage(mini, "plate", ["guide"], resolution=(3, 3, 2), margin=0.0)
        assert cage_problems(caged) == []
        raised = move_points(caged, "plate", {"1,1,0": (0.0, 0.0, 4.0)})
        assert np.array_equal(shape(raised, "guide"), shape(caged, "guide"))
        coarse = [p for p in cage_problems(raised) if "too large triangles" in p.message]
        assert [p.severity for p in coarse] == ["warning"]
        assert "'guide'" in coarse[0].message and "1 mm off" in coarse[0].message
        assert "Subdivide in Blender" in str(coarse[0].hint)
        assert "(0.00, 0.00, -8.25)" in coarse[0].message  # 1 mm above the guide's lower face
        slight = move_points(caged, "plate", {"1,1,0": (0.0, 0.0, 0.3)})
        assert cage_problems(slight) == []

    def test_a_mirror_pushed_into_the_skin(self, svelte: SensorDesign) -> None:
        pushed = move_points(settle_cage(svelte, "M1"), "M1", {"*,*,2": (12.0, 0.0, 0.0)})
        problems = cage_problems(pushed)
        gel = next(p for p in problems if "into part 'gel'" in p.message)
        assert gel.severity == "error" and gel.where == "cages.M1.points"
        assert ",2)" in str(gel.hint)  # a control point at the tip moves that place
        assert any("into part 'gel'" in p.message for p in check_design(pushed))

    def test_a_gel_turned_inside_out(self, mini: SensorDesign) -> None:
        problem = cage_problems(move_points(mini, "skin", {"1,1,2": (0.0, 0.0, -12.0)}))[0]
        assert "'gel' is turned inside out" in problem.message
        assert "control point 14 (1,1,2)" in str(problem.hint)

    def test_a_gel_lifted_off_its_tray(self, mini: SensorDesign) -> None:
        lifted = cage_problems(move_points(mini, "skin", {"1,1,0": (0.0, 0.0, 2.0)}))
        assert [p.severity for p in lifted] == ["warning"]
        # The middle of the gel's bottom, at -4.25 mm, follows by 1/2 * 1/2 of the 2 mm.
        assert "has come off part 'tray'" in lifted[0].message and "-3.75" in lifted[0].message
        assert "let its mesh reach into 'tray'" in str(lifted[0].hint)

    def test_a_gel_pushed_into_its_tray(self, mini: SensorDesign) -> None:
        """The gel has the larger priority, so the tray gives way: odd, but it can be simulated."""
        pushed = move_points(mini, "skin", {"1,1,0": (0.0, 0.0, -2.0)})
        assert [p.severity for p in cage_problems(pushed)] == ["warning"]
        assert "is pushed into part 'tray'" in cage_problems(pushed)[0].message
        equal = set_value(pushed, "parts.gel.priority", 0)
        assert [p.severity for p in cage_problems(equal)] == ["error"]

    @pytest.mark.parametrize("up", [2.0, -2.0])
    def test_a_gel_that_reaches_into_its_core_bends_alone(
        self, mini: SensorDesign, up: float
    ) -> None:
        """Gel and core share space but no face of one crosses the other; the ends of both are in
        one plane, in which vertices of the gel move off those of the core."""
        bare = set_value(remove_cage(mini, "skin"), "parts.tray.priority", 2)
        del bare.meshes["skin"], bare.meshes["guide"]
        bare.meshes["gel"] = TriangleMesh.box((-10.0, -8.0, -4.25), (10.0, 8.0, 0.0), (10, 8, 8))
        bare.meshes["tray"] = TriangleMesh.box((-10.0, -4.0, -4.25), (10.0, 4.0, -2.0))
        caged = add_cage(bare, "bend", ["gel"])
        assert cage_problems(move_points(caged, "bend", {"*,*,2": (0.0, 0.0, up)})) == []
        bare.meshes["tray"] = TriangleMesh.box((-10.0, -4.0, -5.25), (10.0, 4.0, -4.25))
        off = move_points(add_cage(bare, "bend", ["gel"]), "bend", {"1,*,0": (0.0, 0.0, up)})
        assert len(cage_problems(off)) == 1

    def test_parts_in_one_cage_go_together(self, mini: SensorDesign) -> None:
        bare = remove_cage(mini, "skin")
        both = add_cage(bare, "stack", ["skin", "gel", "tray", "guide"])
        problems = cage_problems(move_points(both, "stack", {"1,*,*": (0.0, 0.0, 1.0)}))
        # The plates have vertices at their corners only and stay flat, which is told.
        assert [p.message.split("'")[1] for p in problems] == ["tray", "guide"]
        assert all("too large triangles" in p.message for p in problems)
        alone = add_cage(bare, "skin", ["skin"])
        problems = cage_problems(move_points(alone, "skin", {"1,1,*": (0.0, 0.0, 1.0)}))
        assert "part 'gel'" in problems[0].message


class TestEditing:
    def test_a_new_cage_changes_no_shape(self, svelte: SensorDesign) -> None:
        caged = add_cage(svelte, "finger", ["skin", "gel"], (4, 2, 6), margin=1.0)
        np.testing.assert_allclose(shape(caged, "gel"), shape(svelte, "gel"), atol=1e-10)
        assert "finger" not in svelte.cages
        flat = add_cage(svelte, "plate", ["body"]) if "body" in svelte.parts else svelte
        assert cage_problems(flat) == cage_problems(svelte)

    def test_the_row_of_the_papers_cylinder(self, mini: SensorDesign) -> None:
        moved = move_points(mini, "skin", {"1,*,2": (0.0, 0.0, 6.0)})
        expected = shape(sensors.gelsight_mini_ideal_cylindrical(), "skin")
        np.testing.assert_allclose(shape(moved, "skin"), expected, atol=1e-12)

    def test_refining_and_settling_keep_the_shape(self, svelte: SensorDesign) -> None:
        for changed in (
            refine_cage(svelte, "M1", np.array([5, 4, 7])),
            settle_cage(svelte, "M1"),
            refine_cage(settle_cage(svelte, "M1"), "M1", (4, 3, 3)),
        ):
            np.testing.assert_allclose(shape(changed, "M1"), shape(svelte, "M1"), atol=1e-10)

    def test_a_range_reaches_both_ends(self, mini: SensorDesign) -> None:
        bent = sensors.gelsight_mini_ideal_cylindrical()
        rest = mini.cages["skin"].current_points()
        ranged = set_range(bent, "skin", c_min=rest)
        for blend, expected in ((0.0, mini), (1.0, bent)):
            at = set_value(ranged, "cages.skin.blend", blend)
            np.testing.assert_allclose(shape(at, "skin"), shape(expected, "skin"), atol=1e-12)

    def test_which_points_are_meant(self) -> None:
        assert select_points((3, 3, 3), "13") == [13]
        assert select_points((3, 4, 5), "1,2,3") == [(1 * 4 + 2) * 5 + 3]
        assert select_points((3, 3, 3), "1, *, 2") == [11, 14, 17]
        assert select_points((2, 3, 4), "*,*,*") == list(range(24))
        for wrong in ("27", "3,0,0", "1,1", "a", "", "-1"):
            with pytest.raises(DesignError, match="no control point"):
                select_points((3, 3, 3), wrong)

    def test_what_cannot_be_edited_says_why(self, svelte: SensorDesign) -> None:
        settled = settle_cage(svelte, "M1")
        for edit, message in (
            (lambda: add_cage(svelte, "M1", ["M2"]), "already"),
            (lambda: add_cage(svelte, "new", ["M1"]), "two cages"),
            (lambda: add_cage(svelte, "new", ["M3"]), "no part 'M3'"),
            (lambda: add_cage(svelte, "new", []), "needs a part"),
            (lambda: add_cage(svelte, "new", ["M2"], (1, 3, 3)), "1 x 3 x 3"),
            (lambda: refine_cage(svelte, "M1", (2, 3, 3)), "fewer"),
            (lambda: refine_cage(svelte, "M1", (10**4,) * 3), "can't have 10000 x"),
            (lambda: remove_cage(svelte, "M"), "no cage 'M'"),
            (lambda: move_points(svelte, "M1", {"0": (1, 0, 0)}), "is a blend"),
            (lambda: set_range(svelte, "M1", c_min=np.zeros((8, 3))), "8 entries"),
            (lambda: add_cage(svelte, "new", "M2"), "list of names"),
            (lambda: add_cage(svelte, "new", ["M2"], margin=-1.0), "margin of a cage is -1"),
            (lambda: add_cage(svelte, "new", ["M2"], margin=np.nan), "margin of a cage is nan"),
            (lambda: refine_cage(svelte, "M1", "5x5x3"), "not three integers"),
            (lambda: set_range(svelte, "M1", c_max=np.full((27, 3), np.nan)), "finite control"),
            (lambda: set_range(svelte, "M1", c_max=np.zeros((3, 3, 9))), "finite control"),
            (lambda: set_range(svelte, "M1", blend=np.zeros((27, 3))), "no number"),
            (lambda: move_points(settled, "M1", {(1, 1, 1): (1, 0, 0)}), "no control point"),
            (lambda: move_points(settled, "M1", {"0": "1,0,0"}), "can't be moved by 1,0,0"),
            (lambda: move_points(settled, "M1", {"0": (1e300, 0, 0)}), "should be less"),
            (lambda: move_points(settled, "M1", {"0": (1, 0, 0)}, "max"), "has no 'max'"),
        ):
            with pytest.raises(DesignError, match=message):
                edit()

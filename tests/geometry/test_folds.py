"""Folded, collapsed and self-crossing meshes, and parts that meet."""

from __future__ import annotations

import numpy as np
import pytest

from optisense.geometry import TriangleMesh, cage_points, folds
from optisense.geometry.cage import deformed
from optisense.geometry.crossings import Crossings, self_crossings
from optisense.geometry.folds import Fold, find_fold, is_in_full_view
from optisense.geometry.overlaps import find_overlap, near_surface, touching_vertices

BOX = np.array([[-5.0, -4.0, -1.0], [5.0, 4.0, 1.0]])
LATTICE = (3, 3, 3)


def solid() -> TriangleMesh:
    return TriangleMesh.box(BOX[0], BOX[1], (10, 8, 4))


def sheet(rise: float = 0.0) -> TriangleMesh:
    return TriangleMesh.grid((10.0, 8.0), (20, 16), rise)


def fold_of(mesh: TriangleMesh, points: np.ndarray) -> Fold | None:
    flat = points.reshape(-1, 3)
    return find_fold(mesh, deformed(mesh, BOX, LATTICE, flat), BOX, LATTICE, flat)


def at_rest() -> np.ndarray:
    return cage_points(BOX, LATTICE).reshape(3, 3, 3, 3)


@pytest.mark.parametrize("mesh", [solid(), sheet()])
def test_moderate_bends_are_no_folds(mesh: TriangleMesh) -> None:
    rng = np.random.default_rng(1)
    for _ in range(5):
        assert fold_of(mesh, at_rest() + rng.normal(scale=0.2, size=(3, 3, 3, 3))) is None


def test_a_top_pushed_through_the_bottom_is_inside_out() -> None:
    points = at_rest()
    points[1, 1, 2, 2] -= 20.0
    fold = fold_of(solid(), points)
    assert fold is not None and fold.kind == "inside out"
    assert np.linalg.norm(fold.place[:2]) < 1.0 and fold.affected > 10


def test_a_squeezed_solid_has_collapsed() -> None:
    points = at_rest()
    points[..., 0] = 0.0
    fold = fold_of(solid(), points)
    assert fold is not None and fold.kind == "collapsed"


def test_a_sheet_flattened_across_its_normal_is_still_a_fair_sheet() -> None:
    """The cage collapses space, yet a mirror in it is only made flat."""
    points = at_rest()
    points[..., 2] = 0.0
    assert fold_of(sheet(0.5), points) is None


def test_a_mirrored_sheet_looks_to_the_wrong_side_and_a_turned_one_does_not() -> None:
    points = at_rest()
    mirrored = points * [-1.0, 1.0, 1.0]
    fold = fold_of(sheet(0.5), mirrored)
    assert fold is not None and fold.kind == "inside out"
    assert fold_of(sheet(0.5), points * [-1.0, 1.0, -1.0]) is None  # half a turn about y
    assert fold_of(sheet(0.5), points * [1.0, 1.0, -1.0]) is None  # bowed the other way


def fold_of_a_loop(mesh: TriangleMesh) -> Fold | None:
    """Bend a mesh into a loop like a ribbon's: each vertex is fine, the whole is not.

    With four points along x the middle line is a cubic curve, which can cross itself; of three
    points it would be a parabola, which can't.
    """
    lattice = (4, 3, 3)
    points = cage_points(BOX, lattice).reshape(4, 3, 3, 3)
    points[1, :, :, 0], points[2, :, :, 0] = 15.0, -15.0
    points[1:3, :, :, 2] += 20.0
    flat = points.reshape(-1, 3)
    return find_fold(mesh, deformed(mesh, BOX, lattice, flat), BOX, lattice, flat)


def test_a_sheet_rolled_through_itself_is_found() -> None:
    fold = fold_of_a_loop(sheet())
    assert fold is not None and fold.kind == "through itself"
    assert abs(fold.place[0]) < 0.5  # the loop closes in its plane of symmetry


def test_a_mesh_that_cuts_through_itself_at_rest_is_searched_once_there(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    flat = sheet().vertices
    tilted = sheet().with_vertices(0.9 * flat + 0.2 * flat[:, [2, 2, 1]] + [0.0, 0.0, 0.03])
    searched: list[int | None] = []

    def counted(mesh: TriangleMesh, limit: int | None = None) -> Crossings:
        searched.append(limit)
        return self_crossings(mesh, limit)

    monkeypatch.setattr(folds, "self_crossings", counted)
    entangled, sound = TriangleMesh.joined([sheet(), tilted]), sheet()
    for _ in range(2):
        assert fold_of_a_loop(entangled) is None
        assert fold_of_a_loop(sound) is not None
    assert searched.count(1) == 2


def test_full_view() -> None:
    flat = sheet()
    x = flat.vertices[:, 0]
    dome = flat.with_vertices(flat.vertices + np.column_stack([0 * x, 0 * x, 0.1 * x * x]))
    assert is_in_full_view(flat, flat) and is_in_full_view(flat, dome)
    turn = 0.7 * x  # a roll of 2 x 3.5 radians
    roll = np.column_stack([np.sin(turn) / 0.7, flat.vertices[:, 1], np.cos(turn) / 0.7])
    assert not is_in_full_view(flat, flat.with_vertices(roll))
    assert not is_in_full_view(solid(), solid())
    holed = flat.with_faces(flat.faces[np.arange(len(flat.faces)) != 200])
    assert not is_in_full_view(holed, holed)


class TestMeeting:
    block = TriangleMesh.box((0, 0, 0), (4, 4, 4), (3, 3, 3))

    @pytest.mark.parametrize("shift", [(3.0, 1.3, 1.7), (0.5, 3.9, 0.3)])
    def test_overlapping_boxes(self, shift: tuple[float, float, float]) -> None:
        other = TriangleMesh(self.block.vertices + shift, self.block.faces)
        meeting = find_overlap(self.block, other)
        assert meeting is not None and meeting.kind == "cuts into"
        low, high = np.array(shift), np.full(3, 4.0)
        assert ((meeting.place >= low - 1e-9) & (meeting.place <= high + 1e-9)).all()

    def test_touching_and_separate_boxes_do_not_meet(self) -> None:
        for shift in ((4.0, 0, 0), (4.0, 1.3, 2.0), (4.0005, 0, 0), (9.0, 0, 0), (3.999, 0, 0)):
            other = TriangleMesh(self.block.vertices + shift, self.block.faces)
            assert find_overlap(self.block, other) is None, shift

    def test_one_in_the_other(self) -> None:
        small = TriangleMesh.box((1, 1, 1), (2, 2, 2))
        inner, outer = find_overlap(small, self.block), find_overlap(self.block, small)
        assert inner is not None and inner.kind == "is inside"
        assert outer is not None and outer.kind == "encloses"

    def test_resting_on_another_whatever_its_triangles(self) -> None:
        table = TriangleMesh.box((-10, -10, -1), (10, 10, 0))
        rows = touching_vertices(self.block, table)
        assert set(rows) == set(np.flatnonzero(self.block.vertices[:, 2] == 0.0))
        lifted = self.block.with_vertices(self.block.vertices + [0, 0, 0.01])
        assert np.isinf(near_surface(lifted.vertices[rows], table)).all()
        slid = self.block.with_vertices(self.block.vertices + [2.0, 1.0, 0.0])
        assert np.isfinite(near_surface(slid.vertices[rows], table)).all()

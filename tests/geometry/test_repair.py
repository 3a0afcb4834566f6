"""Defects of CAD meshes that are repaired, and defects that are errors with a position."""

from __future__ import annotations

import numpy as np
import pytest

from optisense.errors import MeshError
from optisense.geometry import TriangleMesh
from optisense.geometry._mesh_checks import with_consistent_winding
from optisense.geometry.repair import narrow_openings, refuse_bad_sheet, repaired, shells

BLOCK = TriangleMesh.box((0, 0, 0), (10, 8, 4), (3, 3, 3))
VOLUME = 320.0


def with_some_faces_turned(mesh: TriangleMesh, which: slice) -> TriangleMesh:
    faces = mesh.faces.copy()
    faces[which] = faces[which][:, ::-1]
    return mesh.with_faces(faces)


@pytest.mark.parametrize("which", [slice(0, None), slice(5, 6), slice(1, None), slice(10, 60)])
def test_faces_that_look_inward_are_turned_over(which: slice) -> None:
    mesh, notes = repaired(with_some_faces_turned(BLOCK, which), "gel", closed=True)
    assert mesh.volume == pytest.approx(VOLUME)
    assert len(notes) == 1 and "turned over" in notes[0]


def test_each_shell_follows_its_first_face() -> None:
    beside = TriangleMesh.box((20, 0, 0), (21, 1, 1))
    both = TriangleMesh.joined([BLOCK, beside])
    random = np.random.default_rng(1)
    turned = random.random(len(both.faces)) < 0.5
    turned[[0, len(BLOCK.faces)]] = False, True
    mixed = both.with_faces(np.where(turned[:, None], both.faces[:, ::-1], both.faces))
    agreed = with_consistent_winding(mixed)
    inside_out = np.arange(len(both.faces)) >= len(BLOCK.faces)
    expected = np.where(inside_out[:, None], -both.face_normals, both.face_normals)
    assert agreed.face_normals == pytest.approx(expected)


def test_a_moebius_strip_stays_as_it_is() -> None:
    """Three rungs round and a half turn: no winding would suit all its faces."""
    turn = np.radians([0.0, 120.0, 240.0])
    around = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(3)])
    across = 0.3 * np.column_stack([np.cos(turn / 2), np.cos(turn / 2), np.sin(turn / 2)])
    rungs = np.concatenate([3 * around - across, 3 * around + across])
    faces = np.array([[0, 1, 3], [1, 4, 3], [1, 2, 4], [2, 5, 4], [2, 3, 5], [3, 0, 5]])
    strip = TriangleMesh(rungs, faces)
    assert (with_consistent_winding(strip).faces == faces).all()


def test_a_sound_solid_needs_nothing() -> None:
    mesh, notes = repaired(BLOCK, "gel", closed=True)
    assert notes == []
    assert mesh.volume == pytest.approx(VOLUME)


@pytest.mark.parametrize("turned", [False, True])
def test_a_cavity_looks_into_the_hollow_however_it_was_drawn(turned: bool) -> None:
    hollow = TriangleMesh.box((2, 2, 1), (4, 4, 2))
    for drawn, told in ((hollow, not turned), (hollow.flipped(), turned)):
        outer = BLOCK.flipped() if turned else BLOCK
        mesh, notes = repaired(TriangleMesh.joined([outer, drawn]), "gel", closed=True)
        assert mesh.volume == pytest.approx(VOLUME - 4.0)
        named = "near (3.000, 3.000, 1.500) mm, which lies inside another one, became a cavity"
        assert any(f"{named} of 4 mm^3" in note for note in notes) == told


def test_two_bodies_in_one_file_both_look_outward() -> None:
    beside = TriangleMesh.box((20, 0, 0), (21, 1, 1)).flipped()
    mesh, _ = repaired(TriangleMesh.joined([BLOCK, beside]), "plates", closed=True)
    assert mesh.volume == pytest.approx(VOLUME + 1.0)
    assert shells(mesh).max() == 1


def test_bodies_of_an_opaque_part_look_outward_and_its_cavities_inward() -> None:
    """Unlike in transparent parts, bodies may overlap, and a body inside another one stays one."""
    across = TriangleMesh.box((9, 1, 1), (21, 2, 2))
    beside = TriangleMesh.box((20, 0, 0), (21, 1, 1)).flipped()
    hollow = TriangleMesh.box((2, 2, 1), (4, 4, 2))
    for drawn, inner in ((hollow, 4.0), (hollow.flipped(), -4.0)):
        parts = [BLOCK, across, beside, drawn]
        for sense in (parts, [each.flipped() for each in parts]):
            mesh, notes = repaired(TriangleMesh.joined(sense), "housing", closed=False)
            assert mesh.volume == pytest.approx(VOLUME + 12.0 + 1.0 + inner)
            assert len(notes) == 1 and "faces were inside out; they were turned over" in notes[0]


@pytest.mark.parametrize("closed", [True, False])
def test_a_shell_in_a_cavity_is_a_body_however_it_was_drawn(closed: bool) -> None:
    hollow = TriangleMesh.box((2, 2, 1), (4, 4, 3)).flipped()
    loose = TriangleMesh.box((2.5, 2.5, 1.5), (3.5, 3.5, 2.5))
    within = TriangleMesh.box((2.75, 2.75, 1.75), (3.25, 3.25, 2.25)).flipped()
    for drawn, cavity in ((loose, within), (loose.flipped(), within.flipped())):
        mesh, _ = repaired(TriangleMesh.joined([BLOCK, hollow, drawn]), "gel", closed)
        assert mesh.volume == pytest.approx(VOLUME - 8.0 + 1.0)
        mesh, notes = repaired(TriangleMesh.joined([BLOCK, hollow, drawn, cavity]), "gel", closed)
        assert mesh.volume == pytest.approx(VOLUME - 8.0 + 1.0 - 0.125)
        assert not any("became a cavity" in note for note in notes)


@pytest.mark.parametrize("at", [(10, 2, 1), (10, 8, 3), (10, 8, 4), (2, 2, 4 - 5e-5)])
def test_bodies_may_touch_with_faces_edges_and_corners(at: tuple[float, float, float]) -> None:
    beside = TriangleMesh.box(at, np.add(at, (1, 1, 2))).flipped()
    mesh, _ = repaired(TriangleMesh.joined([BLOCK, beside]), "plates", closed=True)
    assert mesh.volume == pytest.approx(VOLUME + 2.0)


@pytest.mark.parametrize("noise", [3e-7, 3e-6, 2e-4])
def test_loose_triangles_are_joined(noise: float) -> None:
    corners = BLOCK.triangles.reshape(-1, 3)
    off = np.random.default_rng(7).uniform(-noise, noise, corners.shape)
    loose = TriangleMesh(corners + off, np.arange(len(corners)).reshape(-1, 3))
    for closed in (True, False):
        mesh, notes = repaired(loose, "gel", closed=closed)
        assert mesh.is_closed
        assert mesh.volume == pytest.approx(VOLUME, abs=1000 * noise)
        assert ("joined" in " ".join(notes)) == (noise > 1e-6)


def test_doubled_faces_are_dropped() -> None:
    doubled = BLOCK.with_faces(np.concatenate([BLOCK.faces, np.roll(BLOCK.faces[:4], 1, axis=1)]))
    mesh, notes = repaired(doubled, "gel", closed=True)
    assert len(mesh.faces) == len(BLOCK.faces)
    assert "4 duplicate faces" in notes[0]


@pytest.mark.parametrize("closed", [True, False])
def test_a_solid_that_is_drawn_from_both_sides_is_one(closed: bool) -> None:
    for count in (4, len(BLOCK.faces)):
        faces = np.concatenate([BLOCK.faces, BLOCK.faces[:count, ::-1]])
        mesh, notes = repaired(BLOCK.with_faces(faces), "housing", closed=closed)
        assert mesh.volume == pytest.approx(VOLUME)
        assert len(mesh.faces) == len(BLOCK.faces)
        assert notes[0] == f"{count} duplicate faces were dropped"


@pytest.mark.parametrize("closed", [True, False])
def test_bodies_with_a_common_wall_are_one(closed: bool) -> None:
    beside = TriangleMesh.box((10, 0, 0), (20, 8, 4), (3, 3, 3))
    # A reflection has the other diagonals in the squares of the wall.
    mirrored = BLOCK.with_vertices(BLOCK.vertices * (-1, 1, 1) + (20, 0, 0)).flipped()
    for other in (beside, beside.flipped(), mirrored, mirrored.flipped()):
        mesh, notes = repaired(TriangleMesh.joined([BLOCK, other]), "gel", closed=closed)
        assert mesh.volume == pytest.approx(2.0 * VOLUME)
        assert shells(mesh).max() == 0
        assert notes[0] == "36 duplicate faces were dropped"


def faulty(kind: str) -> TriangleMesh:
    beside = TriangleMesh.box((10, 0, 0), (20, 8, 4), (3, 3, 3))
    second = {
        "wall": beside.with_faces(beside.faces[(beside.triangles[..., 0] > 10.0).any(axis=1)]),
        "edge": TriangleMesh.box((10, 8, 0), (20, 18, 4), (3, 3, 3)),
        "overlap": TriangleMesh.box((5, 1, 1), (20, 9, 9), (3, 3, 3)),
        "stack": TriangleMesh.box((0, 0, 2), (10, 8, 6), (2, 4, 2)),
        "notch": TriangleMesh.box((2, 2, 0), (4, 4, 2)).flipped(),
    }
    if kind in second:
        return TriangleMesh.joined([BLOCK, second[kind]])
    if kind == "hole":
        return BLOCK.with_faces(BLOCK.faces[1:])
    if kind == "flat":
        return TriangleMesh(np.eye(3), np.array([[0, 1, 2], [2, 1, 0]]))
    if kind == "fold":  # a top pushed down through the bottom
        vertices = BLOCK.vertices.copy()
        inner = (vertices[:, 2] == 4) & (np.abs(vertices[:, 0] - 5) < 4)
        inner &= np.abs(vertices[:, 1] - 4) < 3
        vertices[inner, 2] = -1.0
        return BLOCK.with_vertices(vertices)
    if kind == "nan":
        return BLOCK.with_vertices(np.where(BLOCK.vertices == 10, np.nan, BLOCK.vertices))
    return TriangleMesh(np.zeros((0, 3)), np.zeros((0, 3)))


@pytest.mark.parametrize(
    ("kind", "complaint", "place", "advice"),
    [
        ("empty", "no faces", "", "export"),
        ("hole", "not closed: it has a hole of 4.27 mm", "(2.222, 0.889, 4.000)", "close"),
        ("wall", "not manifold", "(10.000, ", "inside the body"),
        ("edge", "not manifold: 3 edges", "(10.000, 8.000, ", "own file"),
        ("overlap", "cuts through itself", "(5.000, ", "union"),
        ("stack", "bodies overlap", "(5.000, 4.000, 3.000)", "union"),
        ("notch", "bodies overlap", "(3.000, 3.000, 1.000)", "union"),
        ("fold", "cuts through itself", ", 0.000)", "folds"),
        ("flat", "no volume", "(0.333, 0.333, 0.333)", "solid body"),
        ("nan", "not finite", "", "again"),
    ],
)
def test_what_can_not_be_mended_is_told_with_part_place_and_remedy(
    kind: str, complaint: str, place: str, advice: str
) -> None:
    with pytest.raises(MeshError) as error:
        repaired(faulty(kind), "gel", closed=True)
    assert complaint in error.value.message
    assert place in error.value.message
    assert error.value.where == "part gel"
    assert advice in (error.value.hint or "")


def test_a_hole_in_a_surface_is_told_from_the_rim_of_a_sheet() -> None:
    sheet = TriangleMesh.grid((4, 4), (3, 3))
    plates = TriangleMesh.joined([sheet, sheet.with_vertices(sheet.vertices + (9, 0, 0))])
    for mesh in (BLOCK, sheet, plates):
        assert narrow_openings(mesh) is None
    for mesh in (faulty("hole"), TriangleMesh.joined([plates, faulty("hole")])):
        told = narrow_openings(mesh)
        assert told is not None and told.startswith("a hole of 4.27 mm near (2.222, 0.889, 4.000)")


def test_in_an_open_sheet_the_majority_decides_where_it_looks() -> None:
    sheet = TriangleMesh.grid((4, 4), (3, 3))
    for start in (0, 3):
        turned = with_some_faces_turned(sheet, slice(start, start + 1))
        mesh, notes = repaired(turned, "skin", closed=False)
        assert (mesh.face_normals[:, 2] > 0.99).all()
        assert notes == ["1 faces were turned over to agree with their neighbours"]


def test_a_sheet_to_walk_on_has_at_most_two_faces_at_an_edge() -> None:
    sheet = TriangleMesh.grid((4, 4), (2, 2))
    fin = sheet.transformed([[1, 0, 0], [0, 0, -1], [0, 1, 0]])  # stands upright on the middle
    refuse_bad_sheet(sheet, "skin")
    with pytest.raises(MeshError, match="more than two faces"):
        refuse_bad_sheet(TriangleMesh.joined([sheet, fin]), "skin")


def test_normals_in_a_file_are_used_neither_for_solids_nor_for_sheets() -> None:
    sheet = TriangleMesh.grid((2.0, 2.0), (2, 2))
    corners = sheet.triangles.reshape(-1, 3)
    faces = np.arange(len(corners)).reshape(-1, 3)
    apart = TriangleMesh(corners, faces, np.repeat(sheet.face_normals, 3, axis=0))
    mesh, notes = repaired(apart, "mirror", closed=False)
    assert (mesh.normals, len(mesh.vertices), notes) == (None, 9, [])

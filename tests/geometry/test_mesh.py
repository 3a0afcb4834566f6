"""Facts about triangle meshes: closed forms, round trips, and bad files."""

import copy
import pickle
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from optisense.errors import MeshError
from optisense.geometry import TriangleMesh
from optisense.geometry.mesh_files import _parse_obj, _parse_plain_obj


def box(divisions: tuple[int, int, int] = (2, 3, 1)) -> TriangleMesh:
    return TriangleMesh.box((-1, -2, -3), (2, 2, 1), divisions)


def test_box_is_closed_with_the_volume_and_area_of_a_box() -> None:
    mesh = box()
    assert mesh.is_closed
    assert mesh.volume == pytest.approx(3 * 4 * 4)
    assert mesh.area == pytest.approx(2 * (3 * 4 + 3 * 4 + 4 * 4))
    np.testing.assert_allclose(mesh.bounds, [[-1, -2, -3], [2, 2, 1]])


def test_a_mesh_never_changes() -> None:
    corners = np.eye(3)
    made = TriangleMesh(corners, [[0, 1, 2]], corners)
    corners[0, 0] = 7.0
    for mesh in (made, copy.deepcopy(made), pickle.loads(pickle.dumps(made))):
        assert mesh.normals is not None
        np.testing.assert_array_equal(mesh.vertices, np.eye(3))
        np.testing.assert_array_equal(mesh.normals, np.eye(3))
        for array in (mesh.vertices, mesh.faces, mesh.normals):
            with pytest.raises(ValueError, match="read-only"):
                array[0, 0] = 2
    assert np.shares_memory(TriangleMesh(made.vertices, made.faces).vertices, made.vertices)


def test_grid_faces_up() -> None:
    mesh = TriangleMesh.grid((4, 2), (5, 3), height=1.5)
    np.testing.assert_allclose(mesh.face_normals, np.tile([0, 0, 1], (30, 1)))
    assert mesh.area == pytest.approx(8)
    assert not mesh.is_closed


def test_obj_round_trip_keeps_every_number(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    mesh = box((1, 1, 1)).with_vertices(rng.normal(size=(8, 3)) / 3.0)
    for saved in (mesh, mesh.vertex_normals()):
        saved.save_obj(tmp_path / "mesh.obj")
        loaded = TriangleMesh.load(tmp_path / "mesh.obj")
        np.testing.assert_array_equal(loaded.vertices, saved.vertices)
        np.testing.assert_array_equal(loaded.faces, saved.faces)
        assert (loaded.normals is None) == (saved.normals is None)
        if saved.normals is not None and loaded.normals is not None:
            np.testing.assert_array_equal(loaded.normals, saved.normals)


@pytest.mark.parametrize("suffix", ["stl", "ply"])
def test_stl_and_ply_are_read_as_closed_solids(tmp_path: Path, suffix: str) -> None:
    import trimesh

    mesh = box()
    trimesh.Trimesh(mesh.vertices, mesh.faces).export(tmp_path / f"box.{suffix}")
    loaded = TriangleMesh.load(tmp_path / f"box.{suffix}")
    assert loaded.is_closed
    assert loaded.volume == pytest.approx(48)


@pytest.mark.parametrize(
    ("file_type", "told"),
    [("stl", "it announces 44 triangles and has the length of 41"), ("stl_ascii", "endsolid")],
)
def test_an_stl_file_that_is_cut_off_says_so(tmp_path: Path, file_type: str, told: str) -> None:
    import trimesh

    whole = tmp_path / "box.stl"
    trimesh.Trimesh(box().vertices, box().faces).export(whole, file_type=file_type)
    assert TriangleMesh.load(whole).is_closed
    whole.write_bytes(whole.read_bytes()[:-120])
    with pytest.raises(MeshError, match=told) as caught:
        TriangleMesh.load(whole)
    assert "cut off" in caught.value.message and str(whole) in str(caught.value)


def test_obj_polygons_are_triangulated_even_when_concave(tmp_path: Path) -> None:
    (tmp_path / "arrow.obj").write_text(
        "v 0 0 0\nv 2 -2 0\nv 0 2 0\nv -2 -2 0\nf 1/1 2/2 3/3 4/4\nf -4 -1 -2 -3\n"
    )
    mesh = TriangleMesh.load(tmp_path / "arrow.obj")
    assert mesh.area == pytest.approx(2 * 4.0)
    np.testing.assert_allclose(np.sort(mesh.face_normals[:, 2]), [-1, -1, 1, 1])


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("v 0 0 zero\n", ":1"),
        ("v 0 0 0\nv 1 0 0\nf 1 2\n", ":3"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "vertex 9"),
        ("v 0 0 0\n", "no triangles"),
        ("v 0 0 0\nv 1e-8 0 0\nv 0 1e-8 0\nf 1 2 3\n", "all triangles of the mesh collapse"),
    ],
)
def test_malformed_obj_names_the_place(tmp_path: Path, text: str, expected: str) -> None:
    (tmp_path / "bad.obj").write_text(text)
    with pytest.raises(MeshError, match=expected):
        TriangleMesh.load(tmp_path / "bad.obj")


SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 .5e0\n"
UP = "vn 0 0 1\n" * 4


@pytest.mark.parametrize(
    ("text", "plain"),
    [
        ("# mm\no part\n" + SQUARE + "s off\nf 1 2 3\nf 1 3 4\n", True),
        (SQUARE + UP + "f 1//1 2//2 3//3\nf 1//1 3//3 4//4\n", True),
        (SQUARE + "vn 0 0 1\nf 1//1 2//1 3//1\n", True),
        (SQUARE + "f 1 2 3 4\n", False),
        (SQUARE + "f -4 -3 -2\n", False),
        (SQUARE + "f 1/1 2/1 3/1\n", False),
        (SQUARE + "f 1 2 3 # the first\n", False),
        (SQUARE + "f 1 2 \\\n3\n", False),
        (SQUARE + " f 1 2 3\n", False),
        (SQUARE.replace("1 1 0", "1 1 0 1 0 0") + "f 1 2 3\n", False),
        (SQUARE + UP + "f 1//1 2//2 3//3\nf 1 3 4\n", False),
    ],
)
def test_plain_files_are_read_at_once_as_they_are_line_by_line(text: str, plain: bool) -> None:
    at_once = _parse_plain_obj(text.encode())
    assert (at_once is not None) == plain
    by_line = _parse_obj(text.encode(), Path("square.obj"))
    assert len(by_line.faces) > 0
    if at_once is not None:
        np.testing.assert_array_equal(at_once.vertices, by_line.vertices)
        np.testing.assert_array_equal(at_once.faces, by_line.faces)
        assert (at_once.normals is None) == (by_line.normals is None)
        if at_once.normals is not None:
            np.testing.assert_array_equal(at_once.normals, by_line.normals)


def test_a_file_whose_triangles_share_no_vertices_is_welded(tmp_path: Path) -> None:
    mesh = box()
    corners = mesh.triangles.reshape(-1, 3)
    faces = np.arange(len(corners)).reshape(-1, 3)
    TriangleMesh(corners, faces).save_obj(tmp_path / "apart.obj")
    assert len(TriangleMesh.load(tmp_path / "apart.obj").vertices) == len(mesh.vertices)
    own = np.repeat(mesh.face_normals, 3, axis=0)
    TriangleMesh(corners, faces, own).save_obj(tmp_path / "flat.obj")
    assert len(TriangleMesh.load(tmp_path / "flat.obj").vertices) == len(corners)


def test_unreadable_files_are_mesh_errors(tmp_path: Path) -> None:
    with pytest.raises(MeshError, match="No such file"):
        TriangleMesh.load(tmp_path / "none.obj")
    with pytest.raises(MeshError, match=r"\.obj, \.stl, \.ply"):
        TriangleMesh.load(tmp_path / "part.step")
    (tmp_path / "bad.ply").write_bytes(b"ply\nformat ascii 1.0\nelement vertex 3\n")
    with pytest.raises(MeshError, match="malformed"):
        TriangleMesh.load(tmp_path / "bad.ply")


def test_a_leaky_solid_is_refused_at_its_hole() -> None:
    mesh = box((1, 1, 1))
    top = mesh.face_normals[:, 2] > 0.5
    leaky = TriangleMesh(mesh.vertices, mesh.faces[~top])
    leaky.validate("gel", closed=False)
    with pytest.raises(MeshError, match=r"part gel") as caught:
        leaky.validate("gel", closed=True)
    assert "1.000) mm" in str(caught.value)  # the rim of the missing top lies at z = 1


def test_inside_out_and_mixed_windings_are_turned_outward() -> None:
    mesh = box((2, 2, 2))
    mixed = mesh.faces.copy()
    mixed[::3] = mixed[::3, ::-1]
    for faces in (mesh.faces[:, ::-1], mixed):
        fixed = TriangleMesh(mesh.vertices, faces).validate("gel", closed=True)
        assert fixed.is_closed
        assert fixed.volume == pytest.approx(48)


def test_not_a_number_and_empty_meshes_are_refused() -> None:
    mesh = box((1, 1, 1))
    vertices = mesh.vertices.copy()
    vertices[3, 1] = np.nan
    with pytest.raises(MeshError, match="vertex 3"):
        mesh.with_vertices(vertices).validate("gel", closed=True)
    with pytest.raises(MeshError, match="no triangles"):
        TriangleMesh(mesh.vertices, np.zeros((0, 3))).validate("gel", closed=False)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"faces": np.zeros((6, 4), dtype=int)}, r"faces .* shape \(6, 4\).* split quads"),
        ({"faces": [[0, 1, 2], [0, 1, 2, 3]]}, "faces .* not rows of numbers.* split quads"),
        ({"faces": [[0, 1, 2.5]]}, "faces .* not whole numbers"),
        ({"faces": [[0, 1, np.nan]]}, "faces .* not whole numbers"),
        ({"faces": [[0, 1, 2**32 + 2]]}, "faces .* not whole numbers"),
        ({"vertices": np.zeros((3, 8))}, r"vertices .* shape \(3, 8\)"),
        ({"vertices": np.zeros(9)}, r"vertices .* shape \(9,\)"),
        ({"normals": np.zeros((3, 2, 4))}, r"normals .* shape \(3, 2, 4\)"),
    ],
)
def test_arrays_of_other_shapes_are_refused(change: dict[str, Any], told: str) -> None:
    with pytest.raises(MeshError, match=told):
        replace(box((1, 1, 1)), **change)


def test_a_read_only_view_of_an_array_is_copied() -> None:
    vertices = box((1, 1, 1)).vertices.copy()
    view = vertices[:]
    view.setflags(write=False)
    mesh = TriangleMesh(view, box((1, 1, 1)).faces)
    vertices[:] = 0.0
    assert mesh.volume == pytest.approx(48)


def test_crease_keeps_box_edges_sharp_and_a_fine_sphere_smooth() -> None:
    sharp = box((2, 2, 2)).vertex_normals()
    assert sharp.normals is not None
    np.testing.assert_allclose(np.abs(sharp.normals).max(axis=1), 1.0)
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=4, radius=2.0)
    smooth = TriangleMesh(ball.vertices, ball.faces).vertex_normals()
    assert smooth.normals is not None
    assert len(smooth.vertices) == len(ball.vertices)
    radial = smooth.vertices / 2.0
    assert np.degrees(np.arccos((smooth.normals * radial).sum(1).clip(-1, 1))).max() < 0.5


def test_mirroring_keeps_the_faces_outward() -> None:
    mirrored = box().vertex_normals().transformed(np.diag([-1.0, 1.0, 1.0]))
    assert mirrored.volume == pytest.approx(48)
    assert mirrored.normals is not None
    corner = mirrored.normals[mirrored.faces[:, 0]]
    assert ((corner * mirrored.face_normals).sum(axis=1) > 0.9).all()

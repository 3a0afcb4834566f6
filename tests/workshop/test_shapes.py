"""Exported shapes read back as what they were, by our own reader and by others'."""

from __future__ import annotations

import sys
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from step_extra import needs_step

from optisense import sensors
from optisense.design import Part, Role, SensorDesign
from optisense.errors import DesignError, OutputError, SetupError
from optisense.geometry import TriangleMesh
from optisense.geometry.solids import bodies, united
from optisense.workshop import bill_of_materials, export
from optisense.workshop._step_format import write_step
from optisense.workshop.formats import NAMESPACE, three_mf_bytes
from optisense.workshop.shapes import Shape, shapes

SINGLE = 1e-6
"""Relative precision of the coordinates of an STL file."""

CORE = f"{{{NAMESPACE}}}"


def objects(file: Path) -> dict[str, tuple[str, TriangleMesh]]:
    """Type and mesh of each object of a 3MF file, read with nothing of ours."""
    with zipfile.ZipFile(file) as archive:
        assert archive.testzip() is None
        root = ElementTree.fromstring(archive.read("3D/3dmodel.model"))
    assert root.get("unit") == "millimeter"
    found = {}
    for item in root.iter(f"{CORE}object"):
        vertices = [[float(v.get(a, "")) for a in "xyz"] for v in item.iter(f"{CORE}vertex")]
        faces = [
            [int(t.get(a, "")) for a in ("v1", "v2", "v3")] for t in item.iter(f"{CORE}triangle")
        ]
        mesh = TriangleMesh(np.array(vertices), np.array(faces, dtype=np.int32))
        found[item.get("name", "")] = (item.get("type", ""), mesh)
    built = [item.get("objectid") for item in root.iter(f"{CORE}item")]
    assert built == [str(number) for number in range(1, len(found) + 1)]
    return found


def test_the_shape_is_the_deformed_one(flat: SensorDesign, dome: SensorDesign) -> None:
    """The dome rises by a quarter of 9 mm, and holds the volume of its smooth bulge."""
    before = {shape.name: shape for shape in shapes(flat)}
    after = {shape.name: shape for shape in shapes(dome)}
    assert before["gel"].volume == pytest.approx(25.25 * 20.75 * 4.25)
    assert after["gel"].mesh.bounds[1, 2] == pytest.approx(9.0 / 4.0)
    # The point's weight is 2 u (1 - u) in each direction across, whose mean is 1/3; along z, u^2.
    assert after["gel"].volume == pytest.approx(25.25 * 20.75 * (4.25 + 9.0 / 9.0), rel=1e-3)
    assert after["tray"].volume == pytest.approx(28.23 * 23.73 * 1.0)
    assert not after["skin"].is_solid and after["skin"].volume is None


@pytest.mark.parametrize("kind", ["stl", "obj"])
def test_a_file_of_each_part_reads_back(dome: SensorDesign, tmp_path: Path, kind: str) -> None:
    """By our reader, and solids by that of trimesh."""
    import trimesh

    export(dome, tmp_path, [kind])
    precision = SINGLE if kind == "stl" else 0.0
    for shape in shapes(dome):
        mesh = TriangleMesh.load(tmp_path / f"{shape.name}.{kind}")
        assert mesh.is_closed == shape.is_solid
        np.testing.assert_allclose(mesh.bounds, shape.mesh.bounds, rtol=precision, atol=1e-6)
        assert mesh.area == pytest.approx(shape.mesh.area, rel=10 * SINGLE)
        if shape.volume is not None:
            loaded = trimesh.load_mesh(tmp_path / f"{shape.name}.{kind}")
            assert loaded.is_watertight and loaded.is_winding_consistent
            for volume in (mesh.volume, loaded.volume):
                assert volume == pytest.approx(shape.volume, rel=10 * SINGLE)
    if kind == "stl":
        assert b"millimetres" in (tmp_path / "gel.stl").read_bytes()[:80]
        assert not (tmp_path / "gel.stl").read_bytes().startswith(b"solid")


def test_a_3mf_file_holds_all_parts_in_their_places(dome: SensorDesign, tmp_path: Path) -> None:
    export(dome, tmp_path, ["3mf"])
    found = objects(tmp_path / "gelsight-mini-ideal-spherical.3mf")
    made = shapes(dome)
    assert list(found) == [shape.name for shape in made]
    for shape in made:
        kind, mesh = found[shape.name]
        assert kind == ("model" if shape.is_solid else "surface")
        np.testing.assert_array_equal(mesh.vertices, shape.mesh.vertices)
        np.testing.assert_array_equal(mesh.faces, shape.mesh.faces)
        if shape.is_solid:
            assert mesh.volume == pytest.approx(shape.volume)


def test_the_same_shapes_give_the_same_bytes(flat: SensorDesign) -> None:
    made = shapes(flat)
    assert three_mf_bytes("a", made) == three_mf_bytes("a", made)


def test_names_that_xml_would_stumble_over(flat: SensorDesign, tmp_path: Path) -> None:
    design = flat.copy()
    design.name = 'a <b> & "c"\x07/../d'
    (file, *_) = export(design, tmp_path, ["3mf"])
    assert file == tmp_path / "a-b-c-d.3mf"
    assert set(objects(file)) == set(design.parts)


def hollow_and_apart() -> TriangleMesh:
    """A cube with a cavity in which a small one floats, and another cube beside it: 27-8+1+1."""
    return TriangleMesh.joined(
        [
            TriangleMesh.box((0, 0, 0), (3, 3, 3)),
            TriangleMesh.box((0.5, 0.5, 0.5), (2.5, 2.5, 2.5)).flipped(),
            TriangleMesh.box((1, 1, 1), (2, 2, 2)),
            TriangleMesh.box((5, 0, 0), (6, 1, 1)),
        ]
    )


def test_bodies_keep_their_cavities() -> None:
    found = bodies(hollow_and_apart())
    volumes = sorted([round(piece.volume, 9) for piece in body] for body in found)
    assert volumes == [[1.0], [1.0], [27.0, -8.0]]


def test_a_cavity_belongs_to_the_body_that_contains_all_of_it() -> None:
    """A smaller body fills a half of the cavity of 16 mm³, and has 24 mm³ outside the cube."""
    cube = TriangleMesh.box((0, 0, 0), (10, 10, 10))
    cavity = TriangleMesh.box((4, 4, 4), (8, 6, 6)).flipped()
    smaller = TriangleMesh.box((3, 3, 3), (6, 7, 12))
    found = united(TriangleMesh.joined([cube, cavity, smaller]))
    assert found.volume == pytest.approx(1000.0 - 16.0 + 8.0 + 24.0)


def test_overlapping_bodies_of_a_part_are_one(flat: SensorDesign) -> None:
    """Their common space is counted once, also where one is inside out; bodies that touch, and
    cavities, stay as they are."""
    cubes = [TriangleMesh.box((x, 0, 40), (x + 10, 10, 50)) for x in (0, 5, 30)]
    cubes.append(TriangleMesh.box((40, 1, 41), (41, 2, 42)))
    cubes.append(TriangleMesh.box((30, 0, 40), (35, 5, 60)))
    flat = flat.model_copy(deep=True)
    flat.parts["frame"] = Part(role=Role.BLOCKER, mesh="meshes/frame.obj")
    flat.meshes["frame"] = TriangleMesh.joined(cubes)
    (frame,) = [each for each in shapes(flat) if each.name == "frame"]
    assert frame.volume == pytest.approx(1500.0 + 1250.0 + 1.0)
    cubes[0] = cubes[0].flipped()
    flat.meshes["frame"] = TriangleMesh.joined(cubes)
    (mixed,) = [each for each in shapes(flat) if each.name == "frame"]
    assert mixed.volume == pytest.approx(frame.volume)
    assert sorted(body[0].volume for body in bodies(frame.mesh)) == pytest.approx([1, 1250, 1500])
    apart = hollow_and_apart()
    assert united(apart) is apart


@needs_step
@pytest.mark.usefixtures("forks")
def test_a_part_of_several_bodies_as_a_step_file(tmp_path: Path) -> None:
    from optisense.geometry.step import read_step

    mesh = hollow_and_apart()
    write_step(tmp_path / "it.step", [Shape("boards", Role.BLOCKER, None, mesh)])
    read = read_step(tmp_path / "it.step")
    assert [body.solid for body in read] == [True] * 3
    assert sorted(body.mesh.volume for body in read) == pytest.approx([1.0, 1.0, 19.0])
    assert all(body.name.startswith("boards") for body in read)


def test_step_without_its_extra_says_what_to_install_before_any_work(
    flat: SensorDesign, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "OCP.STEPCAFControl", None)
    with pytest.raises(SetupError, match=r"optisense\[step\]"):
        export(flat, tmp_path / "new", ["stl", "step"])
    assert not (tmp_path / "new").exists()


def test_a_film_of_air_is_neither_made_nor_bought() -> None:
    belt = sensors.build("gelbelt")
    assert belt.parts["film"].material == "air-film"
    assert [shape.name for shape in shapes(belt)] == [name for name in belt.parts if name != "film"]
    bought = bill_of_materials(belt).items
    assert not any("film" in item.used_for or "air" in item.name for item in bought)
    assert any(item.used_for == "tape (support)" for item in bought)


def test_indenters_are_not_made(flat: SensorDesign) -> None:
    design = flat.copy()
    design.parts = {**design.parts, "ball": Part(role=Role.INDENTER, mesh="meshes/ball.obj")}
    design.meshes["ball"] = TriangleMesh.box((0, 0, 0), (1, 1, 1))
    assert "ball" not in {shape.name for shape in shapes(design)}


def test_a_solid_that_is_inside_out_is_turned(flat: SensorDesign) -> None:
    design = flat.copy()
    design.meshes["tray"] = design.meshes["tray"].flipped()
    tray = next(shape for shape in shapes(design) if shape.name == "tray")
    assert tray.mesh.volume > 0.0


def test_a_part_without_its_mesh(flat: SensorDesign, tmp_path: Path) -> None:
    design = flat.copy()
    del design.meshes["tray"]
    with pytest.raises(DesignError, match="'tray' has no mesh"):
        export(design, tmp_path / "new")
    assert not (tmp_path / "new").exists()


def test_a_folder_that_can_not_be_written(flat: SensorDesign, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError):
        export(flat, tmp_path / "file")


def test_a_failure_leaves_no_file_behind(
    flat: SensorDesign, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The disk fills up at the last file."""
    plain = Path.write_bytes

    def full(path: Path, data: bytes) -> int:
        if "bill" in path.name:
            raise OSError(28, "No space left on device", str(path))
        return plain(path, data)

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(OutputError, match="No space"):
        export(flat, tmp_path / "new", ["stl", "3mf"])
    assert list((tmp_path / "new").iterdir()) == []


def test_an_unknown_format(flat: SensorDesign, tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="no file format 'dxf'"):
        export(flat, tmp_path, ["dxf"])

"""Designs on disk: a saved design is read back unchanged, and untrusted files are harmless."""

from __future__ import annotations

import os
import re
from pathlib import Path

import numpy as np
import pytest
import yaml
from pydantic import BaseModel

from optisense.design import Camera, Markers, SensorDesign, load_design, save_design, set_value
from optisense.design.cage import Share
from optisense.design.kinds import KindModel
from optisense.errors import DesignError, MeshError, OutputError
from optisense.geometry import TriangleMesh
from tests.helpers.mesh_files import triangle_ply

ASSET = Path(__file__).parents[1] / "assets" / "design-v1"


def edit(folder: Path, old: str, new: str) -> int:
    """Replace the first `old` in the design file; returns its line."""
    file = folder / "design.yaml"
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new, 1))
    return text[: text.index(old)].count("\n") + 1


def used_fields(value: object) -> set[tuple[str, str]]:
    found: set[tuple[str, str]] = set()
    if isinstance(value, BaseModel):
        for name in type(value).model_fields:
            child = getattr(value, name)
            if child is not None and child != {} and child != []:
                found |= {(type(value).__name__, name)} | used_fields(child)
    elif isinstance(value, dict):
        found.update(*(used_fields(child) for child in value.values()))
    elif isinstance(value, list | tuple):
        found.update(*(used_fields(child) for child in value))
    return found


def all_fields(kind: type[BaseModel] = SensorDesign) -> set[tuple[str, str]]:
    def below(base: type[BaseModel]) -> list[type[BaseModel]]:
        return [c for sub in base.__subclasses__() for c in [sub, *below(sub)]]

    classes = [
        c
        for c in below(BaseModel)
        if c.__module__.startswith("optisense.design.")
        and not ("kinds" in c.__dict__ or c is KindModel)  # they stand for their kinds
        and not c.__subclasses__()
    ]
    return {(c.__name__, name) for c in classes for name in c.model_fields}


class TestRoundTrip:
    def test_the_test_design_uses_every_field(
        self, design: SensorDesign, other_cameras: list[Camera]
    ) -> None:
        listed = Markers(radius=0.3, places=[(0.0, 1.0)])
        used = used_fields(design) | used_fields(other_cameras) | used_fields(listed)
        assert used == all_fields()

    def test_every_field_comes_back(
        self, design: SensorDesign, folder: Path, other_cameras: list[Camera]
    ) -> None:
        again = load_design(folder)
        assert again.model_dump() == design.model_dump()
        assert isinstance(again.cages["mirror"].blend, list)
        assert isinstance(again.cages["mirror"].blend[0], Share)
        for camera in other_cameras:
            design.camera = camera
            save_design(design, folder)
            assert load_design(folder).camera == camera

    def test_every_mesh_comes_back_to_the_last_bit(
        self, design: SensorDesign, folder: Path
    ) -> None:
        again = load_design(folder / "design.yaml")
        assert list(again.meshes) == list(design.meshes)
        for name, mesh in design.meshes.items():
            np.testing.assert_array_equal(again.meshes[name].vertices, mesh.vertices)
            np.testing.assert_array_equal(again.meshes[name].faces, mesh.faces)

    def test_an_own_ies_file_travels_along(self, folder: Path, tmp_path: Path) -> None:
        save_design(load_design(folder), tmp_path / "copy")
        emitter = load_design(tmp_path / "copy").lights["own-ies"].emitter
        assert emitter is not None and emitter.kind == "ies"
        assert emitter.intensity_table().candela[0].tolist() == [20.0, 10.0, 0.0]

    def test_saving_twice_gives_the_same_file(self, folder: Path, tmp_path: Path) -> None:
        save_design(load_design(folder), tmp_path / "copy")
        assert (tmp_path / "copy/design.yaml").read_bytes() == (folder / "design.yaml").read_bytes()

    def test_an_stl_mesh_is_read_and_saved_as_obj(self, folder: Path, tmp_path: Path) -> None:
        (folder / "meshes/mirror.stl").write_text(
            "solid m\nfacet normal 0 0 0\nouter loop\nvertex 8.5 -3 -8\nvertex 8.5 3 -8\n"
            "vertex 8.25 0 -2\nendloop\nendfacet\nendsolid m\n"
        )
        edit(folder, "meshes/mirror.obj", "meshes/mirror.stl")
        save_design(load_design(folder), tmp_path / "copy")
        assert load_design(tmp_path / "copy").parts["mirror"].mesh == "meshes/mirror.obj"

    def test_numbers_have_their_units_in_comments(self, folder: Path) -> None:
        text = (folder / "design.yaml").read_text()
        for pattern in (r"flux: 12\.5 +# mW", r"fov: 150\.0 +# degrees", r"box: .* # mm"):
            assert re.search(pattern, text), pattern

    def test_comments_of_the_user_stay_at_their_values(self, folder: Path, tmp_path: Path) -> None:
        edit(folder, "schema_version: 1", "# NOTE: top\nschema_version: 1")
        edit(folder, "fov: 150.0  # ", '# NOTE: by "é" # 2\n  fov: 150.0  # NOTE: a lens, ')
        edit(folder, "flux: 12.5  # mW", "flux: 12.5  # NOTE: measured")
        edit(folder, "cages:", "  # NOTE: no light\ncages:  # NOTE: bent,")
        edit(folder, "    resolution: [2, 2", "    # NOTE: gone\n    resolution: [2, 2")
        file = folder / "design.yaml"
        file.write_text(file.read_text() + "# NOTE: end")
        design = load_design(folder)
        design.camera.fov = 100.0
        del design.cages[next(iter(design.cages))]
        save_design(design, folder)
        save_design(design, tmp_path / "new")
        lines = file.read_text().splitlines()
        plain = (tmp_path / "new" / "design.yaml").read_text().splitlines()
        assert [line for line in lines if "NOTE" not in line] == plain
        below = {
            line.strip().split(",")[0]: next(n for n in lines[k:] if "NOTE" not in n).split()[0]
            for k, line in enumerate(lines)
            if "NOTE" in line and line != lines[-1]
        }
        assert lines[-1] == "# NOTE: end" and below == {
            "# NOTE: top": "schema_version:",
            '# NOTE: by "é" # 2': "fov:",
            "# NOTE: a lens": "fov:",
            "# NOTE: measured": "flux:",
            "# NOTE: no light": "cages:",
            "# NOTE: bent": "cages:",
            "# NOTE: gone": "cages:",
        }
        save_design(load_design(folder), folder)
        assert file.read_text().splitlines() == lines

    def test_a_design_saved_by_version_1_still_loads(self) -> None:
        design = load_design(ASSET)
        assert design.lights["red"].lights[0].position == (6.0, 0.1, -4.0)
        assert design.cages["skin"].points[1].z == 0.5
        assert len(design.meshes["gel"].faces) == 128
        assert design.name == 'every field: a "test" # 1'


class TestErrors:
    def fails(self, folder: Path) -> str:
        with pytest.raises(DesignError) as caught:
            load_design(folder)
        return str(caught.value)

    @pytest.mark.parametrize(
        ("old", "new", "field", "near"),
        [
            ("flux: 12.5", "flx: 12.5", "'lights.red.flx'", "flux"),
            ("roughness: 0.125", "roughnes: 0.125", "'materials.gel.roughnes'", "roughness"),
            ("up: [0.0, 0.0, 1.0]", "upp: [0.0, 0.0, 1.0]", "'lights.red.lights[0].upp'", "up"),
        ],
    )
    def test_a_misspelt_field_names_line_and_near_match(
        self, folder: Path, old: str, new: str, field: str, near: str
    ) -> None:
        line = edit(folder, old, new)
        message = self.fails(folder)
        assert f"design.yaml:{line}" in message and "missing" not in message
        assert field in message and f"Did you mean '{near}'?" in message

    def test_a_missing_field_names_its_section(self, folder: Path) -> None:
        edit(folder, "    flux: 12.5", "    #")
        message = self.fails(folder)
        assert "'lights.red.flux' is missing" in message and "design.yaml:" in message

    def test_several_problems_are_told_at_once(self, folder: Path) -> None:
        first = edit(folder, "fov: 150.0", "fov: wide")
        second = edit(folder, "specularity: 0.25", "specularity: 1.5")
        message = self.fails(folder)
        assert f":{first}" in message and f":{second}" in message and "2 problems" in message

    @pytest.mark.parametrize(
        ("old", "new", "expected"),
        [
            ("kind: conductor", "kind: conducter", "Did you mean 'conductor'?"),
            ("role: elastomer", "role: elastomere", "Did you mean 'elastomer'?"),
            ("material: silver", "material: sliver", "Did you mean 'silver'?"),
            ("material: silver", "material: gel", "conductor or diffuse"),
            ("parts: [skin, gel]", "parts: [skin, gle]", "Did you mean 'gel'?"),
            ("role: sensing_surface", "role: blocker", "no part is a sensing_surface"),
            ("ior: 1.41", "ior: .nan", "finite"),
            ("ior: 1.41", "ior: true", "valid number"),
            ("ior: 1.41", "ior: '1.41'", "valid number"),
            ("up: [0.0, 1.0, 0.0]", "up: [0.0, 0.0, 2.0]", "parallel"),
            ("direction: [0.0, 0.0, 1.0]", "direction: [0, 0, 0]", "zero vector"),
            ("schema_version: 1", "schema_version: 2", "update OptiSense"),
            ("schema_version: 1", "scheme_version: 1", "'scheme_version'"),
            ("resolution: [2, 2, 2]", "resolution: [3, 2, 2]", "3 x 2 x 2 are needed"),
            ("fov: 150.0", "fov: [150", "not valid YAML"),
            ("fov: 150.0", "fov: 150.0\n  fov: 3", "there twice"),
            ("projection: equidistant", "projection: equidistand", "Did you mean 'equidistant'?"),
        ],
    )
    def test_bad_values(self, folder: Path, old: str, new: str, expected: str) -> None:
        line = edit(folder, old, new)
        message = self.fails(folder)
        assert expected in message
        assert re.search(r"design\.yaml:\d+", message), message
        if "YAML" not in expected and "zero" not in expected:
            found = int(re.search(r"design\.yaml:(\d+)", message)[1])  # type: ignore[index]
            assert found <= line + 1

    def test_metres_are_noticed(self, folder: Path) -> None:
        mesh = TriangleMesh.box((-0.005, -0.004, -0.002), (0.005, 0.004, 0))
        mesh.save_obj(folder / "meshes/gel.obj")
        message = self.fails(folder)
        assert "'gel'" in message and "metres" in message

    def test_a_30_metre_sensor_is_noticed(self, design: SensorDesign, tmp_path: Path) -> None:
        for name, mesh in design.meshes.items():
            design.meshes[name] = mesh.transformed(np.diag([1000.0, 1000.0, 1000.0]))
        save_design(design, tmp_path / "huge")
        assert "millimetres" in self.fails(tmp_path / "huge")

    def test_a_folder_without_a_design(self, tmp_path: Path) -> None:
        assert "no sensor design" in self.fails(tmp_path)

    @pytest.mark.parametrize(
        ("text", "told"),
        [
            ("v 0 0 0\n", "'gel'.*no triangles"),
            ("v 0 0 0\nv 9 0 0\nv 0 9 0\nf 1 2 3\n", r"'gel'.*not closed.*design\.yaml:\d+"),
            ("v 0 0 nan\nv 9 0 0\nv 0 9 0\nf 1 2 3\n", "'gel'.*not finite"),
        ],
    )
    def test_a_bad_mesh_names_part_and_place(self, folder: Path, text: str, told: str) -> None:
        (folder / "meshes/gel.obj").write_text(text)
        with pytest.raises(MeshError, match=told):
            load_design(folder)

    @pytest.mark.parametrize(("face", "told"), [("0 1 7", "vertex 8"), ("0 1 -1", "vertex 0")])
    def test_a_ply_file_with_unknown_vertices(self, folder: Path, face: str, told: str) -> None:
        (folder / "meshes/gel.ply").write_text(triangle_ply(face))
        edit(folder, "meshes/gel.obj", "meshes/gel.ply")
        with pytest.raises(MeshError, match=rf"{told}, but there are 3"):
            load_design(folder)

    def test_a_solid_turned_inside_out_is_turned_back(
        self, design: SensorDesign, folder: Path
    ) -> None:
        design.meshes["gel"].flipped().save_obj(folder / "meshes/gel.obj")
        assert load_design(folder).meshes["gel"].volume == pytest.approx(10 * 8 * 2)


class TestStrangers:
    """A design file is untrusted data."""

    @pytest.mark.parametrize(
        "path", ["../secret.obj", "/etc/passwd", "meshes/../../secret.obj", "C:\\x.obj", ""]
    )
    def test_no_mesh_path_leaves_the_folder(self, folder: Path, path: str) -> None:
        TriangleMesh.box((0, 0, 0), (5, 5, 5)).save_obj(folder.parent / "secret.obj")
        edit(folder, "mesh: meshes/gel.obj", f"mesh: '{path}'")
        with pytest.raises(DesignError, match=r"design\.yaml:\d+"):
            load_design(folder)

    @pytest.mark.parametrize("file", ["meshes/gel.obj", "lamps/lamp.ies"])
    def test_no_link_leaves_the_folder(self, folder: Path, file: str) -> None:
        (folder / file).rename(folder.parent / "moved")
        (folder / file).symlink_to(folder.parent / "moved")
        with pytest.raises(DesignError, match="leads out of the design folder"):
            load_design(folder)

    def test_saving_does_not_follow_a_link_out(self, design: SensorDesign, tmp_path: Path) -> None:
        (tmp_path / "outside").mkdir()
        (tmp_path / "sensor").mkdir()
        (tmp_path / "sensor/meshes").symlink_to(tmp_path / "outside")
        with pytest.raises(OutputError, match="leads out"):
            save_design(design, tmp_path / "sensor")
        assert list((tmp_path / "outside").iterdir()) == []

    @pytest.mark.parametrize(
        "value",
        [
            "!!python/object/apply:os.system ['true']",
            "!!python/name:os.system",
            "&a 1.5",
            "*a",
            "[" * 100_000,
            "{a: " * 1000 + "1" + "}" * 1000,
        ],
    )
    def test_no_tags_anchors_or_bottomless_nesting(self, folder: Path, value: str) -> None:
        edit(folder, "fov: 150.0", f"fov: {value}")
        with pytest.raises(DesignError, match=r"design\.yaml"):
            load_design(folder)

    @pytest.mark.parametrize(
        "text", ["", "- 1\n", "just text", "a: 1\n---\nb: 2\n", "\0", "a: \x07"]
    )
    def test_what_is_no_design_at_all(self, tmp_path: Path, text: str) -> None:
        (tmp_path / "design.yaml").write_text(text)
        with pytest.raises(DesignError, match=r"design\.yaml"):
            load_design(tmp_path)

    def test_bytes_that_are_no_text(self, tmp_path: Path) -> None:
        (tmp_path / "design.yaml").write_bytes(b"\xff\xfe\x80name")
        with pytest.raises(DesignError, match="UTF-8"):
            load_design(tmp_path)


class TestSaving:
    def test_a_failed_save_leaves_the_old_design_whole(
        self, design: SensorDesign, folder: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        before = {p: p.read_bytes() for p in folder.rglob("*") if p.is_file()}

        def full_disk(self: Path, *args: object, **kwargs: object) -> int:
            raise OSError(28, "No space left on device", str(self))

        monkeypatch.setattr(Path, "write_text", full_disk)
        changed = set_value(design, "lights.red.flux", 1.0)
        changed.meshes["gel"] = TriangleMesh.box((-5, -4, -2), (5, 4, 0))
        with pytest.raises(OutputError, match="No space left"):
            save_design(changed, folder)
        assert {p: p.read_bytes() for p in folder.rglob("*") if p.is_file()} == before

    def test_what_could_not_be_loaded_is_not_saved(
        self, design: SensorDesign, folder: Path
    ) -> None:
        before = {p: p.read_bytes() for p in folder.rglob("*") if p.is_file()}
        gel = design.meshes["gel"]
        bad = {
            "no triangles": TriangleMesh([], []),
            "not finite": gel.with_vertices(np.where(gel.vertices > 0.0, np.nan, gel.vertices)),
            "not closed": gel.with_faces(gel.faces[1:]),
            "does not exist": gel.with_faces(gel.faces + len(gel.vertices)),
        }
        for message, mesh in bad.items():
            design.meshes["gel"] = mesh
            with pytest.raises(MeshError, match=f"'gel'.*{message}"):
                save_design(design, folder)
        assert {p: p.read_bytes() for p in folder.rglob("*") if p.is_file()} == before

    def test_other_files_in_the_folder_stay(self, design: SensorDesign, folder: Path) -> None:
        (folder / "notes.txt").write_text("keep me")
        save_design(design, folder)
        assert (folder / "notes.txt").read_text() == "keep me"
        assert not list(folder.rglob("*.tmp"))

    def test_a_file_in_the_way(self, design: SensorDesign, tmp_path: Path) -> None:
        (tmp_path / "sensor").write_text("")
        with pytest.raises(OutputError):
            save_design(design, tmp_path / "sensor")

    @pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
    def test_a_folder_that_cannot_be_written(self, design: SensorDesign, tmp_path: Path) -> None:
        tmp_path.chmod(0o500)
        with pytest.raises(OutputError):
            save_design(design, tmp_path / "sensor")

    def test_two_parts_cannot_share_a_file_with_different_meshes(
        self, design: SensorDesign, tmp_path: Path
    ) -> None:
        design.parts["wall"].mesh = "meshes/gel.stl"  # both would be written as gel.obj
        with pytest.raises(DesignError, match=r"gel\.obj"):
            save_design(design, tmp_path / "sensor")


@pytest.mark.parametrize(
    ("keep", "hint"), [("silver", "Name one of: silver"), ("gel", "Add one of kind conductor")]
)
def test_a_part_without_material_is_offered_those_that_fit(
    tmp_path: Path, design: SensorDesign, keep: str, hint: str
) -> None:
    save_design(design, tmp_path)
    file = tmp_path / "design.yaml"
    data = yaml.safe_load(file.read_text(encoding="utf-8"))
    data["materials"] = {name: data["materials"][name] for name in {"gel", keep}}
    del data["parts"]["mirror"]["material"], data["parts"]["wall"]
    file.write_text(yaml.safe_dump(data), encoding="utf-8")
    with pytest.raises(DesignError, match=r"'mirror' \(mirror\) has no material") as caught:
        load_design(tmp_path)
    assert caught.value.hint is not None and caught.value.hint.startswith(hint)

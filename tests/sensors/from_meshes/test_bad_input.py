"""What is wrong with a CAD file or a recipe is named: the part, the place, what to do."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from step_extra import needs_step, write_step

from optisense.errors import DesignError, LibraryError, MeshError, OptiSenseError
from optisense.sensors.from_meshes import design_from_meshes, guess_recipe
from optisense.sensors.from_meshes.files import unread_files


def error_of(recipe: Any) -> OptiSenseError:
    with pytest.raises(OptiSenseError) as caught:
        design_from_meshes(recipe)
    return caught.value


def holed(cad: Any) -> trimesh.Trimesh:
    mesh = cad.block((-10, -8, 0), (10, 8, 4))
    mesh.update_faces(np.arange(len(mesh.faces)) != 0)
    return mesh


def overlapping(cad: Any) -> trimesh.Trimesh:
    return trimesh.util.concatenate(
        [cad.block((-10, -8, 0), (2, 8, 4)), cad.block((1, -7, 1), (10, 7, 5))]
    )


def sharing_an_edge(cad: Any) -> trimesh.Trimesh:
    return trimesh.util.concatenate(
        [cad.block((-10, -8, 0), (0, 0, 4)), cad.block((0, 0, 0), (10, 8, 4))]
    )


def test_imaging_that_the_library_lacks(cad: Any) -> None:
    error = error_of(cad.write(cad.recipe.replace("pi-v2", "ovm7692, imaging: true")))
    assert isinstance(error, LibraryError) and "no data on distortion, shading" in error.message
    assert str(error.where).endswith("sensor.yaml:8") and "Leave imaging out" in str(error.hint)


class TestFiles:
    @pytest.mark.parametrize(
        ("shape", "message", "advice"),
        [
            (holed, "not closed", "close the opening"),
            (overlapping, "cuts through itself", "Boolean union"),
            (sharing_an_edge, "not manifold", "only touch along an edge"),
        ],
    )
    def test_unfit_solids(self, cad: Any, shape: Any, message: str, advice: str) -> None:
        error = error_of(cad.write(gel=shape(cad)))
        assert isinstance(error, MeshError) and message in error.message
        assert " mm" in error.message  # the place
        assert "part gel (gel.stl)" in str(error.where)
        assert "In the CAD tool" in str(error.hint) and advice in str(error.hint)

    def test_an_opaque_part_with_a_hole_is_told(self, cad: Any) -> None:
        text = cad.recipe.replace("lights:\n", "  case: {file: case.stl, role: blocker}\nlights:\n")
        case = holed(cad).apply_translation((0, 0, -20))
        (note,) = design_from_meshes(cad.write(text, case=case)).notes
        assert note.startswith("case: it is a sheet without mass, as it has a hole of")

    def test_a_file_without_faces(self, cad: Any) -> None:
        file = cad.write()
        (cad.folder / "gel.stl").write_text("solid gel\nendsolid gel\n")
        error = error_of(file)
        assert "no faces" in error.message
        assert "part gel" in str(error.where) and "gel.stl" in str(error.where)
        assert "In the CAD tool: show the body" in str(error.hint)

    def test_a_file_that_is_none(self, cad: Any) -> None:
        file = cad.write()
        (cad.folder / "gel.stl").write_bytes(b"\x00\x01 not a mesh")
        error = error_of(file)
        assert isinstance(error, MeshError) and "gel.stl" in str(error.where)

    def test_a_missing_file_with_the_near_match(self, cad: Any) -> None:
        error = error_of(cad.write(cad.recipe.replace("gel.stl", "gell.stl")))
        assert "there is no file 'gell.stl'" in error.message
        assert error.hint == "Did you mean 'gel.stl'?"
        assert error.where == f"part gel ({cad.folder / 'gell.stl'})"

    def test_a_recipe_that_was_copied_tells_where_it_looked(
        self, cad: Any, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        file = cad.write(cad.recipe.replace("gel.stl", "../cad/gel.stl"))
        copy = cad.folder.parent / "far" / "away" / "sensor.yaml"
        copy.parent.mkdir(parents=True)
        file.rename(copy)
        monkeypatch.chdir(copy.parent)
        error = error_of(Path("sensor.yaml"))
        assert "there is no file '../cad/gel.stl'" in error.message
        looked = os.path.realpath(copy.parent.parent / "cad" / "gel.stl")
        assert error.where == f"part gel ({looked})"

    def test_a_missing_file_in_a_subfolder(self, cad: Any) -> None:
        file = cad.write(cad.recipe.replace("gel.stl", "cad/gell.stl"))
        (cad.folder / "cad").mkdir()
        (cad.folder / "gel.stl").rename(cad.folder / "cad" / "gel.stl")
        assert error_of(file).hint == "Did you mean 'cad/gel.stl'?"

    def test_another_format(self, cad: Any) -> None:
        file = cad.write(cad.recipe.replace("gel.stl", "gel.f3d"))
        (cad.folder / "gel.f3d").write_bytes(b"x")
        assert "STL, OBJ, PLY or STEP" in str(error_of(file).hint)

    @pytest.mark.parametrize(
        ("scale", "units"), [(0.001, "units m,"), (1 / 25.4, "units cm or inch,"), (1e3, "um")]
    )
    def test_units_that_are_plainly_not_mm(self, cad: Any, scale: float, units: str) -> None:
        error = error_of(cad.write(scale=scale))
        assert "if its files are in mm" in error.message
        assert "part gel (gel.stl)" in str(error.where)
        assert "--units" in str(error.hint) and units in str(error.hint)

    def test_one_part_in_another_unit(self, cad: Any) -> None:
        error = error_of(cad.write(gel=cad.shapes()["gel"].apply_scale(0.001)))
        assert "another unit" in error.message and "part gel (gel.stl)" in str(error.where)
        assert "units: m" in str(error.hint)

    def test_a_gel_in_inches(self, cad: Any) -> None:
        """Other parts may be as small; a gel of 0.8 mm on a sensor of 24 mm is none."""
        error = error_of(cad.write(gel=cad.shapes()["gel"].apply_scale(1 / 25.4)))
        assert "0.7874 mm large" in error.message and "part gel (gel.stl)" in str(error.where)
        assert "units: inch" in str(error.hint)

    def test_one_part_that_may_be_in_inches(self, cad: Any) -> None:
        plate = cad.shapes()["plate"].apply_scale(1 / 25.4)
        notes = design_from_meshes(cad.write(plate=plate)).notes
        assert any("part plate (plate.stl) is 0.945 mm" in n and "units: inch" in n for n in notes)

    def test_a_folder_without_cad_files(self, cad: Any) -> None:
        cad.folder.mkdir()
        with pytest.raises(MeshError, match="no CAD files"):
            guess_recipe(cad.folder)

    def test_files_of_other_formats_are_told(self, cad: Any) -> None:
        cad.folder.mkdir()
        for name in ("gel.3mf", "notes.txt", "window.IGS"):
            (cad.folder / name).touch()
        told = "not read: gel.3mf, window.IGS (export as STL, OBJ, PLY or STEP)"
        assert unread_files(cad.folder) == [told]
        with pytest.raises(MeshError) as caught:
            guess_recipe(cad.folder)
        assert caught.value.message == f"there are no CAD files here; {told}"
        cad.shapes()["plate"].export(cad.folder / "thing.stl")
        with pytest.raises(MeshError) as caught:
            guess_recipe(cad.folder)
        assert caught.value.message.endswith(f"thing: blocker; {told}")

    def test_names_that_say_nothing(self, cad: Any) -> None:
        cad.folder.mkdir()
        cad.shapes()["gel"].export(cad.folder / "thing.stl")
        with pytest.raises(MeshError, match="thing: blocker") as caught:
            guess_recipe(cad.folder)
        assert "gel.stl" in str(caught.value.hint)

    def test_objects_of_an_obj_file_are_told(self, cad: Any) -> None:
        cad.folder.mkdir()
        shapes = [cad.shapes()[name] for name in ("gel", "plate")]
        first, text = (trimesh.exchange.obj.export_obj(shape) for shape in shapes)
        second = "\n".join(line for line in text.splitlines() if line[:2] != "f ")
        faces = shapes[1].faces + len(shapes[0].vertices) + 1
        second += "".join(f"\nf {a} {b} {c}" for a, b, c in faces)
        (cad.folder / "all.obj").write_text(f"o gel\n{first}\no plate\n{second}\n")
        with pytest.raises(MeshError, match="all: blocker") as caught:
            guess_recipe(cad.folder)
        assert "all.obj holds 2 objects (gel, plate)" in str(caught.value.hint)

    @needs_step
    @pytest.mark.usefixtures("forks")
    def test_bodies_of_a_step_file_whose_names_say_nothing(self, tmp_path: Path) -> None:
        from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox

        shape = BRepPrimAPI_MakeBox(20.0, 16.0, 4.0).Shape()
        with pytest.raises(MeshError, match="Body1: blocker") as caught:
            guess_recipe(write_step(tmp_path / "sensor.step", {"Body1": (shape, 0.0)}))
        assert "name the bodies or components" in str(caught.value.hint)


class TestRecipes:
    @pytest.mark.parametrize(
        ("old", "new", "line", "message"),
        [
            ("file: gel.stl, role", "fiel: gel.stl, role", 3, "unknown field"),
            ("role: elastomer", "role: elastomr", 3, "elastomr"),
            ("faces_of: gel", "faces_of: gl", 4, "there is no part 'gl'"),
            ("towards: +z", "towards: up", 4, "a direction is"),
            ("towards: +z, ", "", 4, "faces_of needs towards"),
            ("role: sensing_surface", "role: blocker", 2, "no part is a sensing_surface"),
            ("part: plate", "part: plat", 7, "there is no part 'plat'"),
            ("count: 4", "count: 0", 7, "greater than or equal to 1"),
            ("count: 4", "count: 1000000", 7, "less than or equal to 10000"),
            (
                "row: {part: plate, side: +y, count: 4, pitch: 4.5}",
                "over: {faces_of: plate, towards: +y, count: [200, 200]}",
                7,
                "200 x 200 are more",
            ),
            ("side: +y", "side: y+", 7, "must be one of +x"),
            ("colour: red", "colour: pink", 7, "unknown colour"),
            ("row:", "rows:", 7, "unknown field"),
            ("model: smd-3528", "model: smd-3529", 7, "smd-3529"),
            ("model: pi-v2", "model: pi-v9", 8, "pi-v9"),
            ("pi-v2}", "pi-v2, at: [0, 0]}", 8, "camera.at"),
            ("pi-v2}", "pi-v2, look_at: gel, direction: +z}", 8, "not both"),
            ("role: support}", "role: support, material: mirror-silver}", 5, "can't be made of"),
            ("role: support}", "role: support, material: akrylic}", 5, "akrylic"),
            ("name: block", "name: block\njoin: 5", 2, "join"),
            ("name: block", "name: block\nunits: feet", 2, "feet"),
        ],
    )
    def test_mistakes_name_their_line(
        self, cad: Any, old: str, new: str, line: int, message: str
    ) -> None:
        assert old in cad.recipe
        error = error_of(cad.write(cad.recipe.replace(old, new)))
        assert isinstance(error, (DesignError, LibraryError))
        assert message in str(error)
        assert f"sensor.yaml:{line}" in str(error), str(error)

    def test_no_face_looks_there(self, cad: Any) -> None:
        error = error_of(cad.write(cad.recipe.replace("+z", "[1, 1, 1]")))
        assert "no face points to (1, 1, 1)" in error.message
        assert "55 degrees off" in error.message  # arccos(1 / sqrt 3)
        assert "part skin" in str(error.where)

    def test_a_closed_solid_as_sensing_surface(self, cad: Any) -> None:
        text = cad.recipe.replace("{faces_of: gel, towards: +z,", "{file: gel.stl,")
        error = error_of(cad.write(text))
        assert "closed solid" in error.message and "towards: +z" in str(error.hint)

    def test_a_light_in_a_face(self, cad: Any) -> None:
        error = error_of(cad.write(cad.recipe.replace("pitch: 4.5", "pitch: 4.5, gap: 0.0")))
        assert "light 0 of 'red'" in error.message and "lies in a face" in error.message
        assert "0.05 mm is enough" in str(error.hint)

    def test_an_interface_needs_a_material(self, cad: Any) -> None:
        text = cad.recipe.replace(
            "lights:\n", "  film: {faces_of: plate, towards: -z, role: interface}\nlights:\n"
        )
        error = error_of(cad.write(text))
        assert "material" in error.message and "film" in str(error)

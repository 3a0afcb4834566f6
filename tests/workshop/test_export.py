"""Exports by formats of other packages that are at odds with others, or with themselves."""

from __future__ import annotations

from pathlib import Path

import pytest

from optisense.design import Part, Role, SensorDesign
from optisense.errors import DesignError, OutputError, OwnCodeError
from optisense.geometry import TriangleMesh
from optisense.robots import export_robot
from optisense.workshop import FORMATS, ShapeFormat, export


def write(path: Path, title: str, shapes: object) -> None:
    path.write_text(title)


def test_two_formats_that_would_write_the_same_files_are_refused(
    flat: SensorDesign, tmp_path: Path
) -> None:
    with FORMATS.forgetting():
        FORMATS.register("stl2", ShapeFormat(".STL", write))
        with pytest.raises(OutputError, match="formats 'stl' and 'stl2' would both write") as found:
            export(flat, tmp_path / "parts", ["stl", "stl2"])
        assert found.value.hint == "Export them into two folders"
        assert not (tmp_path / "parts").exists()
        files = export(flat, tmp_path / "parts", ["stl2", "stl2"])
    assert (tmp_path / "parts" / "gel.STL").read_text() == flat.name
    assert len(files) == len(set(files))


def with_part_renamed(design: SensorDesign, old: str, new: str) -> SensorDesign:
    """A copy of the design, without cages, in which a part has another name."""
    copy = design.model_copy(deep=True)
    copy.cages = {}
    copy.parts = {new if name == old else name: part for name, part in copy.parts.items()}
    copy.meshes[new] = copy.meshes.pop(old)
    return copy


@pytest.mark.parametrize(
    ("part", "clash"),
    [("wall-1", "wall-1-cut.dxf"), ("gel-mould-front", "gel-mould-front.stl"), ("GEL", "GEL.stl")],
)
def test_no_file_of_a_part_replaces_that_of_another(
    flat: SensorDesign, tmp_path: Path, part: str, clash: str
) -> None:
    """Plates of one part have numbers, and halves of moulds have the name of their gel."""
    design = flat.model_copy(deep=True)
    plate = TriangleMesh.box((0, 0, 40), (20, 10, 42))
    two = TriangleMesh.joined([plate, TriangleMesh.box((0, 0, 50), (8, 8, 52))])
    for name, mesh in (("wall", two), (part, plate)):
        design.parts[name] = Part(role=Role.BLOCKER, mesh=f"meshes/{name}.obj")
        design.meshes[name] = mesh
    with pytest.raises(DesignError, match=f"two files would have the name '{clash}'") as found:
        export(design, tmp_path / "parts", with_moulds=True)
    assert found.value.where == f"parts.{part}"
    assert not (tmp_path / "parts").exists()


def test_files_for_robots_and_those_without_a_part_have_their_own_names(
    flat: SensorDesign, tmp_path: Path
) -> None:
    design = with_part_renamed(flat, "tray", "GEL")
    with pytest.raises(DesignError, match=r"'meshes/GEL.stl' but for upper and lower") as found:
        export_robot(design, tmp_path / "robot")
    assert found.value.hint == "Rename a part, so that neither file overwrites the other"
    placed = with_part_renamed(flat, "tray", "pick-and-place")
    with FORMATS.forgetting(), pytest.raises(DesignError) as without_part:
        FORMATS.register("table", ShapeFormat(".csv", lambda path, *_: path.write_text("")))
        export(placed, tmp_path / "parts", ["table"])
    assert (without_part.value.where, without_part.value.hint) == ("parts", found.value.hint)
    assert not list(tmp_path.iterdir())


def test_a_long_name_keeps_the_file_of_the_moulds_apart(flat: SensorDesign, tmp_path: Path) -> None:
    design = flat.model_copy(update={"name": "n" * 64})
    names = {file.name for file in export(design, tmp_path, "3mf", with_moulds=True)}
    assert {f"{design.name}.3mf", f"{design.name}-moulds.3mf"} <= names


def test_files_of_an_earlier_export_are_named(flat: SensorDesign, tmp_path: Path) -> None:
    """They stay, as the user may need them; and nothing is said of a folder of other files."""
    notes: list[str] = []
    (tmp_path / "mine.txt").write_text("")
    export(flat, tmp_path, "stl", notes)
    assert not notes
    renamed = with_part_renamed(flat, "guide", "holder")
    export(renamed, tmp_path, "stl", notes)
    assert len(notes) == 1
    assert notes[0].endswith("one: guide-cut.dxf, guide-drawing.svg, guide.stl, mine.txt")
    assert (tmp_path / "guide.stl").exists()
    told: list[str] = []
    export_robot(flat, tmp_path / "robot", notes=told)
    export_robot(renamed, tmp_path / "robot", notes=told)
    assert told[-1].endswith("one: meshes/guide-hull.stl, meshes/guide.stl")
    (first, *_) = flat.parts
    export_robot(with_part_renamed(renamed, first, "other"), tmp_path / "robot", notes=told)
    assert told[-1].endswith(f"meshes/guide.stl, meshes/{first}.stl")


def test_a_format_that_fails_is_named(flat: SensorDesign, tmp_path: Path) -> None:
    failing = ShapeFormat(".bad", lambda path, title, shapes: 1 / 0)
    with FORMATS.forgetting():
        FORMATS.register("bad", failing)
        with pytest.raises(OwnCodeError, match="the file format 'bad' fails: ZeroDiv") as told:
            export(flat, tmp_path, "bad")
    assert told.value.where is not None and told.value.where.startswith(__file__)


@pytest.mark.parametrize("holds_all", [False, True])
def test_a_format_that_writes_no_file_is_named(
    flat: SensorDesign, tmp_path: Path, holds_all: bool
) -> None:
    with FORMATS.forgetting():
        FORMATS.register("idle", ShapeFormat(".idle", lambda path, title, shapes: None, holds_all))
        with pytest.raises(OutputError, match="the format 'idle' wrote no file"):
            export(flat, tmp_path / "parts", ["stl", "idle"])
    assert not list((tmp_path / "parts").iterdir())

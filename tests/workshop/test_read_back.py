"""The files of every built-in sensor by readers that are not ours: Open CASCADE, lib3mf, csv."""

from __future__ import annotations

import csv
from collections import Counter
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from step_extra import needs_step

from optisense import sensors
from optisense.design import SensorDesign
from optisense.workshop import export
from optisense.workshop.shapes import Shape, shapes

ROUND = 2e-3
"""Share by which the volume of a body with round faces may differ from that of its mesh, whose
corners lie on them."""

IN_STEP = tuple(each for each in sensors.SENSORS.names() if "ideal" not in each)
"""Sensors whose STEP files are read; ideal GelSight Minis differ in the size of a plate only."""


class Made(NamedTuple):
    """A sensor and its files by name."""

    name: str
    design: SensorDesign
    shapes: list[Shape]
    files: dict[str, Path]


@pytest.fixture(scope="module", params=sensors.SENSORS.names())
def made(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Made:
    design = sensors.build(request.param)
    folder = tmp_path_factory.mktemp("made")
    formats = ["3mf"]
    with suppress(ImportError):
        import OCP.STEPControl  # noqa: F401

        if request.param in IN_STEP:
            formats.append("step")
    notes: list[str] = []
    files = {file.name: file for file in export(design, folder, formats, notes)}
    assert notes == [], "every part is written with exact faces"
    return Made(request.param, design, shapes(design), files)


@needs_step
@pytest.mark.parametrize("made", IN_STEP, indirect=True)
def test_the_step_file(made: Made) -> None:
    """One assembly of named and coloured bodies, sound as it is, of the meshes' volumes."""
    from OCP.BRepCheck import BRepCheck_Analyzer
    from OCP.STEPControl import STEPControl_Reader
    from OCP.TopAbs import TopAbs_SOLID
    from OCP.TopExp import TopExp_Explorer

    from optisense.geometry.step import triangles

    path = made.files[f"{made.name}.step"]
    text = path.read_text(errors="replace")
    assert len(text) < 1_000_000
    assert "OptiSense Studio" in text.split("ENDSEC")[0] and "'Author'" not in text
    assert ".MILLI.,.METRE." in text.replace(" ", "")
    assert "COLOUR_RGB" in text and f"PRODUCT('{made.name}'" in text
    for shape in made.shapes:
        assert f"PRODUCT('{shape.name}'" in text
    assert text.count("NEXT_ASSEMBLY_USAGE_OCCURRENCE") >= len(made.shapes)

    reader = STEPControl_Reader()
    assert "RetDone" in str(reader.ReadFile(str(path)))
    reader.TransferRoots()
    whole: Any = reader.OneShape()
    assert BRepCheck_Analyzer(whole).IsValid(), "no repair is needed"
    found, explorer = 0.0, TopExp_Explorer(whole, TopAbs_SOLID)
    count = 0
    while explorer.More():
        # By triangles: Open CASCADE's integrals over splines of many spans are off by a percent.
        volume = triangles(explorer.Current(), chord=0.02, bend=15.0).volume
        assert volume > 0.0
        found += volume
        count += 1
        explorer.Next()
    wanted = [shape.volume for shape in made.shapes if shape.volume is not None]
    assert count >= len(wanted)
    assert found == pytest.approx(sum(wanted), rel=ROUND)


def test_the_3mf_file(made: Made) -> None:
    """The reference reader finds each part under its name, whole, in mm and without a warning."""
    lib3mf = pytest.importorskip("lib3mf")
    model = lib3mf.get_wrapper().CreateModel()
    reader = model.QueryReader("3mf")
    reader.SetStrictModeActive(True)
    reader.ReadFromFile(str(made.files[f"{made.name}.3mf"]))
    assert reader.GetWarningCount() == 0
    assert model.GetUnit() == lib3mf.ModelUnit.MilliMeter
    meshes, iterator = {}, model.GetMeshObjects()
    while iterator.MoveNext():
        each = iterator.GetCurrentMeshObject()
        meshes[each.GetName()] = each
    assert list(meshes) == [shape.name for shape in made.shapes]
    for shape in made.shapes:
        each = meshes[shape.name]
        assert each.GetVertexCount() == len(shape.mesh.vertices)
        assert each.GetTriangleCount() == len(shape.mesh.faces)
        wanted = lib3mf.ObjectType.Model if shape.is_solid else lib3mf.ObjectType.Surface
        assert each.GetType() == wanted
        box = each.GetOutbox()
        low, high = list(box.MinCoordinate), list(box.MaxCoordinate)
        assert [*low, *high] == pytest.approx(shape.mesh.bounds.reshape(-1), abs=1e-4)


def test_the_tables_of_the_boards(made: Made) -> None:
    """Each LED is placed once and bought once, with an order number."""
    placed: Counter[str] = Counter()
    bought: Counter[str] = Counter()
    for name, path in made.files.items():
        if name.endswith("-cpl.csv"):
            for row in csv.DictReader(path.open(encoding="utf-8", newline="")):
                placed[row["Designator"]] += 1
                assert row["Layer"] in {"Top", "Bottom"}
                for column in ("Mid X", "Mid Y"):
                    float(row[column].removesuffix("mm"))
                assert 0.0 <= float(row["Rotation"]) < 360.0
        elif name.endswith("-bom.csv"):
            for row in csv.DictReader(path.open(encoding="utf-8", newline="")):
                bought.update(row["Designator"].split(","))
                assert row["Comment"] and row["Footprint"].startswith("LED_")
                assert row["Part number"] and "no order number" not in row["Part number"]
    count = sum(len(group.lights) for group in made.design.lights.values())
    assert placed == bought == Counter({f"D{k}": 1 for k in range(1, count + 1)})

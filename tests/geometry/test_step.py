"""STEP files: shapes, places, names and units; and what happens without the extra.

Most files are read in this process: another one imports Open CASCADE, half a second of a processor.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from step_extra import needs_step, write_step

from optisense.errors import MeshError, SetupError
from optisense.geometry.step import NAMELESS, bodies_of, no_step, read_step


def box_and_ball() -> dict[str, tuple[Any, float]]:
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeSphere

    return {
        "gel": (BRepPrimAPI_MakeBox(10.0, 8.0, 4.0).Shape(), 1.0),
        "ball": (BRepPrimAPI_MakeSphere(3.0).Shape(), 20.0),
    }


def two_boxes() -> Any:
    """One shape of two solids."""
    from OCP.BRep import BRep_Builder
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
    from OCP.TopoDS import TopoDS_Compound

    compound, builder = TopoDS_Compound(), BRep_Builder()
    builder.MakeCompound(compound)
    for _ in range(2):
        builder.Add(compound, BRepPrimAPI_MakeBox(1.0, 1.0, 1.0).Shape())
    return compound


@needs_step
@pytest.mark.parametrize("unit", ["MM", "INCH", "M"])
def test_solids_come_in_millimetres_at_their_places(tmp_path: Path, unit: str) -> None:
    gel, ball = bodies_of(write_step(tmp_path / "sensor.step", box_and_ball(), unit))
    assert (gel.name, gel.solid, ball.name, ball.solid) == ("gel", True, "ball", True)
    assert gel.mesh.is_closed and ball.mesh.is_closed
    assert gel.mesh.volume == pytest.approx(320.0)
    assert gel.mesh.bounds == pytest.approx(np.array([[1, 0, 0], [11, 8, 4]]), abs=1e-5)
    assert ball.mesh.volume == pytest.approx(4 / 3 * np.pi * 27, rel=3e-3)
    radius = np.linalg.norm(ball.mesh.vertices - [20, 0, 0], axis=1)
    assert radius == pytest.approx(3.0, abs=1e-5)


@needs_step
def test_triangles_stay_near_the_exact_surface(tmp_path: Path) -> None:
    ball = read_step(write_step(tmp_path / "sensor.step", box_and_ball()))[1].mesh
    depth = 3.0 - np.linalg.norm(ball.triangles.mean(axis=1) - [20, 0, 0], axis=1)
    assert depth.max() < 0.006


@needs_step
def test_a_surface_without_a_solid_is_an_open_body(tmp_path: Path) -> None:
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
    from OCP.gp import gp_Pln

    face = BRepBuilderAPI_MakeFace(gp_Pln(), -2.0, 2.0, -1.0, 1.0).Face()
    (sheet,) = bodies_of(write_step(tmp_path / "sheet.stp", {"skin": (face, 0.0)}))
    assert (sheet.name, sheet.solid) == ("skin", False)
    assert sheet.mesh.area == pytest.approx(8.0)


@needs_step
def test_parts_used_twice_get_numbers(tmp_path: Path) -> None:
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox

    led = BRepPrimAPI_MakeBox(1.0, 1.0, 1.0).Shape()
    bodies = bodies_of(write_step(tmp_path / "a.step", {"led": (led, 0.0)}))
    assert [body.name for body in bodies] == ["led"]
    bodies = bodies_of(write_step(tmp_path / "b.step", {"led": (two_boxes(), 0.0)}))
    assert [body.name for body in bodies] == ["led", "led-2"]


@needs_step
def test_numbered_names_are_not_those_of_other_products(tmp_path: Path) -> None:
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox

    file = tmp_path / "windows.step"
    sizes = {"window": 1.0, "Window": 1.5, "Window-2": 2.0}
    parts = {
        name: (BRepPrimAPI_MakeBox(1.0, 1.0, size).Shape(), 3.0 * size)
        for name, size in sizes.items()
    }
    write_step(file, parts)
    file.write_text(file.read_text().replace("'window'", "'Window'"))
    found = {body.name: body.mesh.bounds[1, 2] for body in bodies_of(file)}
    assert found == pytest.approx({"Window": 1.0, "Window-3": 1.5, "Window-2": 2.0})


@needs_step
@pytest.mark.parametrize("product", ["Studio", f"{NAMELESS} 8.0 1"])
def test_bodies_of_one_product_have_their_own_names(tmp_path: Path, product: str) -> None:
    file = write_step(tmp_path / "a.step", {product: (two_boxes(), 5.0)})
    text = file.read_text()
    for name in (r"Gel-K\X2\00F6\X0\rper", ""):
        text = text.replace("MANIFOLD_SOLID_BREP('',", f"MANIFOLD_SOLID_BREP ('{name}',", 1)
    file.write_text(text)
    assert [body.name for body in bodies_of(file)] == ["Gel-Körper", product]


@needs_step
def test_a_product_without_a_name_has_that_of_its_body(tmp_path: Path) -> None:
    shape = box_and_ball()["gel"]
    for product, expected in ((f"{NAMELESS} 8.0 1", "Gel"), ("Part", "Part")):
        file = write_step(tmp_path / "a.step", {product: shape})
        file.write_text(file.read_text().replace("SOLID_BREP('',", "SOLID_BREP('Gel',"))
        (body,) = bodies_of(file)
        assert body.name == expected
        assert body.mesh.bounds[0] == pytest.approx([1, 0, 0], abs=1e-5)


@needs_step
def test_what_is_no_step_file_is_told(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "bad.step"
    file.write_text("solid ascii\nendsolid\n")
    with pytest.raises(MeshError, match="not a STEP file"):
        read_step(file)
    with pytest.raises(MeshError, match="No such file"):
        read_step(tmp_path / "missing.step")
    assert capfd.readouterr().out == ""


def test_without_the_extra_its_name_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "OCP", None)
    monkeypatch.setitem(sys.modules, "OCP.STEPCAFControl", None)
    with pytest.raises(SetupError) as error:
        read_step(tmp_path / "sensor.step")
    assert "optisense[step]" in (error.value.hint or "")


def test_a_system_without_libgl_is_told_from_a_missing_extra() -> None:
    lacking = ImportError("libGL.so.1: cannot open shared object file: No such file or directory")
    assert "libgl1" in str(no_step(lacking, "reading", "export STL files"))
    assert "optisense[step]" in str(no_step(ImportError("No module named 'OCP'"), "reading", "x"))

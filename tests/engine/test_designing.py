"""Designs in requests: opening, saving, checking, cages, and errors that name the part."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import optisense as ots
from optisense.design import load_design
from optisense.geometry import TriangleMesh
from optisense.sensors import SENSORS


def arrays(mesh: dict[str, str]) -> tuple[Any, Any]:
    return np.load(mesh["vertices"]), np.load(mesh["faces"])


def test_sensors_are_those_of_the_package(engine: Any) -> None:
    assert {row["name"] for row in engine.ask("sensors")["sensors"]} == set(SENSORS.names())


@pytest.mark.parametrize("name", SENSORS.names())
def test_a_design_goes_out_and_comes_back_with_every_field(
    engine: Any, name: str, tmp_path: Path
) -> None:
    engine.ask("save", design=name, to=str(tmp_path / "first"))
    opened = engine.ask("open", design=str(tmp_path / "first"))
    given = {"data": opened["data"], "folder": str(tmp_path / "first")}
    engine.ask("save", design=given, to=str(tmp_path / "second"))
    first, second = load_design(tmp_path / "first"), load_design(tmp_path / "second")
    assert first.model_dump() == second.model_dump() == ots.load(name).model_dump()
    for part, mesh in first.meshes.items():
        assert (mesh.vertices == second.meshes[part].vertices).all()
        vertices, faces = arrays(opened["meshes"][part])
        assert vertices.dtype == np.float32 and faces.dtype == np.int32
        np.testing.assert_allclose(vertices, mesh.vertices, atol=1e-5)
        assert (faces == mesh.faces).all()


def test_shapes_are_what_cages_bend(engine: Any) -> None:
    straight = engine.ask("open", design="gelsight-mini-ideal")
    cage = straight["data"]["cages"]["skin"]
    assert straight["shapes"] == {}
    points = [{**point, "x": point["x"] + 1.0} for point in cage["points"]]
    moved = {"from": "gelsight-mini-ideal", "set": {"cages.skin.points": points}}
    bent = engine.ask("open", design=moved)
    assert set(bent["shapes"]) == {"skin", "gel"}
    before, after = (
        np.load(each["vertices"]) for each in (bent["meshes"]["skin"], bent["shapes"]["skin"])
    )
    np.testing.assert_allclose(
        after - before, np.broadcast_to([1.0, 0.0, 0.0], before.shape), atol=1e-4
    )


def test_cage_weights_are_the_formula_that_is_documented(engine: Any) -> None:
    data = engine.ask("open", design="gelsight-mini-ideal")
    cage = data["data"]["cages"]["skin"]
    weights = np.load(
        engine.ask("cage_weights", design="gelsight-mini-ideal", cage="skin")["weights"]["skin"]
    )
    vertices = ots.load("gelsight-mini-ideal").meshes["skin"].vertices
    lower, upper = np.array(cage["box"])
    nx, ny, nz = cage["resolution"]

    def b(i: int, n: int, t: float) -> float:
        return math.comb(n, i) * t**i * (1.0 - t) ** (n - i)

    for row in (0, 17, len(vertices) - 1):
        t, u, w = (vertices[row] - lower) / (upper - lower)
        for i, j, k in np.ndindex(nx, ny, nz):
            expected = b(i, nx - 1, t) * b(j, ny - 1, u) * b(k, nz - 1, w)
            assert weights[row, (i * ny + j) * nz + k] == pytest.approx(expected, abs=1e-6)


def test_a_cage_is_added_refined_and_settled(engine: Any) -> None:
    one = {"from": "gelsight360"}
    added = engine.ask("cage", design=one, action="add", cage="new", parts=["boards"])["cages"]
    assert added["new"]["resolution"] == [3, 3, 3] and len(added["new"]["points"]) == 27
    data = engine.ask("open", design="gelsight360")
    folder = engine.folder / "caged"
    engine.ask("save", design="gelsight360", to=str(folder))
    caged = {"data": data["data"] | {"cages": added}, "folder": str(folder)}
    finer = engine.ask("cage", design=caged, action="refine", cage="new", resolution=[4, 3, 3])
    assert len(finer["cages"]["new"]["points"]) == 36
    ranged = engine.ask("cage", design=caged, action="range", cage="new", blend=0.5)["cages"]
    assert ranged["new"]["blend"] == 0.5 and len(ranged["new"]["c_max"]) == 27
    short = engine.refused("cage", design=caged, action="range", cage="new", c_max=[[0, 0, 0]])
    assert "27" in short["message"]
    wide = engine.refused("cage", design=one, action="add", cage="w", parts=["boards"], margin=101)
    assert "margin" in wide["message"] and "100" in wide["message"]
    gone = engine.ask("cage", design=caged, action="remove", cage="new")
    assert gone["cages"] == {}


def test_what_check_refuses_names_the_part_and_the_path(engine: Any) -> None:
    board = ots.load("gelsight360").meshes["boards"].vertices[:8].mean(axis=0)
    inside = {"from": "gelsight360", "set": {"camera.position": board.tolist()}}
    rows = engine.ask("check", design=inside)["problems"]
    errors = [row for row in rows if row["severity"] == "error"]
    named = [(row["part"], row["path"]) for row in errors]  # a board reaches into the shell there
    assert named == [("boards", "camera.position"), ("shell", "camera.position")]
    refused = engine.refused("simulate", design=inside)
    assert refused["kind"] == "DesignError"
    assert (refused["part"], refused["path"]) == ("boards", "camera.position")
    assert refused["problems"] == rows


@pytest.mark.parametrize(
    ("change", "part", "path"),
    [
        ({"parts": {"gel": {"material": None}}}, "gel", None),
        ({"parts": {"gel": {"material": "water"}}}, "gel", None),
        ({"parts": {"gel": {"mesh": "meshes/lost.obj"}}}, "gel", "parts.gel.mesh"),
        ({"parts": {"gel": {"mesh": "../../../etc/passwd"}}}, "gel", "parts.gel.mesh"),
        ({"parts": {"gel": {"priority": "high"}}}, "gel", "parts.gel.priority"),
        ({"camera": {"fov": -3}}, None, "camera.fov"),
    ],
)
def test_values_that_make_no_sense_are_placed(
    engine: Any, change: dict[str, Any], part: str | None, path: str | None
) -> None:
    folder = engine.folder / "sound"
    if not folder.exists():
        engine.ask("save", design="gelsight-mini-ideal", to=str(folder))
    data = engine.ask("open", design="gelsight-mini-ideal")["data"]
    for section, inner in change.items():
        for key, value in inner.items():
            data[section][key] = data[section][key] | value if isinstance(value, dict) else value
    error = engine.refused("open", design={"data": data, "folder": str(folder)})
    assert error["kind"] == "DesignError"
    assert error["part"] == part
    assert path is None or error["path"] == path


def test_a_mesh_from_elsewhere_takes_a_parts_place(engine: Any, tmp_path: Path) -> None:
    box = TriangleMesh.box((-9, -7, -20), (9, 7, -19))
    np.save(tmp_path / "v.npy", box.vertices.astype(np.float32))
    np.save(tmp_path / "f.npy", box.faces)
    given = {"vertices": str(tmp_path / "v.npy"), "faces": str(tmp_path / "f.npy")}
    opened = engine.ask("open", design="gelsight-mini-ideal", meshes={"guide": given})
    assert len(np.load(opened["meshes"]["guide"]["vertices"])) == len(box.vertices)
    holed = tmp_path / "holed.obj"
    box.with_faces(box.faces[1:]).save_obj(holed)
    error = engine.refused("open", design="gelsight-mini-ideal", meshes={"guide": str(holed)})
    assert (error["kind"], error["part"]) == ("MeshError", "guide")
    told = engine.ask("mesh", file=str(holed), role="support")
    assert "open" in told["problem"]["message"] or "closed" in told["problem"]["message"]
    assert engine.ask("mesh", file=str(holed), role="mirror")["problem"] is None
    assert (
        "gude"
        in engine.refused("open", design="gelsight-mini-ideal", meshes={"gude": given})["message"]
    )


def test_the_button_that_makes_a_sensing_surface_is_named(engine: Any) -> None:
    data = engine.ask("open", design="gelsight-mini-ideal")["data"]
    data["parts"]["skin"]["role"] = "blocker"
    error = engine.refused("check", design={"data": data, "folder": str(engine.folder)})
    assert "no part is a sensing_surface" in error["message"]
    assert "Make Sensing Surface" in error["hint"]


def test_files_that_changed_are_read_again(engine: Any, tmp_path: Path) -> None:
    folder = tmp_path / "design"
    engine.ask("save", design="gelsight-mini-ideal", to=str(folder))
    assert engine.ask("open", design=str(folder))["data"]["name"] == "gelsight-mini-ideal"
    file = folder / "design.yaml"
    file.write_text(file.read_text().replace("name: gelsight-mini-ideal", "name: another"))
    assert engine.ask("open", design=str(folder))["data"]["name"] == "another"
    refused = engine.refused("save", design="gelsight-mini-ideal", to=str(folder), only_new=True)
    assert refused["kind"] == "OutputError"


def test_a_design_that_could_not_be_opened_again_is_not_saved(engine: Any, tmp_path: Path) -> None:
    folder = tmp_path / "sensor"
    engine.ask("save", design="gelsight-mini-ideal", to=str(folder))
    before = (folder / "design.yaml").read_bytes()
    opened = engine.ask("open", design=str(folder))
    lower, upper = opened["data"]["cages"]["skin"]["box"]
    opened["data"]["cages"]["skin"]["box"] = [lower, [*upper[:2], (lower[2] + upper[2]) / 2]]
    given = {"data": opened["data"], "folder": str(folder)}
    refused = engine.refused("save", design=given, to=str(folder))
    assert "lie outside the box of the cage" in refused["message"]
    assert (folder / "design.yaml").read_bytes() == before


def test_a_design_that_was_changed_on_disk_is_not_overwritten(engine: Any, tmp_path: Path) -> None:
    folder = tmp_path / "design"
    first = engine.ask("save", design="gelsight-mini-ideal", to=str(folder))
    assert first["source_digest"] is None
    copied = engine.ask("save", design=str(folder), to=str(tmp_path / "copy"))
    assert copied["source_digest"] == first["digest"]

    def save(**fields: Any) -> Any:
        return {"design": "gelsight-mini-ideal", "to": str(folder), **fields}

    assert engine.ask("save", **save(digest=first["digest"]))["digest"] == first["digest"]
    for name in ("design.yaml", "meshes/gel.obj"):
        file = folder / name
        text = file.read_text()
        file.write_text(text + "# another program was here\n")
        refused = engine.refused("save", **save(digest=first["digest"]))
        assert refused["kind"] == "OutputError" and "changed on disk" in refused["message"]
        file.write_text(text)
    (folder / "design.yaml").unlink()
    assert engine.ask("save", **save(digest=first["digest"]))["digest"] == first["digest"]


def test_the_library_is_listed_drawn_and_added_to(engine: Any) -> None:
    for kind in ("material", "coating", "light", "camera"):
        rows = engine.ask("library", kind=kind)["entries"]
        assert rows and all(row["description"] for row in rows)
        assert kind != "material" or {"dielectric", "conductor"} <= {row["kind"] for row in rows}
    picture = engine.ask("preview", kind="coating", entry="diffuse-grey")["files"]["picture"]
    assert Path(picture).read_bytes().startswith(b"\x89PNG")
    ball = engine.ask("preview", kind="coating", entry="diffuse-grey", ball=True, name="ball")
    with Image.open(ball["files"]["picture"]) as drawn_ball:
        assert drawn_ball.size == (160, 160)
        middle = np.asarray(drawn_ball.convert("RGB"))[60:100, 60:100]
        assert 20 < middle.mean() < 235 and middle.std() > 1  # shaded, not a flat patch
    assert engine.refused("preview", kind="light", entry="smd-3528", ball=True)["where"] == "ball"
    value = engine.ask("entry", kind="coating", entry="diffuse-grey")["entry"]["value"]
    value["specularity"] = 0.25
    added = engine.ask(
        "library_add", kind="coating", entry="mine", value=value, description="Sprayed"
    )
    assert Path(added["file"]).is_relative_to(engine.folder / "own-library")
    found = engine.ask("entry", kind="coating", entry="mine")
    assert found["own"] and found["entry"]["value"]["specularity"] == 0.25
    again = engine.refused(
        "library_add", kind="coating", entry="mine", value=value, description="Sprayed"
    )
    assert again["kind"] == "LibraryError"
    assert again["hint"].startswith("Choose another name") and "--" not in again["hint"]
    value["specularity"] = 7
    drawn = engine.refused("preview", kind="coating", value=value)
    assert drawn["kind"] == "LibraryError" and "specularity" in drawn["message"]
    assert engine.refused("entry", kind="light", entry="smd-3529")["hint"]


def test_the_remedies_of_export_fit_their_errors(engine: Any, tmp_path: Path) -> None:
    taken = tmp_path / "taken"
    taken.write_text("a file")
    for to, remedy in ((taken, "choose another one"), (tmp_path / ("b" * 300), "a shorter name")):
        refused = engine.refused("export", design="gelsight-mini-ideal", to=str(to))
        assert refused["kind"] == "OutputError" and remedy in refused["hint"]


def test_files_for_the_workshop(engine: Any, tmp_path: Path) -> None:
    given = {"design": "gelsight-mini-ideal", "to": str(tmp_path), "formats": ["stl"]}
    written = engine.ask("export", moulds=True, **given)
    files = written["files"]
    assert written["notes"][0].startswith("gel-mould: 391 mm^2 of the gel's sides")
    assert any("mould" in file for file in files)
    assert {Path(file).name for file in files} >= {"gel.stl", "bill-of-materials.csv"}
    assert all(Path(file).is_file() for file in files)


SAME = 0.004
"""Mean difference of pixels (0 to 1) up to which drafts are the same: one level of 256. On another
kind of processor, rounding changes a few photons."""


@pytest.mark.parametrize("name", SENSORS.names())
def test_the_draft_of_an_opened_sensor_is_the_one_that_the_engine_makes(
    engine: Any, name: str
) -> None:
    opened = engine.ask("open", design=name)
    made = engine.ask("simulate", design=name, draft=True, files=["pixels"])
    stored, fresh = np.load(opened["draft"]), np.load(made["files"]["pixels"])
    assert stored.shape == fresh.shape
    off = float(np.abs(stored - fresh).mean())
    assert off < SAME, f"run python scripts/stored_drafts.py: drafts of {name} differ by {off:.3f}"


def test_a_saved_sensor_has_the_draft_until_it_is_changed(engine: Any, tmp_path: Any) -> None:
    folder = str(tmp_path / "sensor")
    engine.ask("save", design="digit", to=folder)
    assert engine.ask("open", design=folder)["draft"] is not None
    brighter = {"from": folder, "set": {"lights.red.flux": 2.0}}
    assert engine.ask("open", design=brighter)["draft"] is None
    housing = engine.ask("open", design=folder)["meshes"]["housing"]
    moved = str(tmp_path / "housing.npy")
    np.save(moved, np.load(housing["vertices"]) + 0.1)
    meshes = {"housing": {"vertices": moved, "faces": housing["faces"]}}
    assert engine.ask("open", design=folder, meshes=meshes)["draft"] is None

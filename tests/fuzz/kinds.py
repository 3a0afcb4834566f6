"""Kinds of untrusted input, and the function that reads each."""

from __future__ import annotations

import io
import json
import sqlite3
import struct
import tempfile
import zipfile
from collections.abc import Callable
from contextlib import closing, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from hypothesis import strategies as st
from PIL import Image
from pydantic import TypeAdapter

import optisense as ots
from optisense import library
from optisense.calibration import read_photographs
from optisense.design import SensorDesign, check_design, save_design
from optisense.design.ies import read_ies
from optisense.geometry import TriangleMesh
from optisense.geometry.step import read_step
from optisense.library.storage import KINDS as ENTRY_KINDS
from optisense.library.storage import read_entry
from optisense.library.tuning import read_tuning
from optisense.search import Study
from optisense.search.study.applied import design_of
from optisense.search.study.settings import StudySettings
from optisense.sensors.from_meshes.building import design_from_meshes
from optisense.sensors.from_meshes.recipe import Recipe
from optisense.tasks.dataset import Dataset
from optisense.tasks.dataset_tables import _Info as DatasetInfo

from .cases import Case, read_case
from .strategies import Schema, spoilt, spoilt_bytes, strange_numbers, strange_texts

ASSETS = Path(__file__).parents[1] / "assets"
LIBRARY = Path(library.__file__).parent


@dataclass(frozen=True)
class InputKind:
    """One kind of input.

    Attributes:
        cases: makes malformed ones.
        read: reads the files of a case in a folder, as a user would; raises an `OptiSenseError`
            where it can't.
        weight: share of the time that the kind gets, relative to others.
    """

    cases: st.SearchStrategy[Case]
    read: Callable[[Path], object]
    weight: float = 1.0


KINDS: dict[str, InputKind] = {}


class RefusedError(Exception):
    """What was given is refused in words, by other means than an `OptiSenseError`."""


def kind(name: str, cases: st.SearchStrategy[Case], weight: float = 1.0) -> Any:
    """Register the function that reads a kind of input."""

    def register(read: Callable[[Path], object]) -> Callable[[Path], object]:
        KINDS[name] = InputKind(cases, read, weight)
        return read

    return register


def _yaml(data: Any) -> bytes:
    return yaml.safe_dump(data, allow_unicode=True, sort_keys=False).encode("utf-8", "replace")


def _json(data: Any) -> bytes:
    return json.dumps(data).encode()


def _mostly(one: st.SearchStrategy[Any], other: st.SearchStrategy[Any]) -> st.SearchStrategy[Any]:
    """Draw four of five values from the first strategy."""
    return st.integers(0, 4).flatmap(lambda number: one if number else other)


def _with_file(case: Case, name: str, contents: st.SearchStrategy[bytes]) -> Any:
    return contents.map(lambda data: {**case, name: data})


def _document(case: Case, name: str, schema: Schema | None, dump: Any, load: Any) -> Any:
    """Cases with one file spoilt, by its values or by its bytes."""
    return _mostly(
        _with_file(case, name, spoilt(load(case[name]), schema).map(dump)),
        _with_file(case, name, spoilt_bytes(case[name])),
    )


# ---- designs

DESIGN = read_case(ASSETS / "design-v1")


@kind("design", _document(DESIGN, "design.yaml", SensorDesign.model_json_schema(), _yaml,
                          yaml.safe_load), 3.0)  # fmt: skip
def read_design(folder: Path) -> None:
    """Open, check, bend, draw and save it; what was saved opens again."""
    design = ots.load(folder)
    check_design(design, light_names=library.names("light"))
    design.deformed_meshes()
    design._repr_html_()
    again = folder.with_name(folder.name + "-saved")
    save_design(design, again)
    assert ots.load(again).model_dump() == design.model_dump()


# ---- meshes and lamps

SKIN = TriangleMesh.load(ASSETS / "design-v1" / "meshes" / "gel.obj")


def _stl(mesh: TriangleMesh) -> bytes:
    head = b"binary".ljust(80) + struct.pack("<I", len(mesh.faces))
    rows = [struct.pack("<12fH", *(0.0,) * 3, *each.ravel(), 0) for each in mesh.triangles]
    return head + b"".join(rows)


def _ascii_stl(mesh: TriangleMesh) -> bytes:
    lines = ["solid gel"]
    for triangle in mesh.triangles:
        corners = [f"vertex {x!r} {y!r} {z!r}" for x, y, z in triangle.tolist()]
        lines += ["facet normal 0 0 1", "outer loop", *corners, "endloop", "endfacet"]
    return "\n".join([*lines, "endsolid gel", ""]).encode()


def _ply(mesh: TriangleMesh, binary: bool) -> bytes:
    form = "binary_little_endian" if binary else "ascii"
    head = "".join(f"{line}\n" for line in (
        "ply", f"format {form} 1.0", f"element vertex {len(mesh.vertices)}", "property float x",
        "property float y", "property float z", f"element face {len(mesh.faces)}",
        "property list uchar int vertex_indices", "end_header",
    )).encode()  # fmt: skip
    if binary:
        corners = b"".join(struct.pack("<3f", *each) for each in mesh.vertices)
        return head + corners + b"".join(struct.pack("<B3i", 3, *each) for each in mesh.faces)
    rows = [" ".join(map(str, each)) for each in mesh.vertices.tolist()]
    rows += [" ".join(map(str, [3, *each])) for each in mesh.faces.tolist()]
    return head + "\n".join([*rows, ""]).encode()


MESHES: dict[str, bytes] = {
    "mesh.obj": DESIGN["meshes/gel.obj"],
    "binary.stl": _stl(SKIN),
    "text.stl": _ascii_stl(SKIN),
    "text.ply": _ply(SKIN, binary=False),
    "binary.ply": _ply(SKIN, binary=True),
}


@st.composite
def _obj_lines(draw: st.DrawFn) -> bytes:
    """An OBJ file whose numbers are strange, one here and one there."""
    lines = DESIGN["meshes/gel.obj"].decode().splitlines()
    for _ in range(draw(st.integers(1, 5))):
        at = draw(st.integers(0, len(lines) - 1))
        words = lines[at].split() or ["v"]
        words[draw(st.integers(0, len(words) - 1))] = str(draw(strange_numbers | strange_texts))
        lines[at] = " ".join(words)
    return "\n".join(lines).encode("utf-8", "replace")


@kind("mesh", st.one_of(
    [_with_file({}, name, spoilt_bytes(data)) for name, data in MESHES.items()]
    + [_with_file({}, "mesh.obj", _obj_lines())]
))  # fmt: skip
def read_mesh(folder: Path) -> None:
    """Read it and check it, as a sheet and as a solid."""
    for path in folder.iterdir():
        mesh = TriangleMesh.load(path)
        mesh.validate("sheet", closed=False)
        mesh.validate("solid", closed=True)


STEP = (ASSETS / "box.step").read_bytes()


@kind("step", _with_file({}, "box.step", spoilt_bytes(STEP)), 2.0)
def read_step_file(folder: Path) -> None:
    """Read the bodies of a STEP file, where the extra for it is installed."""
    for body in read_step(folder / "box.step"):
        body.mesh.validate("body", closed=False)


IES = (LIBRARY / "lights" / "osram-topled-black-30.ies").read_bytes()


@st.composite
def _ies_words(draw: st.DrawFn) -> bytes:
    words = IES.split(b" ")
    for _ in range(draw(st.integers(1, 4))):
        at = draw(st.integers(0, len(words) - 1))
        value = draw(strange_numbers | strange_texts)
        words[at] = str(value).encode("utf-8", "replace")
    return b" ".join(words)


@kind("ies", st.one_of(_with_file({}, "lamp.ies", spoilt_bytes(IES)),
                       _with_file({}, "lamp.ies", _ies_words())))  # fmt: skip
def read_lamp(folder: Path) -> None:
    """Read an IES file and integrate its intensity."""
    assert read_ies(folder / "lamp.ies").lumens >= 0.0


# ---- the library

ENTRIES = {
    "light": LIBRARY / "lights" / "osram-topled-black-30.yaml",
    "camera": LIBRARY / "cameras" / "pi-hq-6mm.yaml",
    "material": LIBRARY / "materials.yaml",
    "coating": LIBRARY / "coatings.yaml",
}


def _entry_cases(name: str) -> st.SearchStrategy[Case]:
    data = yaml.safe_load(ENTRIES[name].read_bytes())
    if name in ("material", "coating"):
        data = max(data.values(), key=lambda entry: len(str(entry)))
    case = {f"{name}.yaml": _yaml(data), "osram-topled-black-30.ies": IES}
    schema = TypeAdapter(ENTRY_KINDS[name]).json_schema()  # type: ignore[index]
    return _document(case, f"{name}.yaml", schema, _yaml, yaml.safe_load)


@kind("entry", st.one_of([_entry_cases(name) for name in ENTRIES]))
def read_library_entry(folder: Path) -> None:
    """Read an entry of the library."""
    for path in folder.glob("*.yaml"):
        entry = read_entry(path.stem, path)  # type: ignore[arg-type]
        entry.unsourced()


GAIN = np.round(np.linspace(1.0, 2.0, 192), 3).tolist()
MATRIX = [1.8, -0.5, -0.3, -0.4, 1.7, -0.3, -0.1, -0.6, 1.7]
TUNING = {
    "rpi.black_level": {"black_level": 2048},
    "rpi.noise": {"reference_constant": 10, "reference_slope": 4.0},
    "rpi.awb": {"ct_curve": [3000.0, 0.8, 0.4, 6000.0, 0.5, 0.7]},
    "rpi.alsc": {
        "luminance_strength": 0.6,
        "luminance_lut": GAIN,
        "calibrations_Cr": [{"ct": 3000, "table": GAIN}, {"ct": 5500, "table": GAIN}],
    },
    "rpi.contrast": {"gamma_curve": [0, 0, 6144, 20790, 32768, 54876, 65535, 65535]},
    "rpi.ccm": {"ccms": [{"ct": 6000, "ccm": MATRIX}, {"ct": 4000, "ccm": MATRIX}]},
}


TUNING_CASE = {"camera.json": _json(TUNING)}


@kind("tuning", _document(TUNING_CASE, "camera.json", None, _json, json.loads))
def read_camera_tuning(folder: Path) -> None:
    """Read a tuning file of libcamera."""
    read_tuning(folder / "camera.json")


RECIPE = b"""\
name: block
parts:
  gel: {file: gel.stl, role: elastomer}
  skin: {faces_of: gel, towards: +z, role: sensing_surface}
  plate: {file: plate.stl, role: support}
lights:
  red: {model: smd-3528, colour: red, row: {part: plate, side: +y, count: 4, pitch: 4.5}}
  blue: {model: smd-3528, colour: blue, from: {file: board.csv, only: D*, origin: [0, 0, 1]}}
camera: {model: pi-v2}
"""
BLOCK = {
    "gel.stl": _stl(TriangleMesh.box((-10, -8, 0), (10, 8, 4))),
    "plate.stl": _stl(TriangleMesh.box((-12, -10, -3), (12, 10, 0))),
    "board.csv": b"""\
Designator,Mid X,Mid Y,Rotation,Layer
D1,-4.5mm,11mm,90,top
D2,4.5mm,11mm,90,top
R1,100mil,2.5mm,0,bottom
""",
    "sensor.yaml": RECIPE,
}


@kind("recipe", _mostly(
    _document(BLOCK, "sensor.yaml", Recipe.model_json_schema(), _yaml, yaml.safe_load),
    _with_file(BLOCK, "board.csv", spoilt_bytes(BLOCK["board.csv"])),
))  # fmt: skip
def read_recipe_file(folder: Path) -> None:
    """Make a sensor of CAD files by a recipe."""
    design_from_meshes(folder / "sensor.yaml")


# ---- studies and datasets

STUDY = read_case(ASSETS / "study-v1")
COLUMNS = ("number", "generation", "place", "vector", "done", "scores", "failure", "parts",
           "gradient", "seconds", "worker", "finished")  # fmt: skip
CELLS: tuple[Any, ...] = (
    None, "text", "", b"", b"1234567", bytes(8), bytes(16), b"\xff" * 8, -1, 2**40, 1.5,
    float("inf"), "{", "[1]", '{"a": 1}', '{"a": {"b": NaN}}', '{"a":' * 5000,
    "\x1b[2J", "9" * 5000,
)  # fmt: skip


@st.composite
def _spoilt_rows(draw: st.DrawFn) -> Case:
    """A store in which cells hold something else."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "trials.sqlite"
        path.write_bytes(STUDY["trials.sqlite"])
        with closing(sqlite3.connect(path)) as db, db:
            db.execute("pragma writable_schema = on")
            for _ in range(draw(st.integers(1, 3))):
                value = draw(st.sampled_from(CELLS))
                fact, column = st.sampled_from(["settings", "study", "design"]), None
                if draw(st.integers(0, 4)):
                    column = draw(st.sampled_from(COLUMNS))
                    words = f"update or ignore trials set {column} = ? where number = ?"
                    asked: tuple[Any, ...] = (value, draw(st.integers(0, 3)))
                else:
                    words = "update or ignore facts set value = ? where name = ?"
                    asked = (value, draw(fact))
                with suppress(sqlite3.Error):  # SQLite refuses some values by itself
                    db.execute(words, asked)
        return {**STUDY, "trials.sqlite": path.read_bytes()}


@kind("study", st.one_of(
    _document(STUDY, "study.json", TypeAdapter(StudySettings).json_schema(), _json, json.loads),
    _spoilt_rows(),
    _with_file(STUDY, "trials.sqlite", spoilt_bytes(STUDY["trials.sqlite"])),
), 3.0)  # fmt: skip
def read_study(folder: Path) -> None:
    """Open a study, read all its trials, and load the design of the best one."""
    with closing(Study.open(folder)) as study:
        for trial in study.trials:
            assert trial.values is not None and trial.number >= 0
        assert study.front is not None
        design_of(study, study.trial("best"))
        study.evaluator()


DATASET = read_case(ASSETS / "dataset-v1")


@st.composite
def _spoilt_arrays(draw: st.DrawFn, case: Case) -> Case:
    """Arrays of other names, shapes, types or values, or members that are no arrays."""
    name = draw(st.sampled_from([name for name in case if name.endswith(".npz")]))
    with np.load(io.BytesIO(case[name])) as file:
        arrays = dict(file)
    key = draw(st.sampled_from(sorted(arrays)))
    change: Callable[[Any], Any] = draw(st.sampled_from([
        lambda a: np.atleast_1d(a)[:1], lambda a: np.atleast_1d(a)[..., :0], lambda a: a.T,
        lambda a: a.astype("U4"), lambda a: a.astype(complex), lambda a: a.astype("f2"),
        lambda a: np.full(a.shape, np.nan), lambda a: a * 1e308, lambda a: -a.astype(float),
        lambda a: np.array(None), lambda a: np.zeros((3, 3)), lambda a: a[None], lambda a: None,
        lambda a: np.full(a.shape, np.datetime64("NaT")), _member, _member,
    ]))  # fmt: skip
    changed = change(arrays.pop(key))
    buffer = io.BytesIO()
    with np.errstate(all="ignore"):
        arrays |= {key: changed} if isinstance(changed, np.ndarray) else {}
        np.savez_compressed(buffer, **arrays)
    if isinstance(changed, bytes):
        with zipfile.ZipFile(buffer, "a") as archive:
            archive.writestr(key + ".npy", draw(spoilt_bytes(changed)))
    return {**case, name: buffer.getvalue()}


def _member(array: Any) -> bytes:
    """An array as a member of an NPZ file has it."""
    buffer = io.BytesIO()
    np.save(buffer, array)
    return buffer.getvalue()


@kind("dataset", st.one_of(
    _document(DATASET, "dataset.json", DatasetInfo.model_json_schema(), _json, json.loads),
    _spoilt_arrays(DATASET),
    *[_with_file(DATASET, name, spoilt_bytes(DATASET[name])) for name in (
        "metadata.csv", "failures.csv", "background.npz", "arrays/000000.npz", "images/000000.png",
    )],
), 3.0)  # fmt: skip
def read_dataset(folder: Path) -> None:
    """Open a dataset and read every sample."""
    dataset = Dataset.load(folder)
    shapes = {sample.depth.shape for sample in dataset}
    assert len(shapes) <= 1
    dataset.background()


# ---- photographs


def _photographs() -> Case:
    """A folder of photographs in each of the layouts that are read."""
    picture = io.BytesIO()
    grey = np.full((48, 60, 3), 90, np.uint8)
    Image.fromarray(grey).save(picture, format="PNG")
    label, pack = io.BytesIO(), io.BytesIO()
    np.savez(label, center=np.array([12, 14]), radius=np.array(5))
    labels = {"touch_center": np.array([[12, 14]]), "touch_radius": np.array([5])}
    np.savez(pack, f0=grey, imgs=grey[None], **labels)
    return {
        "own/background.png": picture.getvalue(),
        "own/a.png": picture.getvalue(),
        "own/presses.csv": b"file,diameter,indenter,column,row,radius\na.png,6,,12,14,5\n",
        "sdk/background.png": picture.getvalue(),
        "sdk/6mm/0/gelsight.png": picture.getvalue(),
        "sdk/6mm/0/label.npz": label.getvalue(),
        "sdk/catalog.csv": b"experiment_reldir,diameter(mm)\n6mm/0,6.0\n",
        "taxim/dataPack.npz": pack.getvalue(),
    }


PHOTOGRAPHS = _photographs()


@kind("photographs", st.one_of(
    *[_with_file(PHOTOGRAPHS, name, spoilt_bytes(PHOTOGRAPHS[name])) for name in PHOTOGRAPHS],
    _spoilt_arrays(PHOTOGRAPHS), _spoilt_arrays(PHOTOGRAPHS),
))  # fmt: skip
def read_photograph_folders(folder: Path) -> None:
    """Read the folders of all layouts."""
    for name in ("own", "sdk", "taxim"):
        found = read_photographs(folder / name, 4.0)
        assert all(press.picture.shape == found.background.shape for press in found.presses)
        found.scaled(40).warnings()


WHOLE: dict[str, Case] = {
    "design": DESIGN,
    "mesh": MESHES,
    "step": {"box.step": STEP},
    "ies": {"lamp.ies": IES},
    "tuning": TUNING_CASE,
    "recipe": BLOCK,
    "study": STUDY,
    "dataset": DATASET,
    "photographs": PHOTOGRAPHS,
}
"""Valid cases, which are then damaged."""

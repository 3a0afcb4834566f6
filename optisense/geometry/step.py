"""Reading STEP files, with the extra `step` (Open CASCADE through cadquery-ocp).

A STEP file states its units and holds exact surfaces, which this module triangulates. The calls
used are the same in the releases of Open CASCADE from 7.8 to 8.
"""

from __future__ import annotations

import io
import json
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from importlib.util import find_spec
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

from optisense import errors
from optisense.errors import MeshError, OptiSenseError, SetupError
from optisense.geometry._welding import merged_vertices
from optisense.geometry.mesh import TriangleMesh
from optisense.untrusted_files import MOST_STEP, check_size

SUFFIXES = (".step", ".stp")

CHORD = 0.003
"""Largest distance (mm) between the triangles and the exact surface: a third of the tolerance to
which parts are made (0.01 mm and more)."""

BEND = 6.0
"""Largest angle (degrees) between neighbouring triangles on a curved surface: 60 triangles around a
cylinder, whose shading normals are then interpolated."""

_WELD = 1e-5
"""Distance (mm) within which vertices of neighbouring faces are merged: the accuracy with which
Open CASCADE's triangles of neighbouring faces meet."""

NAMELESS = "Open CASCADE STEP translator"
"""Beginning of the names that Open CASCADE, and tools that write with it, give to products without
a name."""

BODIES_FILE, ERROR_FILE = "bodies.npz", "wrong.json"
"""Files that the process writes into its folder: the bodies found, or the error."""

READER = "optisense.geometry._step_process"
"""Module of the process that reads a file."""


@dataclass(frozen=True)
class StepBody:
    """A solid, or a surface that is part of none.

    Attributes:
        name: name of its product in the file, or its own one if the product has several bodies;
            numbered if several bodies share it.
        mesh: the mesh in the frame of the whole file, mm.
        solid: whether it is a solid.
        kind: number that bodies of one name in one assembly share, such as copies of an LED.
    """

    name: str
    mesh: TriangleMesh
    solid: bool
    kind: int


def no_step(error: ImportError, action: str, instead: str, where: Path | None = None) -> SetupError:
    """Return the error to raise if Open CASCADE cannot be imported for "reading" or "writing", with
    the hint what a user can do instead.
    """
    place = None if where is None else str(where)
    library = re.match(r"(lib[^:]*\.so[^:]*):", str(error))
    if library:
        return SetupError(
            f"{action} STEP files needs {library[1]}, which this system lacks",
            where=place,
            hint=f"On Debian and Ubuntu: sudo apt-get install libgl1. Or {instead}",
        )
    return SetupError(
        f"{action} STEP files needs the extra 'step', which is not installed",
        where=place,
        hint=f"pip install 'optisense[step]', or {instead}",
    )


def read_step(path: str | Path) -> list[StepBody]:
    """Read all bodies of a STEP file, in its order, placed by its assembly.

    Another process reads it, because some malformed files crash Open CASCADE
    (`optisense.geometry._step_process`).

    Raises:
        SetupError: the extra is not installed.
        MeshError: the file is missing, is not STEP, or holds no faces.
    """
    path = Path(path)
    if find_spec("OCP") is None:
        raise no_step(ImportError("OCP"), "reading", "export STL files from the CAD tool", path)
    check_size(path, MOST_STEP, MeshError, "the STEP file")
    return _read_apart(path)


def _read_apart(path: Path) -> list[StepBody]:
    """Read the bodies of a STEP file in a separate process, and raise the error that it tells."""
    with tempfile.TemporaryDirectory(prefix="optisense-") as folder:
        search = os.pathsep.join(each or str(Path.cwd()) for each in sys.path)
        done = subprocess.run(
            [sys.executable, "-m", READER, str(path.absolute()), folder],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            env={**os.environ, "PYTHONPATH": search},
        )
        wrong = Path(folder, ERROR_FILE)
        if wrong.exists():
            report = json.loads(wrong.read_text(encoding="utf-8"))
            kind: type[OptiSenseError] = getattr(errors, report.pop("kind"))
            raise kind(report.pop("message"), **report)
        if done.returncode:
            raise MeshError(
                "reading the STEP file has failed: it is damaged, or takes too much time or memory",
                where=str(path),
                hint="In the CAD tool: export it again as STEP AP214 or AP242, or as STL",
            )
        with np.load(Path(folder, BODIES_FILE), allow_pickle=False) as found:
            return [
                StepBody(
                    str(name),
                    TriangleMesh(found[f"vertices{n}"], found[f"faces{n}"]),
                    bool(found["solids"][n]),
                    int(found["kinds"][n]),
                )
                for n, name in enumerate(found["names"])
            ]


def bodies_of(path: Path) -> list[StepBody]:
    """Read the bodies of a STEP file in this process.

    Raises:
        SetupError: Open CASCADE cannot be imported.
        MeshError: the file is not STEP, or holds no faces.
    """
    try:
        from OCP.STEPCAFControl import STEPCAFControl_Reader
        from OCP.TCollection import TCollection_ExtendedString
        from OCP.TDocStd import TDocStd_Document
        from OCP.XCAFDoc import XCAFDoc_DocumentTool
    except ImportError as error:
        raise no_step(error, "reading", "export STL files from the CAD tool", path) from error
    quiet()
    reader = STEPCAFControl_Reader()
    reader.SetNameMode(True)
    # Open CASCADE opens no file whose name is not UTF-8.
    status = reader.ReadStream("step", io.BytesIO(path.read_bytes()))
    document = TDocStd_Document(TCollection_ExtendedString("XmlOcaf"))
    if "RetDone" not in str(status) or not reader.Transfer(document):
        raise MeshError(
            "the file is not a STEP file that can be read",
            where=str(path),
            hint="In the CAD tool: export it again as STEP AP214 or AP242",
        )
    tool = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    transfers = reader.Reader().WS().TransferReader()
    bodies = []
    kinds: dict[tuple[int, str], int] = {}
    for assembly, product, shape, place in _products(tool.Label()):
        within = list(_bodies(shape))
        by_bodies = len(within) > 1 or product.startswith(NAMELESS)
        for solid, body in within:
            mesh = triangles(body.Moved(place, False))
            if len(mesh.faces):
                name = (by_bodies and _name_of_body(transfers, body)) or product
                kind = kinds.setdefault((assembly, name), len(kinds))
                bodies.append(StepBody(name, mesh, solid, kind))
    if not bodies:
        raise MeshError(
            "the STEP file holds no faces",
            where=str(path),
            hint="In the CAD tool: show the solid bodies and export them; sketches, points and "
            "hidden bodies have no faces",
        )
    labels = _unique([body.name for body in bodies])
    return [replace(body, name=label) for body, label in zip(bodies, labels, strict=True)]


def _unique(names: list[str]) -> list[str]:
    """Return the names with numbers at the second and further ones of a kind, in their order.

    A number that makes another of the names is skipped.
    """
    taken, used, labels = set(names), dict[str, int](), list[str]()
    for name in names:
        label = name
        while name in used and label in taken:
            used[name] += 1
            label = f"{name}-{used[name]}"
        used.setdefault(name, 1)
        taken.add(label)
        labels.append(label)
    return labels


def quiet() -> None:
    """Keep Open CASCADE from printing its own messages on standard output."""
    from OCP.Message import Message

    messenger: Any = Message.DefaultMessenger_s()
    for printer in list(messenger.Printers()):
        messenger.RemovePrinter(printer)


def _products(root: Any) -> Iterator[tuple[int, str, Any, Any]]:
    """Yield the number of its assembly, the name, the shape and the place of each leaf of the tree
    of assemblies.
    """
    from OCP.TDF import TDF_ChildIterator, TDF_Label
    from OCP.TopLoc import TopLoc_Location
    from OCP.XCAFDoc import XCAFDoc_ShapeTool

    def below(label: Any) -> list[Any]:
        found, children = [], TDF_ChildIterator(label)
        while children.More():
            found.append(children.Value())
            children.Next()
        return found

    numbers = count(1)

    def walk(
        label: Any, place: Any, name: str, assembly: int = 0
    ) -> Iterator[tuple[int, str, Any, Any]]:
        if XCAFDoc_ShapeTool.IsReference_s(label):
            product = TDF_Label()
            XCAFDoc_ShapeTool.GetReferredShape_s(label, product)
            here = place.Multiplied(XCAFDoc_ShapeTool.GetLocation_s(label))
            yield from walk(product, here, _name(product) or _name(label) or name, assembly)
        elif XCAFDoc_ShapeTool.IsAssembly_s(label):
            assembly = next(numbers)
            for child in below(label):
                if XCAFDoc_ShapeTool.IsComponent_s(child):
                    yield from walk(child, place, name, assembly)
        else:
            yield assembly, name, XCAFDoc_ShapeTool.GetShape_s(label), place

    free = [
        label
        for label in below(root)
        if XCAFDoc_ShapeTool.IsShape_s(label) and XCAFDoc_ShapeTool.IsFree_s(label)
    ]
    for label in free:
        yield from walk(label, TopLoc_Location(), _name(label) or "body")


def _name(label: Any) -> str:
    from OCP.TDataStd import TDataStd_Name

    name = TDataStd_Name()
    return str(name.Get().ToExtString()) if label.FindAttribute(name.GetID_s(), name) else ""


def _name_of_body(transfers: Any, body: Any) -> str:
    """Return the name of the entity from which a body without a place was made; empty if none."""
    from OCP.TCollection import TCollection_ExtendedString

    entity = transfers.EntityFromShapeResult(body, 1)
    name = entity.Name() if hasattr(entity, "Name") else None
    if name is None:
        return ""
    return str(TCollection_ExtendedString(name.String(), True).ToExtString())


def _bodies(shape: Any) -> Iterator[tuple[bool, Any]]:
    """Yield solids, then the faces that belong to no solid, each with whether it is a solid."""
    from OCP.TopAbs import TopAbs_FACE, TopAbs_SHELL, TopAbs_SOLID
    from OCP.TopExp import TopExp_Explorer

    for kind, within in (
        (TopAbs_SOLID, None),
        (TopAbs_SHELL, TopAbs_SOLID),
        (TopAbs_FACE, TopAbs_SHELL),
    ):
        explorer = TopExp_Explorer()
        explorer.Init(shape, kind) if within is None else explorer.Init(shape, kind, within)
        while explorer.More():
            yield kind == TopAbs_SOLID, explorer.Current()
            explorer.Next()


def triangles(shape: Any, chord: float = CHORD, bend: float = BEND) -> TriangleMesh:
    """Triangulate the faces of a shape of Open CASCADE, mm; face normals point out of a solid.

    `chord` is the largest distance (mm) of triangles from the exact surface, and `bend` the largest
    angle (degrees) between neighbouring ones on a curved surface.
    """
    from OCP.BRep import BRep_Tool
    from OCP.BRepMesh import BRepMesh_IncrementalMesh
    from OCP.TopAbs import TopAbs_FACE, TopAbs_REVERSED
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopLoc import TopLoc_Location
    from OCP.TopoDS import TopoDS

    cast = getattr(TopoDS, "Face_s", None) or TopoDS.Face
    BRepMesh_IncrementalMesh(shape, chord, False, float(np.radians(bend)), False)
    pieces = []
    explorer = TopExp_Explorer()
    explorer.Init(shape, TopAbs_FACE)
    while explorer.More():
        face, place = cast(explorer.Current()), TopLoc_Location()
        patch = BRep_Tool.Triangulation_s(face, place)
        explorer.Next()
        if patch is None:
            continue
        move = place.Transformation()
        nodes = [patch.Node(i).Transformed(move) for i in range(1, patch.NbNodes() + 1)]
        corners = [patch.Triangle(i) for i in range(1, patch.NbTriangles() + 1)]
        faces = np.array([[t.Value(k) - 1 for k in (1, 2, 3)] for t in corners])
        turned = face.Orientation() == TopAbs_REVERSED
        pieces.append(
            TriangleMesh(
                np.array([(node.X(), node.Y(), node.Z()) for node in nodes]),
                faces[:, ::-1] if turned else faces,
            )
        )
    if not pieces:
        return TriangleMesh(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int32))
    return merged_vertices(TriangleMesh.joined(pieces), _WELD)

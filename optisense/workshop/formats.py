"""File formats in which parts are exported, in mm: STL, OBJ, 3MF, STEP and those of other
packages."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from optisense.errors import OutputError
from optisense.geometry import TriangleMesh
from optisense.geometry.mesh_files import obj_text
from optisense.registry import Registry, must_be
from optisense.text import one_line, to_html
from optisense.workshop._step_format import require_step, write_step
from optisense.workshop.shapes import Shape

LONG_AGO = (1980, 1, 1, 0, 0, 0)
"""Date of files within a 3MF file, constant so that the same shapes give the same bytes."""

CONTENT_TYPES = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
    '<Default Extension="rels" '
    'ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    '<Default Extension="model" '
    'ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>\n'
)
RELATIONSHIPS = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
    '<Relationship Target="/3D/3dmodel.model" Id="rel0" '
    'Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>\n'
)
NAMESPACE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"


def stl_bytes(shape: Shape) -> bytes:
    """Return a binary STL file, in single precision: exact to about 1e-6 of the size."""
    return stl_bytes_of(f"{shape.name}, millimetres", shape.mesh)


def stl_bytes_of(title: str, mesh: TriangleMesh) -> bytes:
    """Return a binary STL file of a mesh, in the unit of its vertices."""
    # The header must not begin with "solid", the mark of a text file.
    header = f"OptiSense part {title}".encode("ascii", "replace")[:80]
    records = np.zeros(
        len(mesh.faces),
        dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")],
    )
    records["normal"] = mesh.face_normals
    records["corners"] = mesh.triangles
    count = np.uint32(len(records)).astype("<u4").tobytes()
    return header.ljust(80, b"\0") + count + records.tobytes()


def three_mf_bytes(title: str, shapes: Sequence[Shape]) -> bytes:
    """Return a 3MF file (core specification 1.3) with an object for each shape, all in their
    positions.

    Solids are of type `model`; sheets, which no printer can make, of type `surface`.
    """
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in (
            ("[Content_Types].xml", CONTENT_TYPES),
            ("_rels/.rels", RELATIONSHIPS),
            ("3D/3dmodel.model", "\n".join(_model(title, shapes)) + "\n"),
        ):
            info = zipfile.ZipInfo(name, LONG_AGO)
            info.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(info, text.encode("utf-8"))
    return packed.getvalue()


def _model(title: str, shapes: Sequence[Shape]) -> Iterator[str]:
    yield '<?xml version="1.0" encoding="UTF-8"?>'
    yield f'<model unit="millimeter" xml:lang="en-US" xmlns="{NAMESPACE}">'
    yield f"<metadata name={quoteattr('Title')}>{to_html(one_line(title))}</metadata>"
    yield '<metadata name="Application">OptiSense Studio</metadata>'
    yield "<resources>"
    for number, shape in enumerate(shapes, start=1):
        kind = "model" if shape.is_solid else "surface"
        yield f'<object id="{number}" type="{kind}" name={quoteattr(shape.name)}>'
        yield from _mesh(shape.mesh)
        yield "</object>"
    yield "</resources>"
    yield "<build>"
    for number in range(1, len(shapes) + 1):
        yield f'<item objectid="{number}"/>'
    yield "</build>"
    yield "</model>"


def _mesh(mesh: TriangleMesh) -> Iterator[str]:
    yield "<mesh><vertices>"
    for x, y, z in mesh.vertices.tolist():
        yield f'<vertex x="{x!r}" y="{y!r}" z="{z!r}"/>'
    yield "</vertices><triangles>"
    for a, b, c in mesh.faces.tolist():
        yield f'<triangle v1="{a}" v2="{b}" v3="{c}"/>'
    yield "</triangles></mesh>"


@dataclass(frozen=True)
class ShapeFormat:
    """File format for the shapes of a design, in mm.

    Attributes:
        suffix: suffix of the file name, with its dot.
        write: function that writes a file, called with its path, the name of the design and the
            shapes. It may return a list of notes.
        holds_all: whether one file holds all shapes; otherwise each shape has a file of its own.
        require: function called before any work; raises `SetupError` if a package is missing.
        note: note for the user before a long export; empty if there is none.
    """

    suffix: str
    write: Callable[[Path, str, Sequence[Shape]], object]
    holds_all: bool = False
    require: Callable[[], None] = lambda: None
    note: str = ""


STL = ShapeFormat(".stl", lambda path, title, shapes: path.write_bytes(stl_bytes(shapes[0])))
OBJ = ShapeFormat(
    ".obj",
    lambda path, title, shapes: path.write_text(
        obj_text(shapes[0].mesh, shapes[0].name), encoding="ascii"
    ),
)
THREE_MF = ShapeFormat(
    ".3mf",
    lambda path, title, shapes: path.write_bytes(three_mf_bytes(title, shapes)),
    holds_all=True,
)
STEP = ShapeFormat(
    ".step",
    lambda path, title, shapes: write_step(path, shapes, title),
    holds_all=True,
    require=require_step,
    note="writing STEP; a finely cut part of no simple shape takes half a minute",
)


FORMATS: Registry[ShapeFormat] = Registry(
    "file format",
    "optisense.formats",
    OutputError,
    {
        "stl": "optisense.workshop.formats:STL",
        "obj": "optisense.workshop.formats:OBJ",
        "3mf": "optisense.workshop.formats:THREE_MF",
        "step": "optisense.workshop.formats:STEP",
    },
    must_be(ShapeFormat, OutputError, "file format"),
)
"""Registry of all formats; other packages add theirs as entry points `optisense.formats`."""

"""File formats in which parts are exported: those of this package and of other packages."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from optisense.errors import OutputError
from optisense.geometry.mesh_files import obj_text
from optisense.registry import Registry, must_be
from optisense.workshop._step_format import require_step, write_step
from optisense.workshop.mesh_formats import stl_bytes, three_mf_bytes
from optisense.workshop.shapes import Shape


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
        "stl": "optisense.workshop._formats:STL",
        "obj": "optisense.workshop._formats:OBJ",
        "3mf": "optisense.workshop._formats:THREE_MF",
        "step": "optisense.workshop._formats:STEP",
    },
    must_be(ShapeFormat, OutputError, "file format"),
)
"""Registry of all formats; other packages add theirs as entry points `optisense.formats`."""

"""Writing all that a workshop needs into one folder."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path

from optisense.design import SensorDesign
from optisense.errors import DesignError
from optisense.workshop.bill_of_materials import bill_of_materials
from optisense.workshop.mesh_formats import obj_bytes, stl_bytes, three_mf_bytes
from optisense.workshop.placement import placement_csv, placements
from optisense.workshop.shapes import Shape, shapes
from optisense.workshop.step_format import require_step, write_step
from optisense.writing import written_together

FORMATS = ("stl", "obj", "3mf", "step")
"""A file for each part as STL and OBJ, one file for all parts as 3MF and STEP."""

PLACEMENT_FILE = "pick-and-place.csv"
BILL_FILES = ("bill-of-materials.csv", "bill-of-materials.md")

Writer = Callable[[Path], None]


def export(
    design: SensorDesign, folder: str | Path, formats: Sequence[str] = ("stl",)
) -> list[Path]:
    """Write the deformed parts, where the LEDs go, and the bill of materials.

    Nothing appears under its own name before everything is written.

    Args:
        formats: of `FORMATS`.

    Returns:
        The files, in the order of the parts.

    Raises:
        DesignError: a part has no mesh, or lies outside of the cage that deforms it.
        SetupError: `step` is asked for, and its extra not installed.
        OutputError: the folder can't be written.
        ValueError: a format is none of `FORMATS`.
    """
    unknown = [name for name in formats if name not in FORMATS]
    if unknown:
        raise ValueError(f"'{unknown[0]}' is none of {', '.join(FORMATS)}")
    if "step" in formats:
        require_step()
    made = shapes(design)
    writers: dict[str, Writer] = {}
    for name in dict.fromkeys(formats):
        writers.update(_shape_writers(name, design.name, made))
    bill = bill_of_materials(design)
    for file, text in (
        (PLACEMENT_FILE, placement_csv(placements(design))),
        (BILL_FILES[0], bill.csv()),
        (BILL_FILES[1], bill.markdown()),
    ):
        writers[file] = _bytes_writer(text.encode("utf-8"))
    return _write_all(Path(folder), writers)


def _shape_writers(kind: str, title: str, made: Sequence[Shape]) -> dict[str, Writer]:
    """The files of a format, and what writes each."""
    if kind == "3mf":
        return {f"{file_name(title)}.3mf": _bytes_writer(three_mf_bytes(title, made))}
    if kind == "step":
        return {f"{file_name(title)}.step": lambda path: write_step(path, made)}
    to_bytes = stl_bytes if kind == "stl" else obj_bytes
    files: dict[str, Writer] = {}
    for shape in made:
        file = f"{shape.name}.{kind}"
        if file.casefold() in {other.casefold() for other in files}:
            raise DesignError(
                f"parts '{shape.name}' and another one differ only in upper and lower case",
                where=f"parts.{shape.name}",
                hint="Rename one: their files would overwrite each other on some systems",
            )
        files[file] = _bytes_writer(to_bytes(shape))
    return files


def file_name(title: str) -> str:
    """A name for a file from the name of a design: letters, digits, '-' and '_'."""
    return re.sub(r"[^A-Za-z0-9_-]+", "-", title).strip("-")[:64] or "design"


def _bytes_writer(data: bytes) -> Writer:
    def write(path: Path) -> None:
        path.write_bytes(data)

    return write


def _write_all(folder: Path, writers: dict[str, Writer]) -> list[Path]:
    """Write each file under a temporary name, and rename them when all are there."""
    finals = [folder / file for file in writers]
    with written_together("the workshop's files") as stage:
        for final, write in zip(finals, writers.values(), strict=True):
            write(stage(final))
    return finals

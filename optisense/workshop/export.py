"""Export of all files for a workshop into one folder."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from optisense.design import SensorDesign
from optisense.earlier_results import holds_earlier_results, refuse_to_replace
from optisense.errors import DesignError, OutputError
from optisense.own_code import failures_named
from optisense.registry import place_of_definition
from optisense.workshop._assembly_files import assembly_files
from optisense.workshop._bill_of_materials import bill_of_materials
from optisense.workshop._drawings import cut_file, drawing
from optisense.workshop._moulds import moulds
from optisense.workshop._placement import placement_csv, placements
from optisense.workshop._plates import plates
from optisense.workshop.formats import FORMATS, ShapeFormat
from optisense.workshop.shapes import Shape, shapes
from optisense.writing import inside, written_together

PLACEMENT_FILE = "pick-and-place.csv"
BILL_FILES = ("bill-of-materials.csv", "bill-of-materials.md")

MARK = (BILL_FILES[1], "# Bill of materials: ")
"""File of each export, and a text in it, by which the folder of an earlier one is recognised."""

MOST_NAMED = 10
"""Largest number of files that a note names: those of several parts in a few formats."""

Writer = Callable[[Path], object]


def export(
    design: SensorDesign,
    folder: str | Path,
    formats: str | Sequence[str] = ("stl",),
    notes: list[str] | None = None,
    *,
    with_moulds: bool = False,
) -> list[Path]:
    """Write the deformed parts, drawings of plates, positions of the LEDs, files for each board,
    and the bill of materials.

    No file appears under its own name before all are written.

    Args:
        formats: one name in `FORMATS`, or several.
        notes: list to which notes about the files are added, one sentence each.
        with_moulds: whether to write the moulds of the gels, too.

    Returns:
        The paths of the files, in the order of the parts.

    Raises:
        DesignError: a part has no mesh, or lies outside of its cage; a gel has no mould; or files
            of two parts, plates or moulds would have one name, also in another case.
        SetupError: a format needs a package that is not installed.
        OutputError: there is no such format, two formats have files of one name, a format writes
            none, the folder can't be written, or it holds a design or files of the user with such
            names.
        OwnCodeError: the function of a format of another package fails.
    """
    wanted = list(dict.fromkeys([formats] if isinstance(formats, str) else formats))
    for name in wanted:
        FORMATS.find(name).require()
    made = shapes(design)
    writers: dict[str, Writer] = {}
    stem = file_name(design.name)
    for name in wanted:
        _add_shapes(writers, name, stem, design.name, made)
    if with_moulds:
        cast = moulds(made)
        halves = [half for each in cast for half in each.shapes()]
        for name in wanted if halves else ():
            _add_shapes(writers, name, f"{stem}-moulds", f"{design.name}-moulds", halves)
        if notes is not None:
            notes += [note for each in cast for note in each.notes()]
    for plate in plates(made):
        outline = cut_file(plate).encode("ascii")
        sheet = drawing(plate, design.name).encode("utf-8")
        _add(writers, f"{plate.name}-cut.dxf", bytes_writer(outline), plate.name)
        _add(writers, f"{plate.name}-drawing.svg", bytes_writer(sheet), plate.name)
    bill = bill_of_materials(design)
    placed = placements(design)
    for file, text in (
        (PLACEMENT_FILE, placement_csv(placed)),
        *assembly_files(design, placed).items(),
        (BILL_FILES[0], bill.csv()),
        (BILL_FILES[1], bill.markdown()),
    ):
        _add(writers, file, bytes_writer(text.encode("utf-8")))
    return write_all(Path(folder), writers, MARK, "the workshop's files", notes)


def _add_shapes(
    writers: dict[str, Writer], name: str, stem: str, title: str, made: Sequence[Shape]
) -> None:
    """Add the files of a format; one that holds all shapes is called by the stem."""
    kind = FORMATS.find(name)
    if kind.holds_all:
        _add(writers, f"{stem}{kind.suffix}", _ShapeWriter(name, kind, title, made))
        return
    for shape in made:
        write = _ShapeWriter(name, kind, title, [shape])
        _add(writers, f"{shape.name}{kind.suffix}", write, shape.name)


@dataclass(frozen=True)
class _ShapeWriter:
    """Function that writes shapes into a file of a format; see `ShapeFormat.write`."""

    name: str
    kind: ShapeFormat
    title: str
    shapes: Sequence[Shape]

    def __call__(self, path: Path) -> object:
        where = place_of_definition(self.kind.write)
        with failures_named(f"the file format '{self.name}'", where):
            notes = self.kind.write(path, self.title, self.shapes)
        if not path.exists():
            raise OutputError(
                f"the format '{self.name}' wrote no file",
                hint="Repair the package that contains the format",
            )
        return notes


def _add(writers: dict[str, Writer], file: str, write: Writer, part: str | None = None) -> None:
    """Add a file.

    Raises:
        OutputError: another format has a file of the same name, also in another case.
        DesignError: another part, or its mould or one of its plates, has such a file.
    """
    twin = twin_of(file, writers)
    if twin is None:
        writers[file] = write
        return
    formats = [each.name for each in (writers[twin], write) if isinstance(each, _ShapeWriter)]
    if len(set(formats)) > 1:
        raise OutputError(
            f"formats '{formats[0]}' and '{formats[1]}' would both write {file}",
            hint="Export them into two folders",
        )
    raise twins(file, twin, part)


def twin_of(file: str, others: Iterable[str]) -> str | None:
    """Return the one of other files that has the name of a file, also in another case."""
    return next((other for other in others if other.casefold() == file.casefold()), None)


def twins(file: str, twin: str, part: str | None) -> DesignError:
    """Return the error of a file of a part, and of `twin_of` it."""
    case = "" if file == twin else " but for upper and lower case"
    return DesignError(
        f"two files would have the name '{file}'{case}",
        where="parts" if part is None else f"parts.{part}",
        hint="Rename a part, so that neither file overwrites the other",
    )


def file_name(title: str) -> str:
    """Return a file name from the name of a design: letters, digits, '-' and '_'."""
    return re.sub(r"[^A-Za-z0-9_-]+", "-", title).strip("-")[:64] or "design"


def bytes_writer(data: bytes) -> Writer:
    """Return a function that writes bytes into a file."""

    def write(path: Path) -> None:
        path.write_bytes(data)

    return write


def write_all(
    folder: Path,
    writers: Mapping[str, Writer],
    mark: tuple[str, str],
    what: str,
    notes: list[str] | None,
) -> list[Path]:
    """Write each file under a temporary name, and rename them when all are complete; a list that a
    writer returns is added to the notes, and a note on files of earlier exports with this mark.
    """
    again = holds_earlier_results(folder, mark)
    refuse_to_replace(folder, writers, mark)
    finals = [inside(folder, file) for file in writers]
    told: list[str] = [] if notes is None else notes
    with written_together(what) as stage:
        for final, write in zip(finals, writers.values(), strict=True):
            found = write(stage(final))
            told += found if isinstance(found, list) else []
    if again:
        told += _notes_on_others(folder, finals)
    return finals


def _notes_on_others(folder: Path, written: Sequence[Path]) -> list[str]:
    """Return a note that names the files beside those of an export, in the folder and in its
    subfolders, which an earlier one may have written; none if there are no others.
    """
    found: list[str] = []
    for place in dict.fromkeys(path.parent for path in written):
        with contextlib.suppress(OSError):  # a folder that can be written but not read
            beside = (path for path in place.iterdir() if path.is_file() and path not in written)
            found += [path.relative_to(folder).as_posix() for path in beside]
    found = sorted(name for name in found if not Path(name).name.startswith("."))
    if not found:
        return []
    names = ", ".join(found[:MOST_NAMED])
    more = f" and {len(found) - MOST_NAMED} more" if len(found) > MOST_NAMED else ""
    return [
        "the folder also contains files that this export has not written, such as those of an "
        f"earlier one: {names}{more}"
    ]

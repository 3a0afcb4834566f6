"""Reader of positions of parts on a board: pick-and-place files of KiCad, Altium, EasyEDA and
others.

Columns are found by their names, so that any program can have written the file. Lengths are
converted to mm.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from optisense.errors import DesignError
from optisense.length_units import MM_PER, Units
from optisense.text import brief
from optisense.untrusted_files import MOST_BOARD, read_bytes

NAMES = {
    "designator": ("designator", "ref", "refdes", "reference", "partdesignator"),
    "x": ("posx", "midx", "centerx", "centrex", "locationx", "x", "refx"),
    "y": ("posy", "midy", "centery", "centrey", "locationy", "y", "refy"),
    "rotation": ("rotation", "rot", "angle", "orientation", "theta"),
    "side": ("side", "layer", "tb", "boardside", "mountside", "pcbside", "layername"),
    "z": ("posz", "midz", "centerz", "centrez", "locationz", "z"),
}
"""Names of columns in lower case, without units and signs; the first that a file has is used."""

NEEDED = ("designator", "x", "y")

LONGEST_LINE = 10_000
"""Most characters of one line. A row of the programs named above has a few hundred; Python's reader
of tables refuses cells of more than 131,072."""

FARTHEST = 1e-3
"""Largest z, mm, of a part that counts as 0: the rounding of coordinates in such files, and far
below the thickness of any board."""

LARGEST = 10_000.0
"""Largest coordinate of a part, mm, and rotation, degrees: panels are smaller than a metre."""

_UNIT = re.compile(r"\b(mm|mils?|inch(?:es)?|in|thou)\b", re.IGNORECASE)
_NUMBER = re.compile(
    r"([-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?)\s*(mm|mils?|thou|inch(?:es)?|in|\")?$", re.IGNORECASE
)
_ANGLE = re.compile(
    r"([-+]?(?:\d+[.,]?\d*|[.,]\d+)(?:e[-+]?\d+)?)\s*(?:[°º]|deg(?:rees?)?)?$", re.IGNORECASE
)
_SIDE = re.compile(r"(t$|top|f$|f\.|front|component)|(b$|bot|back|b\.|solder)", re.IGNORECASE)
_SAYS_UNIT = re.compile(r"unit", re.IGNORECASE)


@dataclass(frozen=True)
class BoardPart:
    """Part on a board.

    Attributes:
        designator: name of the part, such as D1.
        x, y: position in the file's frame, mm.
        rotation: rotation, degrees, anticlockwise.
        bottom: whether it is on the board's lower side.
    """

    designator: str
    x: float
    y: float
    rotation: float
    bottom: bool


PartTable = Mapping[str, BoardPart | DesignError]
"""Parts by designator. If the position of a part is unknown, because its line has no numbers, a z
or an unknown side, or repeats a designator, there is the error instead, which names the line."""


def read_pick_and_place(path: Path, units: Units | None = None) -> tuple[PartTable, list[str]]:
    """Return the parts of a pick-and-place file and notes on columns that it lacks.

    It is a table with commas, semicolons, tabs or blanks, as UTF-8 or UTF-16. Units are those of
    its lengths if it does not state them.

    Raises:
        DesignError: the file is missing, lacks the columns or has no parts.
    """
    lines = _lines(path)
    for number, line in enumerate(lines):
        for delimiter in (",", ";", "\t", None):
            head = _cells(line.lstrip("#"), delimiter)
            columns = {key: _column(head, key) for key in NAMES}
            if all(columns[key] is not None for key in NEEDED):
                rows = [(n, _cells(text, delimiter))
                        for n, text in enumerate(lines[number + 1 :], start=number + 2)
                        if text.strip() and not text.lstrip().startswith("#")]  # fmt: skip
                unit = _unit(head, columns, lines[: number + 1]) or units
                return _placed(path, rows, columns, unit), _without(path, columns)
    raise DesignError(
        "this is no pick-and-place file: no line names a designator, x and y",
        where=str(path),
        hint="Export it as CSV, with columns such as Designator, Mid X, Mid Y, Rotation and Layer",
    )


def _lines(path: Path) -> list[str]:
    data = read_bytes(path, MOST_BOARD, DesignError, "the pick-and-place file")
    coding = "utf-16" if data[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig"
    try:
        lines = data.decode(coding).splitlines()
    except UnicodeDecodeError:
        lines = data.decode("latin-1").splitlines()
    for number, line in enumerate(lines, start=1):
        if len(line) > LONGEST_LINE:
            raise DesignError(
                f"this is no pick-and-place file: the line has {len(line):,} characters, and at "
                f"most {LONGEST_LINE:,} are read",
                where=f"{path}:{number}",
                hint="Export it as CSV, with one part on each line",
            )
    return lines


def _cells(line: str, delimiter: str | None) -> list[str]:
    """Return the cells of a line; without a delimiter, blanks separate them."""
    if delimiter is None:
        found = re.findall(r'"[^"]*"|\S+', line)
        return [cell.strip('"') for cell in found]
    return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter), [])]


def _cell(cells: list[str], column: int | None) -> str:
    """Return the cell in a column, or nothing if the row lacks it."""
    return "" if column is None or column >= len(cells) else cells[column]


def _column(head: list[str], key: str) -> int | None:
    extra = r"\(.*?\)|\[.*?\]|_?(?:mm|mil|deg|degrees)$|[^a-z]"
    plain = [re.sub(extra, "", cell.lower().strip()) for cell in head]
    return next((plain.index(name) for name in NAMES[key] if name in plain), None)


def _unit(head: list[str], columns: dict[str, int | None], before: list[str]) -> str | None:
    """Return the unit in the head of the x column, or in a line above that mentions units."""
    x = columns["x"]
    assert x is not None  # a file without it is refused
    unit_texts = [head[x].replace("_", " ")] + [line for line in before if _SAYS_UNIT.search(line)]
    found = [match[1] for text in unit_texts if (match := _UNIT.search(text))]
    return found[0] if found else None


def _without(path: Path, columns: dict[str, int | None]) -> list[str]:
    """Return notes on the columns that a file lacks and that have a default."""
    defaults = {
        "rotation": "so that its parts have the rotation 0",
        "side": "so that its parts are on the top of the board",
    }
    return [
        f"{path.name} has no column of a {key} ({', '.join(NAMES[key])}), {default}"
        for key, default in defaults.items()
        if columns[key] is None
    ]


def _placed(
    path: Path, rows: list[tuple[int, list[str]]], columns: dict[str, int | None], unit: str | None
) -> PartTable:
    parts: dict[str, BoardPart | DesignError] = {}
    lines: dict[str, int] = {}
    for number, row in rows:
        cells = {key: _cell(row, column) for key, column in columns.items()}
        name = cells["designator"]
        if not name:
            continue
        try:
            parts[name] = _part(cells, unit, path, number)
        except DesignError as error:
            parts[name] = error
        if name in lines:
            parts[name] = DesignError(
                f"'{brief(name)}' is also in line {lines[name]}",
                where=f"{path}:{number}",
                hint="Remove one of the two lines",
            )
        lines[name] = number
    if not parts:
        raise DesignError("the pick-and-place file has no parts", where=str(path))
    return parts


def _part(cells: dict[str, str], unit: str | None, path: Path, number: int) -> BoardPart:
    name = cells["designator"]
    # A decimal comma is no mistake in a z that is 0, and neither is a unit that the file lacks.
    z = _length(cells["z"].replace(",", ".") or "0", unit or "mm", path, number)
    if abs(z) > FARTHEST:
        raise DesignError(
            f"'{brief(cells['z'])}', the z of '{brief(name)}', is not 0: this is a position in "
            "space, and one on a board is needed",
            where=f"{path}:{number}",
            hint="Give the table of one board, such as board-1.pos of 'optisense export'",
        )
    x, y = (_length(cells[key], unit, path, number) for key in ("x", "y"))
    rotation = _rotation(cells["rotation"], path, number)
    if not all(abs(value) <= LARGEST for value in (x, y, rotation)):
        raise DesignError(
            f"the position or rotation of '{brief(name)}' is too large a number: at most "
            f"{LARGEST:,.0f} mm or degrees are read",
            where=f"{path}:{number}",
            hint="Export the file again",
        )
    return BoardPart(name, x, y, rotation, _bottom(cells["side"], path, number))


def _rotation(text: str, path: Path, number: int) -> float:
    """Return a rotation in degrees; 0 of an empty cell."""
    match = _ANGLE.match(text or "0")
    if match is None:
        raise DesignError(
            f"'{brief(text)}' is no rotation",
            where=f"{path}:{number}",
            hint="Write the rotation as a number of degrees",
        )
    return float(match[1].replace(",", "."))


def _bottom(text: str, path: Path, number: int) -> bool:
    """Return whether a cell names the lower side of a board; an empty one names the upper side."""
    match = _SIDE.match(text or "top")
    if match is None:
        raise DesignError(
            f"'{brief(text)}' is no side of a board",
            where=f"{path}:{number}",
            hint="Write top or bottom",
        )
    return match[2] is not None


def _length(text: str, unit: str | None, path: Path, number: int) -> float:
    """Return a length in mm."""
    match = _NUMBER.match(text)
    if match is None:
        raise DesignError(
            f"'{text[:40]}' is no length",
            where=f"{path}:{number}",
            hint="Export the file again, with decimal points",
        )
    given = (match[2] or unit or "").lower()
    if not given:
        raise DesignError(
            "the file does not state the unit of its lengths",
            where=str(path),
            hint="Give it beside the file: units: mm, or units: mil",
        )
    known = {"mils": "mil", "thou": "mil", "in": "inch", "inches": "inch", '"': "inch"}
    return float(match[1]) * MM_PER[known.get(given, given)]

"""Layouts of folders with photographs of a sensor, and their readers.

- Our own: `background.png`, and `presses.csv` with a row for each press.
- That of the gs_sdk calibration tools: `background.png`, `catalog.csv` with a folder for each
  press, and in each of these `gelsight.png` and `label.npz`.
- That of Taxim: one file `dataPack.npz`, whose pictures are stored in the order blue, green, red.
"""

from __future__ import annotations

import hashlib
import math
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import ByteArray
from optisense.calibration.photographs import PhotographedPress, Photographs
from optisense.errors import CalibrationError, ContactError
from optisense.geometry import Sphere
from optisense.geometry.contact_text import parse_indenter
from optisense.picture_files import decode_picture
from optisense.text import brief
from optisense.untrusted_arrays import read_arrays
from optisense.untrusted_files import (
    MOST_PICTURE,
    inside,
    is_file,
    is_folder,
    read_bytes,
    read_table,
)

BACKGROUND, PRESSES = "background.png", "presses.csv"
CATALOG, EXPERIMENT, LABEL = "catalog.csv", "gelsight.png", "label.npz"
DATA_PACK = "dataPack.npz"

MOST_PRESSES = 1000
"""Largest number of photographs that are read; six determine a sensor, so more are an error."""

MIDDLE = 0.5
"""Offset from other tools' indices of pixels to positions from the picture's edge."""

SAME_BALL = 1e-3
"""Largest relative difference between two statements of one ball's diameter: that of rounding to
three digits. Contacts are found to some hundredths of their radius."""

Reader = Callable[[Path, float | None], Photographs]


def read_photographs(folder: str | Path, diameter: float | None = None) -> Photographs:
    """Read the photographs of a sensor in a folder of any layout.

    Args:
        folder: folder of the photographs, or a `dataPack.npz` itself.
        diameter: diameter of the ball, mm, if the folder does not state it.

    Raises:
        CalibrationError: no layout fits, a file is missing or damaged, or picture sizes differ.
    """
    place = Path(folder)
    if place.name == DATA_PACK and is_file(place):
        place = place.parent
    if not is_folder(place):
        raise CalibrationError(
            "there is no folder of photographs", where=str(place), hint="Check the path"
        )
    for name, read in _LAYOUTS.items():
        if is_file(place / name):
            return read(place, diameter)
    raise CalibrationError(
        "the folder has no table of presses",
        where=str(place),
        hint=f"Put {BACKGROUND} and {PRESSES} into it, the latter with the columns file and "
        "diameter; folders of gs_sdk and Taxim's dataPack.npz are read as they are",
    )


def _read_own(folder: Path, diameter: float | None) -> Photographs:
    table = folder / PRESSES
    background, fingerprint = _background(folder)
    presses = []
    for where, row in _rows(table):
        name = _text(row, "file", where)
        picture, own = _picture(folder, name, where)
        presses.append(
            PhotographedPress(
                name=name,
                picture=picture,
                diameter=_ball(row, where, diameter),
                centre=_centre(row, where),
                radius=_number(row, "radius", where),
                fingerprint=own,
            )
        )
    return Photographs(background, tuple(presses), "presses.csv", fingerprint)


def _read_gs_sdk(folder: Path, diameter: float | None) -> Photographs:
    table = folder / CATALOG
    background, fingerprint = _background(folder)
    presses = []
    for where, row in _rows(table):
        name = _text(row, "experiment_reldir", where)
        picture, own = _picture(folder, f"{name}/{EXPERIMENT}", where)
        given = _stated(_number(row, "diameter(mm)", where), diameter, where)
        label = inside(folder, f"{name}/{LABEL}")
        centre, radius = (None, None) if label is None or not is_file(label) else _label(label)
        presses.append(PhotographedPress(name, picture, given, centre, radius, own))
    return Photographs(background, tuple(presses), "gs_sdk", fingerprint)


def _read_taxim(folder: Path, diameter: float | None) -> Photographs:
    path = folder / DATA_PACK
    if diameter is None:
        raise CalibrationError(
            "Taxim's data pack does not state the diameter of its ball",
            where=str(path),
            hint="Give its diameter in mm: --ball 4",
        )
    arrays = read_arrays(path, CalibrationError)
    background = _array(arrays, "f0", "u", 3, path)
    pictures = _array(arrays, "imgs", "u", 4, path)
    if background.shape[2] != 3 or pictures.shape[3] != 3 or background.dtype != np.uint8:
        raise _odd(path, "f0 and imgs")
    count = len(pictures)
    centres = radii = None
    if "touch_center" in arrays and "touch_radius" in arrays:
        centres = _array(arrays, "touch_center", "fiu", 2, path)
        radii = _array(arrays, "touch_radius", "fiu", 1, path)
        if centres.shape != (count, 2) or radii.shape != (count,):
            raise _odd(path, "touch_center and touch_radius")
    presses = []
    for index in range(min(count, MOST_PRESSES)):
        picture = np.ascontiguousarray(pictures[index][..., ::-1])
        centre = radius = None
        if centres is not None and radii is not None:
            centre, radius = _contact(centres[index], radii[index], path)
        presses.append(
            PhotographedPress(
                f"press {index + 1}", picture, diameter, centre, radius, _fingerprint(picture)
            )
        )
    flipped = np.ascontiguousarray(background[..., ::-1])
    return Photographs(flipped, tuple(presses), "Taxim", _fingerprint(flipped))


_LAYOUTS: Mapping[str, Reader] = {
    PRESSES: _read_own,
    CATALOG: _read_gs_sdk,
    DATA_PACK: _read_taxim,
}


def _background(folder: Path) -> tuple[ByteArray, str]:
    path = folder / BACKGROUND
    if not is_file(path):
        raise CalibrationError(
            f"there is no {BACKGROUND}",
            where=str(folder),
            hint="Add a photograph with nothing pressed in; all presses are read against it",
        )
    return _decoded(path, "the background")


def _picture(folder: Path, name: str, where: str) -> tuple[ByteArray, str]:
    path = inside(folder, name)
    if path is None:
        raise CalibrationError(
            f"'{brief(name)}' is not inside the folder",
            where=where,
            hint="Put the photograph beside the table",
        )
    if not is_file(path):
        raise CalibrationError(
            f"there is no photograph '{brief(name)}'", where=where, hint="Check its name"
        )
    return _decoded(path, "the photograph")


def _decoded(path: Path, what: str) -> tuple[ByteArray, str]:
    """Return a picture, and the SHA-256 of its file."""
    data = read_bytes(path, MOST_PICTURE, CalibrationError, what)
    return decode_picture(data, path, CalibrationError), hashlib.sha256(data).hexdigest()


def _rows(path: Path) -> list[tuple[str, Mapping[str, str]]]:
    """Return the rows of a table, each with the place of its line."""
    rows = read_table(path, CalibrationError, by_hand=True)
    if not rows:
        raise CalibrationError(
            "the table has no presses", where=str(path), hint="Add a row for each photograph"
        )
    if len(rows) > MOST_PRESSES:
        raise CalibrationError(
            f"the table has {len(rows):,} presses; at most {MOST_PRESSES:,} are read",
            where=str(path),
            hint="Leave some out: six determine a sensor",
        )
    return [(f"{path}:{number}", row) for number, row in enumerate(rows, start=2)]


def _cell(row: Mapping[str, str], column: str) -> str:
    """Return the text in a column, empty if the column is missing."""
    return (row.get(column) or "").strip()


def _text(row: Mapping[str, str], column: str, where: str) -> str:
    value = _cell(row, column)
    if not value:
        raise CalibrationError(
            f"the column '{column}' is missing or empty",
            where=where,
            hint="The first line of the table names its columns",
        )
    return value


def _number(row: Mapping[str, str], column: str, where: str) -> float | None:
    """Return the number in a column, or None if the column is missing or empty."""
    text = _cell(row, column)
    if not text:
        return None
    try:
        return _length(float(text), where, column)
    except ValueError:
        has_comma = re.fullmatch(r"[+-]?\d*,\d+", text) is not None
        raise CalibrationError(
            f"'{brief(text)}' under '{column}' "
            + ("has a decimal comma" if has_comma else "is no number"),
            where=where,
            hint=f"Write it with a point: {text.replace(',', '.')}"
            if has_comma
            else "Correct the table",
        ) from None


def _centre(row: Mapping[str, str], where: str) -> tuple[float, float] | None:
    column, line = _number(row, "column", where), _number(row, "row", where)
    if (column is None) != (line is None):
        raise CalibrationError(
            "a contact has a column or a row, but not both",
            where=where,
            hint="Give both, or leave both empty to have the contact found",
        )
    return None if column is None or line is None else (column, line)


def _ball(row: Mapping[str, str], where: str, usual: float | None) -> float:
    """Return the diameter of the ball of a row, mm."""
    given = _number(row, "diameter", where)
    text = _cell(row, "indenter")
    if not text:
        return _stated(given, usual, where)
    try:
        indenter = parse_indenter(text)
    except ContactError as error:
        raise CalibrationError(error.message, where=where, hint=error.hint) from None
    if not isinstance(indenter, Sphere):
        raise CalibrationError(
            f"'{brief(text)}' is no ball, and only balls are compared",
            where=where,
            hint="Leave this photograph out, or write sphere:RADIUS",
        )
    found = 2.0 * indenter.radius
    if given is not None and not math.isclose(given, found, rel_tol=SAME_BALL):
        raise CalibrationError(
            f"the diameter is {given:g} mm, but '{brief(text)}' has one of {found:g} mm",
            where=where,
            hint="Correct one of them; the number after 'sphere:' is the radius",
        )
    return found


def _stated(given: float | None, usual: float | None, where: str) -> float:
    """Return the diameter that a row states, mm, or else the one for all rows."""
    found = usual if given is None else given
    if found is None:
        raise CalibrationError(
            "the ball's diameter is missing",
            where=where,
            hint="Add a column 'diameter', in mm, or give --ball",
        )
    return found


def _label(path: Path) -> tuple[tuple[float, float], float]:
    """Return column and row of a contact, and its radius, pixels, from a label of gs_sdk."""
    arrays = read_arrays(path, CalibrationError)
    centre, radius = (arrays.get(name, np.zeros(0)).ravel() for name in ("center", "radius"))
    kinds = {centre.dtype.kind, radius.dtype.kind}
    if centre.shape != (2,) or radius.shape != (1,) or not kinds <= set("fiu"):
        raise _odd(path, "center and radius")
    return _contact(centre, radius[0], path)


def _array(
    arrays: Mapping[str, NDArray[Any]], name: str, kinds: str, axes: int, path: Path
) -> NDArray[Any]:
    array = arrays.get(name)
    if array is None or array.dtype.kind not in kinds or array.ndim != axes:
        raise _odd(path, name)
    return array


def _odd(path: Path, names: str) -> CalibrationError:
    return CalibrationError(
        f"{names} are missing or of another type or shape than expected",
        where=str(path),
        hint="Check that this is the right file",
    )


def _contact(pixel: NDArray[Any], radius: float, path: Path) -> tuple[tuple[float, float], float]:
    """Return the position from the picture's edge, and the radius, of another tool's label."""
    x, y = (_length(float(value) + MIDDLE, str(path)) for value in pixel)
    return (x, y), _length(float(radius), str(path))


def _length(value: float, where: str, what: str = "a place or radius") -> float:
    if not (math.isfinite(value) and value > 0.0):
        raise CalibrationError(
            f"{what} is {value:g}", where=where, hint="Give a finite number above 0"
        )
    return value


def _fingerprint(picture: ByteArray) -> str:
    return hashlib.sha256(picture.tobytes()).hexdigest()

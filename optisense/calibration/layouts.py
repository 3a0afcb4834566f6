"""Layouts of folders with photographs of a sensor, and their readers.

- Our own: `background.png`, and `presses.csv` with a row for each press.
- That of the gs_sdk calibration tools: `background.png`, `catalog.csv` with a folder for each
  press, and in each of these `gelsight.png` and `label.npz`.
- That of Taxim: one file `dataPack.npz`, whose pictures are stored in the order blue, green, red.
"""

from __future__ import annotations

import hashlib
import math
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
    for number, row in enumerate(_rows(table), start=2):
        where = f"{table}:{number}"
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
    for number, row in enumerate(_rows(table), start=2):
        where = f"{table}:{number}"
        name = _text(row, "experiment_reldir", where)
        picture, own = _picture(folder, f"{name}/{EXPERIMENT}", where)
        given = _number(row, "diameter(mm)", where) or diameter
        if given is None:
            raise _no_diameter(where)
        label = inside(folder, f"{name}/{LABEL}")
        centre = radius = None
        if label is not None and is_file(label):
            arrays = read_arrays(label, CalibrationError)
            centre, radius = _label(arrays, label)
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
            x, y = (float(value) + MIDDLE for value in centres[index])
            centre, radius = _place(x, y, path), _length(float(radii[index]), str(path))
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
    data = read_bytes(path, MOST_PICTURE, CalibrationError, "the background")
    return decode_picture(data, path, CalibrationError), hashlib.sha256(data).hexdigest()


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
    data = read_bytes(path, MOST_PICTURE, CalibrationError, "the photograph")
    return decode_picture(data, path, CalibrationError), hashlib.sha256(data).hexdigest()


def _rows(path: Path) -> list[dict[str, str]]:
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
    return rows


def _text(row: Mapping[str, Any], column: str, where: str) -> str:
    value = row.get(column)
    if not isinstance(value, str) or not value.strip():
        raise CalibrationError(
            f"the column '{column}' is missing or empty",
            where=where,
            hint="The first line of the table names its columns",
        )
    return value.strip()


def _number(row: Mapping[str, Any], column: str, where: str) -> float | None:
    """Return the number in a column, or None if the column is missing or empty."""
    value = row.get(column)
    if not isinstance(value, str) or not value.strip():
        return None
    try:
        return _length(float(value), where, column)
    except ValueError:
        if _is_number(pointed := value.strip().replace(",", ".")):
            raise CalibrationError(
                f"'{brief(value)}' under '{column}' has a decimal comma",
                where=where,
                hint=f"Write it with a point: {pointed}",
            ) from None
        raise CalibrationError(
            f"'{brief(value)}' under '{column}' is no number",
            where=where,
            hint="Correct the table",
        ) from None


def _is_number(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False


def _centre(row: Mapping[str, Any], where: str) -> tuple[float, float] | None:
    column, line = _number(row, "column", where), _number(row, "row", where)
    if (column is None) != (line is None):
        raise CalibrationError(
            "a contact has a column or a row, but not both",
            where=where,
            hint="Give both, or leave both empty to have the contact found",
        )
    return None if column is None or line is None else (column, line)


def _ball(row: Mapping[str, Any], where: str, usual: float | None) -> float:
    """Return the diameter of the ball of a row, mm."""
    given = _number(row, "diameter", where)
    text = (row.get("indenter") or "").strip()
    if not text:
        found = usual if given is None else given
        if found is None:
            raise _no_diameter(where)
        return found
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


def _no_diameter(where: str) -> CalibrationError:
    return CalibrationError(
        "the ball's diameter is missing",
        where=where,
        hint="Add a column 'diameter', in mm, or give --ball",
    )


def _label(
    arrays: Mapping[str, NDArray[Any]], path: Path
) -> tuple[tuple[float, float] | None, float | None]:
    if "center" not in arrays or "radius" not in arrays:
        raise _odd(path, "center and radius")
    centre, radius = (np.asarray(arrays[name]).ravel() for name in ("center", "radius"))
    if (
        centre.shape != (2,)
        or radius.shape != (1,)
        or {centre.dtype.kind, radius.dtype.kind}
        - {
            "f",
            "i",
            "u",
        }
    ):
        raise _odd(path, "center and radius")
    x, y = float(centre[0]) + MIDDLE, float(centre[1]) + MIDDLE
    return _place(x, y, path), _length(float(radius[0]), str(path))


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


def _place(x: float, y: float, path: Path) -> tuple[float, float]:
    return _length(x, str(path)), _length(y, str(path))


def _length(value: float, where: str, what: str = "a place or radius") -> float:
    if not (math.isfinite(value) and value > 0.0):
        raise CalibrationError(
            f"{what} is {value:g}", where=where, hint="Give a finite number above 0"
        )
    return value


def _fingerprint(picture: ByteArray) -> str:
    return hashlib.sha256(picture.tobytes()).hexdigest()

"""Reader of tuning files of libcamera: data of a camera's sensor and lens, measured by its maker.

The files of the Raspberry Pi's cameras are JSON; `src/ipa/rpi/vc4/data` of libcamera has them, and
`docs/library.md` lists the data that are used. Their levels run from 0 to 65536 (16 bits).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from optisense.array_types import FloatArray
from optisense.errors import LibraryError
from optisense.untrusted_files import read_json

FULL = 65536.0
"""Level of a full pixel in tuning files, which have 16 bits whatever the sensor has."""

TABLE_SIZES = {192: (12, 16), 1024: (32, 32)}
"""Rows and columns of shading tables by their number of entries: those of the Raspberry Pi's
processors VC4 and PiSP."""

DAYLIGHT = 5000.0
"""Colour temperature for which tables and matrices are taken, K: that of neutral white LEDs for
room lighting. Tactile sensors have no white light of their own to balance by."""

LARGEST_FILE = 4_000_000
"""Largest size of a tuning file, bytes: forty times that of libcamera's largest, 100,000."""

ROUNDING = 5
"""Number of decimals that are kept of computed values, as many as the files have at most."""

LEAST_DETERMINANT = 1e-3
"""Smallest determinant of a colour matrix that can be inverted; real ones have some 2 to 10."""

NO_TUNING = "Name a tuning file of libcamera for the Raspberry Pi, such as imx219.json"


@dataclass(frozen=True)
class Tuning:
    """Values of a camera's tuning file.

    Attributes:
        values: fields of `ImagingModel` as plain values, as far as the file has them. White
            balance, colour matrix and crosstalk are all present, or none of them is.
        derived: derivation from the file of the values that are computed, by field.
    """

    values: dict[str, Any]
    derived: dict[str, str]


def read_tuning(file: str | Path, temperature: float = DAYLIGHT) -> Tuning:
    """Read a tuning file, JSON of format 1 or 2.

    White balance and colour matrix are interpolated to a colour temperature, K, and the colours'
    shading is that of the nearest temperature in the file.

    Raises:
        LibraryError: the file can't be read, is no tuning file, or has a table of another size.
    """
    path = Path(file)
    algorithms = _algorithms(path)
    values: dict[str, Any] = {}
    derived: dict[str, str] = {}
    readers: dict[str, Callable[[dict[str, Any], float], dict[str, Any]]] = {
        "black_level": _black_level,
        "noise": lambda section, _: _noise(section, values.get("black_level")),
        "alsc": _shading,
        "awb": _white_balance,
        "ccm": _colour_matrix,
        "contrast": _tone_curve,
    }
    for name, read in readers.items():
        if name not in algorithms:
            continue
        try:
            with np.errstate(over="raise", divide="raise", invalid="raise"):
                values |= read(algorithms[name], temperature)
        except LibraryError as error:
            raise LibraryError(error.message, where=f"{path}: rpi.{name}", hint=NO_TUNING) from None
        except (KeyError, TypeError, ValueError, IndexError, ArithmeticError) as error:
            wrong = "a list has another length, or a field another type"
            if isinstance(error, KeyError):
                wrong = f"it has no {error}"
            raise LibraryError(
                f"'rpi.{name}' is not as in a tuning file: {wrong}",
                where=str(path),
                hint=NO_TUNING,
            ) from None
    if not values:
        raise LibraryError(
            "the tuning file has no data on black level, noise, shading, colours or tone curve",
            where=str(path),
            hint=NO_TUNING,
        )
    try:
        with np.errstate(over="raise", divide="raise", invalid="raise"):
            _complete_colours(values, derived)
    except (ArithmeticError, np.linalg.LinAlgError) as error:
        message = f"the processor's change of colours can't be inverted ({error})"
        raise LibraryError(message, where=f"{path}: rpi.ccm", hint=NO_TUNING) from None
    except LibraryError as error:
        raise LibraryError(error.message, where=f"{path}: rpi.ccm", hint=NO_TUNING) from None
    return Tuning(values, derived)


def _algorithms(path: Path) -> dict[str, Any]:
    """Return the sections of a tuning file, by name without its 'rpi.'."""
    try:
        content = read_json(path, LibraryError, LARGEST_FILE, "the tuning file")
    except LibraryError as error:
        raise LibraryError(error.message, where=error.where, hint=NO_TUNING) from None
    found: dict[str, Any] = {}
    if isinstance(content, dict):
        listed = content.get("algorithms")
        sections = listed if isinstance(listed, list) else [content]
        for section in sections:
            if isinstance(section, dict):
                found |= {
                    key.removeprefix("rpi."): value
                    for key, value in section.items()
                    if key.startswith("rpi.")
                }
    if not found:
        raise LibraryError(
            "the file is no tuning file: it has no section whose name begins with 'rpi.'",
            where=str(path),
            hint=NO_TUNING,
        )
    return found


def _black_level(section: dict[str, Any], temperature: float) -> dict[str, Any]:
    return {"black_level": {"level": _rounded(_number(section["black_level"]) / FULL)}}


def _noise(section: dict[str, Any], black_level: dict[str, float] | None) -> dict[str, Any]:
    """Return the noise. Its standard deviation is constant + slope sqrt(level), with levels above
    black, so a full pixel holds FULL (1 - black) / slope^2 electrons.
    """
    slope, constant = (_number(section[f"reference_{name}"]) for name in ("slope", "constant"))
    if slope <= 0.0 or constant < 0.0:
        raise LibraryError(f"the noise has a slope of {slope:g} and a constant of {constant:g}")
    black = 0.0 if black_level is None else black_level["level"]
    electrons = FULL * (1.0 - black) / slope**2
    read = constant / slope**2
    return {"noise": {"full_well": round(electrons, 1), "read_noise": round(read, 2)}}


def _shading(section: dict[str, Any], temperature: float) -> dict[str, Any]:
    """Return the shading. Like libcamera, it prefers a corner strength to a table of luminance, and
    takes a luminance of 1 where there is neither.
    """
    colours: dict[str, list[list[float]]] = {}
    for colour, name in (("red", "calibrations_Cr"), ("blue", "calibrations_Cb")):
        tables = section.get(name) or []
        if tables:
            nearest = min(tables, key=lambda each: abs(_number(each["ct"]) - temperature))
            table = np.array(_table(nearest["table"]))
            colours[colour] = np.round(table / table.min(), ROUNDING - 1).tolist()
    size = np.shape(next(iter(colours.values()))) if colours else TABLE_SIZES[192]
    if "corner_strength" in section:
        gain = _corner_gain(section, size)
    elif "luminance_lut" in section:
        gain = _table(section["luminance_lut"])
    elif colours:
        gain = np.ones(size).tolist()
    else:
        return {}
    strength = min(max(_number(section.get("luminance_strength", 1.0)), 0.0), 1.0)
    shading: dict[str, Any] = {"kind": "table", "corrected": strength, "gain": gain, **colours}
    if colours:
        shading["colour_corrected"] = 1.0
    return {"shading": shading}


def _corner_gain(section: dict[str, Any], size: tuple[int, ...]) -> list[list[float]]:
    """Return the table of some rows and columns that libcamera makes from the gain in the corners.

    The gain undoes the fourth power of the cosine of the angle from the axis, 1 / (1 + tan²)². It
    is (1 + (√c - 1) r²)², with the gain c in the corners and the distance r from the middle, about
    1 in the corners. Distances across are multiplied by the asymmetry.
    """
    strength = _number(section["corner_strength"])
    asymmetry = _number(section.get("asymmetry", 1.0))
    if strength <= 1.0:
        raise LibraryError(f"the corner strength is {strength:g}, and not above 1")
    if asymmetry < 0.0:
        raise LibraryError(f"the asymmetry is {asymmetry:g}, and below 0")
    rows, columns = size
    down = np.arange(rows)[:, None] + 0.5 - rows / 2
    across = asymmetry * (np.arange(columns) + 0.5 - columns / 2)
    square = (down**2 + across**2) / (rows * columns / 4 * (1.0 + asymmetry**2))
    gain = (1.0 + (np.sqrt(strength) - 1.0) * square) ** 2
    table: list[list[float]] = np.round(gain, ROUNDING).tolist()
    return table


def _table(numbers: Any) -> list[list[float]]:
    values = _numbers(numbers)
    if values.size not in TABLE_SIZES:
        sizes = " or ".join(f"{size} ({a} x {b})" for size, (a, b) in TABLE_SIZES.items())
        raise LibraryError(f"a shading table has {values.size} numbers, and not {sizes}")
    if values.min() <= 0.0:
        raise LibraryError(f"a shading table has the gain {values.min():g}")
    table: list[list[float]] = values.reshape(TABLE_SIZES[values.size]).tolist()
    return table


def _white_balance(section: dict[str, Any], temperature: float) -> dict[str, Any]:
    """Return the gains. The curve has the temperature and the ratios of red and blue to the green
    of a grey sheet.
    """
    if "ct_curve" not in section:
        return {}
    curve = _numbers(section["ct_curve"]).reshape(-1, 3)
    if curve.min() <= 0.0 or (np.diff(curve[:, 0]) <= 0.0).any():
        raise LibraryError("the curve of colour temperatures does not rise, or is not above 0")
    red, blue = (np.interp(temperature, curve[:, 0], curve[:, k]) for k in (1, 2))
    return {"white_balance": [_rounded(1.0 / red), 1.0, _rounded(1.0 / blue)]}


def _colour_matrix(section: dict[str, Any], temperature: float) -> dict[str, Any]:
    entries = sorted(section["ccms"], key=lambda each: _number(each["ct"]))
    places = np.array([_number(each["ct"]) for each in entries])
    matrices = np.array([_numbers(each["ccm"]).reshape(3, 3) for each in entries])
    matrix = [
        [_rounded(float(np.interp(temperature, places, matrices[:, row, k]))) for k in range(3)]
        for row in range(3)
    ]
    return {"colour_matrix": matrix}


def _tone_curve(section: dict[str, Any], temperature: float) -> dict[str, Any]:
    points = _numbers(section["gamma_curve"]).reshape(-1, 2)
    scaled = np.round(np.minimum(points / (FULL - 1.0), 1.0), ROUNDING)
    return {"tone_curve": {"kind": "points", "points": scaled.tolist()}}


def _complete_colours(values: dict[str, Any], derived: dict[str, str]) -> None:
    """Complete white balance and colour matrix if the file has one of them, and add the crosstalk
    of the sensor that both undo.
    """
    neutral = {"white_balance": [1.0, 1.0, 1.0], "colour_matrix": np.eye(3).tolist()}
    if not neutral.keys() & values.keys():
        return
    for field in neutral.keys() - values.keys():
        values[field] = neutral[field]
        derived[field] = "neutral, as the tuning file has none"
    matrix = np.array(values["colour_matrix"])
    if abs(np.linalg.det(matrix)) < LEAST_DETERMINANT:
        raise LibraryError(
            "the colour matrix can't be inverted, as it maps different colours to the same one",
            hint=NO_TUNING,
        )
    undone = np.linalg.inv(matrix * np.array(values["white_balance"]))
    values["crosstalk"] = np.round(undone, ROUNDING).tolist()
    derived["crosstalk"] = (
        "the inverse of white balance and colour matrix: the maker chose these so that the "
        "picture has the colours of the light"
    )


def _number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise LibraryError(f"{value!r} is no number")
    return float(value)


def _numbers(values: Any) -> FloatArray:
    if not isinstance(values, list) or not values:
        raise LibraryError("a list of numbers is missing")
    return np.array([_number(each) for each in values])


def _rounded(value: float) -> float:
    return round(value, ROUNDING)

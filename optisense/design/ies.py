"""Reader of IES files (ANSI/IESNA LM-63): luminous intensity over direction.

Only type C photometry is read: the vertical angle is measured from the lamp's axis (0 is
straight ahead), the horizontal angle around it, right-handed about the lamp's direction.
"""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from optisense.array_types import FloatArray
from optisense.design.fields import LARGEST_NUMBER
from optisense.errors import LibraryError
from optisense.untrusted_files import MOST_DATA, read_bytes

MAX_VALUES = 1_200_000
"""Largest number of candela values of one IES file. A table of one value per quarter degree over
the sphere has a million."""


@dataclass(frozen=True)
class IesProfile:
    """Luminous intensity of a lamp, with the symmetries of its file expanded.

    Attributes:
        vertical_angles: angles (nv,) from the axis, degrees, ascending, within 0..180. Outside
            their range the lamp is dark.
        horizontal_angles: angles (nh,) around the axis, degrees, ascending, from 0 to 360.
        candela: intensity (nh, nv), with multiplier and ballast factor applied.
    """

    vertical_angles: FloatArray
    horizontal_angles: FloatArray
    candela: FloatArray

    @property
    def lumens(self) -> float:
        """Luminous flux, lm: the integral over directions of intensity, linear between angles."""
        theta = np.radians(self.vertical_angles)
        low, high = theta[:-1], theta[1:]
        # The integrals of the two hat functions times sin(theta) over each interval.
        sines = (np.sin(high) - np.sin(low)) / (high - low)
        ring = self.candela[:, :-1] * (np.cos(low) - sines)
        ring = (ring + self.candela[:, 1:] * (sines - np.cos(high))).sum(axis=1)
        around = np.radians(np.diff(self.horizontal_angles))
        return float((0.5 * (ring[:-1] + ring[1:]) * around).sum())


def read_ies(path: str | Path) -> IesProfile:
    """Read an LM-63 file of 1986, 1991, 1995 or 2002; values may wrap freely.

    TILT=INCLUDE is read, and its factor for the untilted lamp is applied.

    Raises:
        LibraryError: the file is missing, truncated, malformed or of another photometric type; the
            message names the line.
    """
    path = Path(path)
    data = read_bytes(path, MOST_DATA, LibraryError, "the IES file")
    return parse_ies(data.decode("latin-1"), str(path))


def parse_ies(text: str, source: str) -> IesProfile:
    """Parse the text of an LM-63 file; `source` names it in errors. See `read_ies`."""
    lines = text.splitlines()
    tilt_line = next(
        (n for n, line in enumerate(lines) if line.strip().upper().startswith("TILT=")), None
    )
    if tilt_line is None:
        raise LibraryError(
            "not an IES file, or cut off in its header: there is no TILT= line",
            where=f"{source}:{max(len(lines), 1)}",
            hint="Get the file again from its maker",
        )
    values = _Values(lines, tilt_line + 1, source)
    tilt = _tilt_factor(lines[tilt_line].split("=", 1)[1].strip(), values, tilt_line, source)

    values.integer("number of lamps", 1, 1_000_000)
    values.number("lumens per lamp")
    multiplier = values.number("candela multiplier")
    n_vertical = values.integer("number of vertical angles", 2, MAX_VALUES)
    n_horizontal = values.integer("number of horizontal angles", 1, MAX_VALUES)
    if n_vertical * n_horizontal > MAX_VALUES:
        values.fail(f"{n_vertical} x {n_horizontal} intensities are more than {MAX_VALUES:,}")
    if values.integer("photometric type", 1, 3) != 1:
        values.fail("only type C photometry (1) is read, not type A or B")
    values.integer("units type", 1, 2)
    for name in ("opening width", "opening length", "opening height"):
        values.number(name)
    ballast = values.number("ballast factor")
    values.number("the value kept for future use")
    values.number("input watts")
    vertical = values.array("vertical angles", n_vertical)
    horizontal = values.array("horizontal angles", n_horizontal)
    candela = values.array("intensities", n_vertical * n_horizontal)
    values.expect_end()

    if (np.diff(vertical) <= 0.0).any():
        values.fail("vertical angles must ascend")
    if vertical[0] not in (0.0, 90.0) or vertical[-1] not in (90.0, 180.0):
        values.fail("vertical angles of type C run over 0-90, 90-180 or 0-180 degrees")
    scale = multiplier * ballast * tilt
    if not np.isfinite(scale) or scale <= 0.0:
        values.fail("multiplier and ballast factor must be above 0")
    if (candela < 0.0).any() or candela.max() <= 0.0:
        values.fail("intensities must not be negative, and not all 0")
    table = candela.reshape(n_horizontal, n_vertical) * scale
    horizontal, table = _expanded(horizontal, table, values)
    return IesProfile(vertical, horizontal, table)


class _Values:
    """Numbers of the file in order, each with its line."""

    def __init__(self, lines: list[str], start: int, source: str) -> None:
        self._source = source
        self._words: list[str] = []
        self._ends: list[int] = []  # number of words up to the end of each line
        self._start = start
        for number in range(start, len(lines)):
            self._words += lines[number].replace(",", " ").split()
            self._ends.append(len(self._words))
        self._next = 0
        self._last_line = len(lines)

    def fail(self, message: str) -> None:
        """Raise a LibraryError that names the line of the last value."""
        line = self._last_line
        if self._next:
            line = self._start + bisect_left(self._ends, self._next) + 1
        raise LibraryError(
            message, where=f"{self._source}:{line}", hint="Get the file again from its maker"
        )

    def number(self, name: str) -> float:
        """Return the next value."""
        return float(self.array(name, 1)[0])

    def integer(self, name: str, low: int, high: int) -> int:
        """Return the next value, which must be a whole number from `low` to `high`."""
        value = self.number(name)
        if value != int(value) or not low <= value <= high:
            self.fail(f"the {name} is {value:g}, it must be a whole number from {low} to {high}")
        return int(value)

    def array(self, name: str, count: int) -> FloatArray:
        """Return the next values (count,), which must be finite."""
        words = self._words[self._next : self._next + count]
        begin = self._next
        try:
            result = np.array(words, dtype=np.float64)  # many times faster than one by one
        except ValueError:
            result = np.array([_number(word) for word in words], dtype=np.float64)
        wrong = np.flatnonzero(~np.isfinite(result))
        if len(wrong):
            self._next = begin + int(wrong[0]) + 1
            word = words[int(wrong[0])]
            kind = "a number" if _number(word) is None else "a finite number"
            self.fail(f"'{word[:30]}' is not {kind} (reading {name})")
        large = np.flatnonzero(np.abs(result) > LARGEST_NUMBER)
        if len(large):
            self._next = begin + int(large[0]) + 1
            self.fail(
                f"'{words[int(large[0])][:30]}' is too large: numbers of an IES file lie within "
                f"{LARGEST_NUMBER:g} of 0 (reading {name})"
            )
        self._next = begin + len(words)
        if len(words) < count:
            raise LibraryError(
                f"the file is cut off: it ends after {len(words)} of {count} {name}",
                where=f"{self._source}:{self._last_line}",
                hint="Get the file again from its maker",
            )
        return result

    def expect_end(self) -> None:
        """Refuse further values."""
        left = len(self._words) - self._next
        if left:
            self._next += 1
            self.fail(f"{left} values too many: the counts in the header don't fit")


def _number(word: str) -> float | None:
    """Return a word as a number, or None, which NumPy turns into NaN."""
    try:
        return float(word)
    except ValueError:
        return None


def _tilt_factor(tilt: str, values: _Values, line: int, source: str) -> float:
    """Return the factor of the lamp in its untilted position."""
    if tilt.upper() == "NONE":
        return 1.0
    if tilt.upper() != "INCLUDE":
        raise LibraryError(
            f"TILT={tilt[:40]} is not read: it points to another file",
            where=f"{source}:{line + 1}",
            hint="Use a file with TILT=NONE or TILT=INCLUDE",
        )
    values.integer("lamp geometry", 1, 3)
    count = values.integer("number of tilt angles", 1, 10_000)
    angles = values.array("tilt angles", count)
    factors = values.array("tilt factors", count)
    if (np.diff(angles) <= 0.0).any():
        values.fail("tilt angles must ascend")
    return float(np.interp(0.0, angles, factors))


def _expanded(
    horizontal: FloatArray, table: FloatArray, values: _Values
) -> tuple[FloatArray, FloatArray]:
    """Expand the symmetry that the last horizontal angle implies, to 0..360 degrees."""
    if (np.diff(horizontal) <= 0.0).any():
        values.fail("horizontal angles must ascend")
    first, last = horizontal[0], horizontal[-1]
    if len(horizontal) == 1 and first == 0.0:
        return np.array([0.0, 360.0]), np.repeat(table, 2, axis=0)
    if (first, last) == (90.0, 270.0):  # mirrored in the 90-270 plane
        horizontal, table = _mirrored(horizontal, table, 270.0)
        # Angles are now 90..450: move the part beyond 360 to the front.
        turned = horizontal >= 360.0
        kept = (horizontal <= 360.0) & (horizontal > 90.0)
        first_row = np.array([np.interp(360.0, horizontal, column) for column in table.T])
        angles = np.concatenate([horizontal[turned] - 360.0, horizontal[kept]])
        rows = np.concatenate([table[turned], table[kept]])
        return _with_ends(angles, rows, first_row)
    if first != 0.0 or len(horizontal) < 2:
        values.fail("horizontal angles of type C start at 0 (or run from 90 to 270)")
    if last == 90.0:
        horizontal, table = _mirrored(horizontal, table, 90.0)
        last = 180.0
    if last == 180.0:
        return _mirrored(horizontal, table, 180.0)
    if not 180.0 < last <= 360.0:
        values.fail("the last horizontal angle of type C is 0, 90, 180 or more than 180, up to 360")
    return _with_ends(horizontal, table, table[0])


def _mirrored(
    horizontal: FloatArray, table: FloatArray, at: float
) -> tuple[FloatArray, FloatArray]:
    angles = np.concatenate([horizontal, 2.0 * at - horizontal[-2::-1]])
    return angles, np.concatenate([table, table[-2::-1]])


def _with_ends(
    horizontal: FloatArray, table: FloatArray, row: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Add the planes 0 and 360 degrees, which are the same `row`, if they are missing."""
    if horizontal[0] != 0.0:
        horizontal = np.concatenate([[0.0], horizontal])
        table = np.concatenate([row[None], table])
    if horizontal[-1] != 360.0:
        horizontal = np.concatenate([horizontal, [360.0]])
        table = np.concatenate([table, row[None]])
    return horizontal, table

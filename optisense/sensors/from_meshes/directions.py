"""Parser of directions: +x, -z, or three numbers."""

from __future__ import annotations

import re
from typing import Annotated, Any

import numpy as np
from pydantic import PlainValidator

from optisense.array_types import FloatArray

SIDES = ("+x", "-x", "+y", "-y", "+z", "-z")

Direction = str | tuple[float, float, float]

_AXIS = re.compile(r"[+-]?[xyz]$")
_FORMS = "a direction is +x, -x, +y, -y, +z, -z or three numbers, not all 0"


def _read(value: Any) -> Direction:
    if isinstance(value, str) and _AXIS.match(value):
        return value if value[0] in "+-" else "+" + value
    numbers = value if isinstance(value, list | tuple) else ()
    if (
        len(numbers) == 3
        and all(isinstance(n, int | float) and not isinstance(n, bool) for n in numbers)
        and np.isfinite(np.array(numbers, dtype=float)).all()
        and any(numbers)
    ):
        return float(numbers[0]), float(numbers[1]), float(numbers[2])
    raise ValueError(_FORMS)


def or_words(*words: str) -> PlainValidator:
    """Return a validator for a direction or one of several words."""

    def read(value: Any) -> Direction:
        if isinstance(value, str) and value in words:
            return value
        try:
            return _read(value)
        except ValueError:
            raise ValueError(f"must be {', '.join(words)}, or a direction; {_FORMS}") from None

    return PlainValidator(read)


def _read_axis(value: Any) -> str:
    if isinstance(value, str) and _AXIS.match(value):
        return value if value[0] in "+-" else "+" + value
    raise ValueError("must be one of +x, -x, +y, -y, +z, -z")


Way = Annotated[Direction, PlainValidator(_read)]
"""Direction: +x, -x, +y, -y, +z, -z or three numbers."""

Side = Annotated[str, PlainValidator(_read_axis)]
"""Direction along an axis: +x, -x, +y, -y, +z or -z."""


def vector(way: Direction) -> FloatArray:
    """Return the unit vector (3,) of a direction."""
    if isinstance(way, str):
        axis, sign = axis_of(way)
        result = np.zeros(3)
        result[axis] = sign
        return result
    given = np.array(way, dtype=np.float64)
    return np.asarray(given / np.linalg.norm(given))


def radial_vector(way: Direction, outward: FloatArray) -> FloatArray:
    """Return the unit vector (3,) of a direction, which may also be "inward" or "outward": against
    or along the unit vector `outward` (3,).
    """
    ways = {"inward": -outward, "outward": outward}
    return ways[way] if isinstance(way, str) and way in ways else vector(way)


def axis_of(side: str) -> tuple[int, float]:
    """Return 0, 1 or 2 for x, y or z, and the sign 1.0 or -1.0."""
    return "xyz".index(side[-1]), -1.0 if side.startswith("-") else 1.0


def nearest_side(direction: FloatArray) -> str:
    """Return the axis nearest to a direction, such as -z."""
    axis = int(np.argmax(np.abs(direction)))
    return ("-" if direction[axis] < 0.0 else "+") + "xyz"[axis]


def direction_text(way: Direction) -> str:
    """Return a direction as text for a sentence."""
    return way if isinstance(way, str) else "({:g}, {:g}, {:g})".format(*way)

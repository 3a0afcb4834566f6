"""Values as JSON has them: objects, lists, texts and finite numbers."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from optisense.errors import ObjectiveError


def _refuse(value: object) -> Any:
    raise ObjectiveError(
        f"a {type(value).__name__} among its parts can't be written as JSON",
        hint="Use numbers, texts, lists and dicts",
    )


def json_ready(value: Any, other: Callable[[Any], Any] = _refuse) -> Any:
    """Convert a value to plain dicts, lists, strings and finite numbers; NaN becomes None.

    Args:
        other: function that converts a value of another type to one of these.

    Raises:
        ObjectiveError: the value contains an object that JSON cannot represent, and no function
            converts it.
    """
    if isinstance(value, np.generic):
        value = value.item()
    if value is None or isinstance(value, bool | str | int):
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(key): json_ready(inner, other) for key, inner in value.items()}
    if isinstance(value, np.ndarray):
        listed = value.tolist()
        is_plain = value.dtype.kind == "f" and np.isfinite(value).all()
        return listed if is_plain else json_ready(listed, other)  # element by element takes long
    if isinstance(value, list | tuple):
        return [json_ready(inner, other) for inner in value]
    return json_ready(other(value), other)

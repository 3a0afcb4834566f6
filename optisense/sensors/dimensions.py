"""Refusing dimensions that no sensor can have, before anything is built from them."""

from __future__ import annotations

import math

from optisense.errors import DesignError


def require_positive(sensor: str, **values: float) -> None:
    """Each value must be a finite number above 0.

    Raises:
        DesignError: names the first argument that is not.
    """
    for name, value in values.items():
        if not (math.isfinite(value) and value > 0.0):
            raise DesignError(f"{name} is {value:g}", where=sensor, hint=f"Give a {name} above 0")


def require(condition: bool, sensor: str, message: str, hint: str) -> None:
    """What must hold between dimensions.

    Raises:
        DesignError: it does not; `message` says what is wrong, `hint` what to do.
    """
    if not condition:
        raise DesignError(message, where=sensor, hint=hint)

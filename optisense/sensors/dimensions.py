"""The dimensions of a sensor: refusing those that none can have, naming those that were changed."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Mapping
from typing import Any

from optisense.design import SensorDesign
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


def describe_changes(
    design: SensorDesign,
    builder: Callable[..., SensorDesign],
    given: Mapping[str, Any],
    said: tuple[str, ...] = (),
) -> None:
    """Name in a design's description which arguments were not the builder's defaults.

    The provenance speaks of the defaults; so a reader sees for which numbers it no longer holds.

    Args:
        design: what was built.
        builder: the function.
        given: its arguments, by name.
        said: those that the description names already.
    """
    defaults = {name: p.default for name, p in inspect.signature(builder).parameters.items()}
    changed = [
        f"{name} {value:g}" if isinstance(value, float) else f"{name} {value}"
        for name, value in given.items()
        if name in defaults and name not in said and value != defaults[name]
    ]
    if changed:
        design.description += f"; chosen: {', '.join(changed)}"

"""Dimensions of a sensor: refusal of impossible ones, and a description of changed ones."""

from __future__ import annotations

import functools
import inspect
import math
from collections.abc import Callable, Mapping
from numbers import Integral, Real
from typing import Any, ParamSpec

from pydantic import ValidationError

from optisense.design import SensorDesign
from optisense.errors import DesignError

Arguments = ParamSpec("Arguments")

Positive = float
"""Dimension above 0; `checks_dimensions` makes builders refuse others."""

PositiveCount = int
"""Number of objects, 1 or more."""


def checks_dimensions(
    sensor: str,
) -> Callable[[Callable[Arguments, SensorDesign]], Callable[Arguments, SensorDesign]]:
    """Return a decorator by which a builder refuses arguments of a wrong type or not above 0, and
    values that no design can have.

    Args:
        sensor: name of the sensor, for messages.
    """

    def decorate(builder: Callable[Arguments, SensorDesign]) -> Callable[Arguments, SensorDesign]:
        signature = inspect.signature(builder)

        @functools.wraps(builder)
        def build(*args: Arguments.args, **kwargs: Arguments.kwargs) -> SensorDesign:
            for name, value in signature.bind(*args, **kwargs).arguments.items():
                kind = str(signature.parameters[name].annotation)
                if value is not None or not kind.endswith(" | None"):
                    _check(sensor, name, value, kind.removesuffix(" | None"))
            try:
                return builder(*args, **kwargs)
            except ValidationError as error:
                raise _dimension_error(error, sensor) from None

        return build

    return decorate


def _check(sensor: str, name: str, value: Any, kind: str) -> None:
    """Refuse a value that is no number, or not above 0, if the annotation of its argument requires
    it.
    """
    whole = kind in ("int", "PositiveCount")
    if (whole or kind in ("float", "Positive")) and not isinstance(
        value, Integral if whole else Real
    ):
        what = "whole number" if whole else "number"
        raise DesignError(f"{name} is {value!r}", where=sensor, hint=f"Give a {what}")
    if "Positive" in kind:
        for each in value if isinstance(value, tuple | list) else (value,):
            if not (isinstance(each, Real) and 0.0 < float(each) < math.inf):
                raise DesignError(f"{name} is {value}", where=sensor, hint=f"Give a {name} above 0")


def _dimension_error(error: ValidationError, sensor: str) -> DesignError:
    """Return the error for a value that a part of the design refuses; it names the field, which
    usually is the argument.
    """
    report = error.errors(include_url=False)[0]
    message = report["msg"].removeprefix("Value error, ").replace("Input should", "it should")
    field = ".".join(str(step) for step in report["loc"])
    what = f"{field} is {report['input']!r}" if field else f"the {error.title.lower()} can't be"
    return DesignError(f"{what}: {message}", where=sensor, hint="Change that argument")


def require(condition: bool, sensor: str, message: str, hint: str) -> None:
    """Check a condition between dimensions.

    Raises:
        DesignError: the condition does not hold; `message` names the problem, `hint` the remedy.
    """
    if not condition:
        raise DesignError(message, where=sensor, hint=hint)


def describe_changes(
    design: SensorDesign,
    builder: Callable[..., SensorDesign],
    given: Mapping[str, Any],
    said: tuple[str, ...] = (),
    own_defaults: Mapping[str, Any] | None = None,
) -> None:
    """Add to a design's description which arguments differ from the builder's defaults.

    The provenance describes the defaults, so a reader sees for which numbers it does not hold.

    Args:
        design: design that was built.
        builder: function that built it.
        given: its arguments, by name.
        said: names of arguments that the description mentions already.
        own_defaults: defaults that replace the builder's.
    """
    defaults = {name: p.default for name, p in inspect.signature(builder).parameters.items()}
    defaults |= own_defaults or {}
    changed = [
        f"{name} {value:g}" if isinstance(value, float) else f"{name} {value}"
        for name, value in given.items()
        if name in defaults and name not in said and value != defaults[name]
    ]
    if changed:
        design.description += f"; chosen: {', '.join(changed)}"

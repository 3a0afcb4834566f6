"""The dimensions of a sensor: refusing those that none can have, naming those that were changed."""

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
"""A dimension above 0; builders are refused others by `tells_of_dimensions`."""

PositiveCount = int
"""A number of things that is 1 or more."""


def tells_of_dimensions(
    sensor: str,
) -> Callable[[Callable[Arguments, SensorDesign]], Callable[Arguments, SensorDesign]]:
    """Let a builder refuse arguments of a wrong type or not above 0, and what no design can have.

    Args:
        sensor: its name, for messages.
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
                raise _refusal(error, sensor) from None

        return build

    return decorate


def _check(sensor: str, name: str, value: Any, kind: str) -> None:
    """Refuse what is no number, or not above 0, where the annotation of an argument asks for it."""
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


def _refusal(error: ValidationError, sensor: str) -> DesignError:
    """What a part of the design refuses; it names its field, which is mostly the argument."""
    report = error.errors(include_url=False)[0]
    told = report["msg"].removeprefix("Value error, ").replace("Input should", "it should")
    field = ".".join(str(step) for step in report["loc"])
    what = f"{field} is {report['input']!r}" if field else f"the {error.title.lower()} can't be"
    return DesignError(f"{what}: {told}", where=sensor, hint="Change that argument")


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

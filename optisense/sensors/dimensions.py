"""Dimensions of a sensor: refusal of impossible ones, and a description of changed ones."""

from __future__ import annotations

import functools
import inspect
import math
from collections.abc import Callable, Mapping
from numbers import Integral, Real
from typing import Annotated, Any, ClassVar, TypeVar

from pydantic import BaseModel, ConfigDict, PlainValidator, ValidationError

from optisense.design import SensorDesign
from optisense.errors import DesignError
from optisense.near import suggestion


def _is(kind: type, what: str, low: float = -math.inf) -> PlainValidator:
    """Return a validator that refuses values of another type and those not above `low`."""

    def check(value: Any) -> Any:
        if not isinstance(value, kind):
            raise ValueError(what)
        if low > -math.inf and not low < float(value) < math.inf:  # type: ignore[arg-type]
            raise ValueError(f"{what} above {low:g}")
        return value

    return PlainValidator(check)


Length = Annotated[float, _is(Real, "number")]
"""Number of any sign: a length, an angle or a ratio."""

Positive = Annotated[float, _is(Real, "number", 0.0)]
"""Number above 0."""

WholeNumber = Annotated[int, _is(Integral, "whole number")]

PositiveCount = Annotated[int, _is(Integral, "whole number", 0.0)]
"""Number of objects, 1 or more."""


class Dimensions(BaseModel):
    """Dimensions of a sensor, with defaults; each sensor has a subclass.

    Attributes:
        sensor: name of the sensor, for messages.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    sensor: ClassVar[str]

    def describe(self, design: SensorDesign, mentioned: tuple[str, ...] = ()) -> None:
        """Add to a design's description which dimensions differ from their defaults, but for those
        that it mentions already; see `describe_changes`.
        """
        defaults = {name: field.default for name, field in type(self).model_fields.items()}
        given = {name: getattr(self, name) for name in self.model_fields_set}
        describe_changes(design, given, defaults, mentioned)


D = TypeVar("D", bound=Dimensions)


def builds(kind: type[D]) -> Callable[[Callable[[D], SensorDesign]], Callable[..., SensorDesign]]:
    """Return a decorator by which a function of dimensions takes each as an argument by its name.

    The function raises a `DesignError` for an unknown argument, for one of a wrong type or out of
    its bounds, and for values that no design can have.

    Args:
        kind: class of the dimensions; its attributes are added to the function's documentation.
    """

    def decorate(function: Callable[[D], SensorDesign]) -> Callable[..., SensorDesign]:
        @functools.wraps(function)
        def build(**given: Any) -> SensorDesign:
            try:
                size = kind(**given)
            except ValidationError as error:
                raise _argument_error(error, kind, given) from None
            try:
                return function(size)
            except ValidationError as error:
                raise _dimension_error(error, kind.sensor) from None
            except DesignError as error:
                if error.where is not None:
                    raise
                raise DesignError(error.message, where=kind.sensor, hint=error.hint) from None

        types = {k: v for each in kind.__mro__ for k, v in inspect.get_annotations(each).items()}
        by_name = inspect.Parameter.KEYWORD_ONLY
        parameters = [
            inspect.Parameter(name, by_name, default=field.default, annotation=types[name])
            for name, field in kind.model_fields.items()
        ]
        build.__signature__ = inspect.Signature(  # type: ignore[attr-defined]
            parameters, return_annotation="SensorDesign"
        )
        attributes = [
            inspect.cleandoc(each.__doc__ or "").partition("Attributes:\n")[2]
            for each in kind.__mro__
            if issubclass(each, Dimensions) and each is not Dimensions
        ]
        before, args, after = inspect.cleandoc(function.__doc__ or "").partition("Args:\n")
        after = after.partition("\n\n")[2]
        named = "\n".join(text.rstrip() for text in attributes)
        build.__doc__ = f"{before}{args}{named}\n\n{after}" if args else before
        return build

    return decorate


def _argument_error(
    error: ValidationError, kind: type[Dimensions], given: Mapping[str, Any]
) -> DesignError:
    """Return the error for an argument that a builder refuses."""
    report = error.errors(include_url=False)[0]
    name = str(report["loc"][0])
    if name not in kind.model_fields:
        hint = suggestion(name, kind.model_fields, limit=len(kind.model_fields))
        return DesignError(f"there is no dimension '{name}'", where=kind.sensor, hint=hint)
    what = str(report.get("ctx", {}).get("error", ""))
    value = given[name]
    shown = value if isinstance(value, Real) else repr(value)
    if what.endswith("above 0"):
        return DesignError(f"{name} is {value}", where=kind.sensor, hint=f"Give a {name} above 0")
    if what:
        return DesignError(f"{name} is {shown}", where=kind.sensor, hint=f"Give a {what}")
    message = report["msg"].replace("Input should", "it should")
    return DesignError(
        f"{name} is {shown}: {message}", where=kind.sensor, hint="Change that argument"
    )


def _dimension_error(error: ValidationError, sensor: str) -> DesignError:
    """Return the error for a value that a part of the design refuses; it names the field."""
    report = error.errors(include_url=False)[0]
    message = report["msg"].removeprefix("Value error, ").replace("Input should", "it should")
    field = ".".join(str(step) for step in report["loc"])
    what = f"{field} is {report['input']!r}" if field else f"the {error.title.lower()} can't be"
    return DesignError(f"{what}: {message}", where=sensor, hint="Change that argument")


def require(condition: bool, message: str, hint: str) -> None:
    """Check a condition between dimensions, in a function that `builds` decorates.

    Raises:
        DesignError: the condition does not hold; `message` names the problem, `hint` the remedy.
    """
    if not condition:
        raise DesignError(message, hint=hint)


def describe_changes(
    design: SensorDesign,
    given: Mapping[str, Any],
    defaults: Mapping[str, Any],
    mentioned: tuple[str, ...] = (),
) -> None:
    """Add to a design's description which dimensions differ from their defaults.

    The provenance describes the defaults, so a reader sees for which numbers it does not hold.

    Args:
        design: design that was built.
        given: dimensions by name; those without a default are left out.
        defaults: default dimensions by name.
        mentioned: names of dimensions that the description mentions already.
    """
    changed = [
        f"{name} {given[name]:g}" if isinstance(given[name], float) else f"{name} {given[name]}"
        for name in defaults
        if name in given and name not in mentioned and given[name] != defaults[name]
    ]
    if changed:
        design.description += f"; chosen: {', '.join(changed)}"

"""Types of keyword arguments that users set by name: settings of objectives, options of methods."""

from __future__ import annotations

import inspect
import math
import numbers
from collections.abc import Mapping, Sequence
from dataclasses import fields
from types import NoneType, UnionType
from typing import Any, Union, get_args, get_origin

import numpy as np

WORDS = {bool: "true or false", int: "a whole number", float: "a number", str: "a word"}
"""What a user is asked to give for an argument of each type."""


def is_real(value: Any) -> bool:
    """Return whether a value is a real number of Python or NumPy, also an infinite one or NaN, and
    not a truth value.
    """
    return isinstance(value, numbers.Real) and not isinstance(value, bool)


def is_number(value: Any) -> bool:
    """Return whether a value is a finite number that JSON can hold, and not a truth value."""
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def plain_numbers(value: Any) -> Any:
    """Return NumPy's numbers as those of Python and its arrays as tuples, also those in tuples,
    lists and mappings, so that they can be written as JSON; other values as they are.
    """
    if isinstance(value, np.ndarray):
        return plain_numbers(tuple(value)) if value.ndim else value.item()
    if isinstance(value, np.generic):
        return value.item()
    if type(value) in (tuple, list):
        return type(value)(map(plain_numbers, value))
    if isinstance(value, Mapping):
        return {key: plain_numbers(inner) for key, inner in value.items()}
    return value


def set_plain_numbers(instance: Any) -> None:
    """Convert all fields of a frozen dataclass by `plain_numbers`."""
    for each in fields(instance):
        object.__setattr__(instance, each.name, plain_numbers(getattr(instance, each.name)))


def types_of(argument: inspect.Parameter) -> tuple[Any, ...]:
    """Return the types of an argument: those of its annotation, or that of its default if it has no
    annotation or one that could not be evaluated.
    """
    noted = argument.annotation
    if noted is argument.empty or isinstance(noted, str):
        default = argument.default
        return () if default is None or default is argument.empty else (type(default),)
    return get_args(noted) if get_origin(noted) in (Union, UnionType) else (noted,)


def as_type(value: Any, types: Sequence[Any]) -> Any:
    """Return a value for an argument of some types; 4.0 as 4 if it has to be a whole number, and a
    number of NumPy as one of Python.

    A value is returned as it is if one of the types is neither of `WORDS` nor None's.

    Raises:
        ValueError: the value has none of the types; the message says what to give.
    """
    known = (*WORDS, NoneType)
    if not types or not all(kind in known for kind in types):
        return value
    value = plain_numbers(value)
    if value is None or isinstance(value, bool | str):
        if type(value) in types:
            return value
    elif is_number(value):
        if float in types or (int in types and isinstance(value, int)):
            return value
        if int in types and value == int(value):
            return int(value)
    raise ValueError(" or ".join(WORDS[kind] for kind in types if kind in WORDS))

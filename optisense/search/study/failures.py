"""Failed trials grouped by cause: the same two parts, the same rule, wherever and however much."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field

_PLACE = re.compile(r" at \([-+\d., e]+\)(?: mm)?")
"""Coordinates in a message, such as `` at (3.76, 11.51, 86.87) mm``."""

_NUMBER = re.compile(r"(?<![\w.'])[-+]?\d+(?:[.,]\d+)*(?:e[-+]?\d+)?(?![\w'])")
"""A number by itself. Digits within a name (``M1``) or in quotes (``'2'``) tell names apart."""


@dataclass
class FailureCause:
    """Why trials failed.

    Attributes:
        text: the reason without coordinates; other numbers are replaced by an ellipsis.
        example: the first reason of this kind, in full.
        numbers: of the items that failed for it, in their order.
    """

    text: str
    example: str
    numbers: list[int] = field(default_factory=list)


def cause_of(reason: str) -> str:
    """The cause behind a reason: the text without what differs from trial to trial."""
    return _NUMBER.sub("…", _PLACE.sub("", reason))


def by_cause(failures: Iterable[tuple[int, str]]) -> list[FailureCause]:
    """Group failures by cause, the commonest cause first.

    Args:
        failures: the number of each failed trial, and its reason.
    """
    found: dict[str, FailureCause] = {}
    for number, reason in failures:
        text = cause_of(reason)
        found.setdefault(text, FailureCause(text, reason)).numbers.append(number)
    return sorted(found.values(), key=lambda cause: -len(cause.numbers))

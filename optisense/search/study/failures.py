"""Failed trials grouped by cause: the same two parts or the same rule, with any coordinates."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field

_PLACE = re.compile(r" at \([-+\d., e]+\)(?: mm)?")
"""Pattern of coordinates in a message, such as `` at (3.76, 11.51, 86.87) mm``."""

_NUMBER = re.compile(r"(?<![\w.'])[-+]?\d+(?:[.,]\d+)*(?:e[-+]?\d+)?(?![\w'])")
"""Pattern of a number alone; digits in a name (``M1``) or in quotes (``'2'``) are no numbers."""


@dataclass
class FailureCause:
    """Cause of failed trials.

    Attributes:
        text: reason without coordinates; other numbers are replaced by an ellipsis.
        example: first reason of this kind, in full.
        numbers: numbers of the items that failed for this cause, in their order.
    """

    text: str
    example: str
    numbers: list[int] = field(default_factory=list)


def cause_of(reason: str) -> str:
    """Return the cause in a reason: the text without numbers that differ among trials."""
    return _NUMBER.sub("…", _PLACE.sub("", reason))


def by_cause(failures: Iterable[tuple[int, str]]) -> list[FailureCause]:
    """Group failures by cause, the most frequent cause first.

    Args:
        failures: number of each failed trial, and its reason.
    """
    found: dict[str, FailureCause] = {}
    for number, reason in failures:
        text = cause_of(reason)
        found.setdefault(text, FailureCause(text, reason)).numbers.append(number)
    return sorted(found.values(), key=lambda cause: -len(cause.numbers))

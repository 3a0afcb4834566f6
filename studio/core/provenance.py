"""Provenance of the numbers of a design after some of them were changed."""

from __future__ import annotations

import re
from typing import Any

BY_HAND = {"status": "assumed", "source": "set by hand in OptiSense Studio"}

AXES = {"x": 0, "y": 1, "z": 2, "r": 0, "g": 1, "b": 2}
"""Index of each coordinate or colour channel in a list of three numbers."""


def updated(before: dict[str, Any], now: dict[str, Any]) -> dict[str, Any]:
    """Return the provenance of a changed design: changed values are attributed to the user, removed
    ones have no entry.

    Args:
        before: design with its `provenance`, by dotted path.
        now: same design after the changes.
    """
    found = {}
    for path, entry in (before.get("provenance") or {}).items():
        was, there_is = value_at(before, path), value_at(now, path)
        if not was or was == there_is:
            found[path] = entry
        elif there_is:
            found[path] = dict(BY_HAND)
    return found


def value_at(document: Any, path: str) -> tuple[Any, ...]:
    """Return the value at a dotted path as a tuple of one; an empty tuple if there is none."""
    for step in re.findall(r"[^.\[\]]+", path):
        if isinstance(document, dict) and step in document:
            document = document[step]
            continue
        number = AXES.get(step, int(step) if step.isdigit() else -1)
        if not isinstance(document, list) or not 0 <= number < len(document):
            return ()
        document = document[number]
    return (document,)

"""Scores as text: position between poor and good sensors, and change since the last evaluation."""

from __future__ import annotations

import math
from typing import Any

from .numbers import shown_number

SAME = 1e-6
"""Relative difference up to which scores count as the same: rays are traced in single precision."""


def share(value: float | None, objective: dict[str, Any]) -> float | None:
    """Return the position of a value between poor (0) and good (1), limited to this range.

    Args:
        value: value of the score; None if it failed.
        objective: objective as the engine describes it, with `usual` (values of the poorest and the
            best built-in sensor) or `range` (all possible values), each a pair or None.

    Returns:
        Position, 0 to 1, or None without a value or a range to compare with.
    """
    if value is None:
        return None
    pair = objective.get("usual")
    if pair is None:
        pair = objective.get("range")
        if pair is not None and objective.get("lower_is_better"):
            pair = pair[::-1]
    if pair is None or pair[0] == pair[1]:
        return None
    return min(max((value - pair[0]) / (pair[1] - pair[0]), 0.0), 1.0)


def with_unit(value: float, unit: str, digits: int = 4) -> str:
    """Return a value as text with its unit, with `digits` significant digits."""
    text = f"{value:.{digits}g}"
    return f"{text} {unit}" if unit else text


def change(now: float | None, before: float | None, *, lower_is_better: bool) -> str:
    """Return the change of a score in words; empty if either score is missing."""
    if now is None or before is None or not math.isfinite(before):
        return ""
    difference = now - before
    if abs(difference) <= SAME * max(abs(now), abs(before)):
        return "unchanged"
    better = (difference < 0.0) == lower_is_better
    return f"{'+' if difference > 0.0 else ''}{shown_number(float(f'{difference:.2g}'))} " + (
        "better" if better else "worse"
    )


def direction(objective: dict[str, Any]) -> str:
    """Return the direction in which a score is better, in words."""
    return "lower is better" if objective.get("lower_is_better") else "higher is better"

"""Scores as text: the place between poor and good sensors, and the change."""

from __future__ import annotations

import math
from typing import Any

from .numbers import shown_number

SAME = 1e-6
"""Scores that differ by a smaller part of the larger one count as the same: rays are traced in
single precision."""


def share(value: float | None, objective: dict[str, Any]) -> float | None:
    """Where a value stands between poor (0) and good (1).

    Args:
        value: of the score; None where it failed.
        objective: what the engine tells of it, with `usual` (the values of the poorest and the best
            built-in sensor) or `range` (all that there can be), each a pair or None.

    Returns:
        None where nothing is known to compare with.
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
    """A value as people read it, with so many digits that count."""
    text = f"{value:.{digits}g}"
    return f"{text} {unit}" if unit else text


def change(now: float | None, before: float | None, *, lower_is_better: bool) -> str:
    """The change of a score in words; empty where there is none to tell."""
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
    """Which way a score is good."""
    return "lower is better" if objective.get("lower_is_better") else "higher is better"

"""Texts about the conditions of a study: which ones trials meet, and which ones they break."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from optisense.objectives.combined import objective_of
from optisense.objectives.registry import WATCHED
from optisense.search.evaluation.outcome import Outcome
from optisense.search.evaluation.requirements import Requirement
from optisense.search.study.best import nearest
from optisense.search.study.trial import Trial

WORSE = 0.1
"""Share of the start's value by which a watched quantity must be worse to be reported; smaller
changes may come from the rounding of pixels and triangles.
"""


def unmet(conditions: Mapping[str, float | None]) -> list[str]:
    """Return the conditions that are broken, each with its value: ``coverage >= 0.6 (is 0.52)``.

    Args:
        conditions: value of the limited quantity, by the text of each condition.
    """
    return [
        f"{text} (is {_shown(value)})"
        for text, value in conditions.items()
        if Requirement.parse(text).violation(math.nan if value is None else value) > 0.0
    ]


def margins(trial: Trial) -> list[tuple[str, float | None, float | None]]:
    """Return each condition with its value and its margin: the distance of the value from the
    limit, negative if the condition is broken. Both are None if nothing was measured.
    """
    return [
        (text, value, None if value is None else Requirement.parse(text).margin(value))
        for text, value in trial.conditions.items()
    ]


def condition_lines(trial: Trial, start: Trial | None) -> list[str]:
    """Return a line of text for each condition: value of a trial, margin, value of the start."""
    lines = []
    for text, value in trial.conditions.items():
        wanted = Requirement.parse(text)
        measured = math.nan if value is None else value
        before = None if start is None else start.conditions.get(text)
        margin = wanted.margin(measured)
        state = f"margin {margin:.3g}" if wanted.violation(measured) == 0.0 else "broken"
        beside = "" if before is None else f", start {_shown(before)}"
        lines.append(f"{text}: {_shown(value)} ({state}{beside})")
    return lines


def condition_note(trials: Sequence[Trial]) -> str | None:
    """Return a note for the user if the start breaks conditions or no trial meets them."""
    close = nearest(trials)
    if close is not None:
        again = " with fresh seeds" if close.fresh else ""
        return (
            f"no trial meets all conditions{again}, so none is "
            f"the best; trial {close.number} comes nearest: {', '.join(unmet(close.conditions))}. "
            "Raise the budget, widen the bounds, or relax the conditions"
        )
    start = next((trial for trial in trials if trial.is_start), None)
    if start is None or start.is_feasible:
        return None
    return f"the start breaks conditions, which is allowed: {', '.join(unmet(start.conditions))}"


def worsened(best: Outcome, start: Outcome) -> dict[str, tuple[float, float]]:
    """Return the quantities without a condition that are worse in the best outcome than in the
    start, by the name of the objective.

    Returns:
        The value of the best and that of the start, if the best's is worse by `WORSE`.
    """
    limited = {Requirement.parse(text).quantity for text in best.conditions}
    before, now = start.parts.get(WATCHED, {}), best.parts.get(WATCHED, {})
    found = {}
    for name in now.keys() & before.keys() - limited:
        sign = 1.0 if objective_of(name).lower_is_better else -1.0
        if sign * (now[name] - before[name]) > WORSE * abs(before[name]):
            found[name] = (now[name], before[name])
    return dict(sorted(found.items()))


def worsened_note(best: Trial | None, start: Trial | None) -> str | None:
    """Return a note for the user if the score rose at the cost of another quantity, else None."""
    if best is None or start is None or best.is_start or not best.score > start.score:
        return None
    worse = worsened(best.outcome, start.outcome)
    if not worse:
        return None
    phrases = ", ".join(
        f"{name} is {now:.3g}, where the start has {before:.3g}"
        for name, (now, before) in worse.items()
    )
    options = " ".join(
        f"--require '{name}{'<=' if objective_of(name).lower_is_better else '>='}{before:.3g}'"
        for name, (_, before) in worse.items()
    )
    return f"the score rose, but {phrases}: search with {options} to keep it"


def _shown(value: float | None) -> str:
    return "not measured" if value is None else f"{value:.4g}"

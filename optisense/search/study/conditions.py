"""What is said of the conditions of a study: what its trials keep, and what they lack."""

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
"""A quantity that is watched is named when it is worse than the start's by this part of it: less is
no more than what rounding of pixels and triangles changes."""


def unmet(conditions: Mapping[str, float | None]) -> list[str]:
    """The conditions that are broken, each with its value: ``coverage >= 0.6 (is 0.52)``.

    Args:
        conditions: the value of the limited quantity, by the text of each condition.
    """
    return [
        f"{text} (is {_shown(value)})"
        for text, value in conditions.items()
        if Requirement.parse(text).breach(math.nan if value is None else value) > 0.0
    ]


def margins(trial: Trial) -> list[tuple[str, float | None, float | None]]:
    """Each condition with its value and its margin: how far the value is on the allowed side of the
    limit, below 0 on the other side. Both are None where nothing was measured.
    """
    return [
        (text, value, None if value is None else Requirement.parse(text).margin(value))
        for text, value in trial.conditions.items()
    ]


def kept(trial: Trial, start: Trial | None) -> list[str]:
    """A line for each condition: the value of a trial, that of the start, and the margin."""
    lines = []
    for text, value in trial.conditions.items():
        wanted = Requirement.parse(text)
        measured = math.nan if value is None else value
        before = None if start is None else start.conditions.get(text)
        margin = wanted.margin(measured)
        state = f"margin {margin:.3g}" if wanted.breach(measured) == 0.0 else "broken"
        beside = "" if before is None else f", start {_shown(before)}"
        lines.append(f"{text}: {_shown(value)} ({state}{beside})")
    return lines


def condition_note(trials: Sequence[Trial]) -> str | None:
    """What the user should know where the start breaks conditions, or nothing meets them; None
    where nothing is to be said.
    """
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


def lost(best: Outcome, start: Outcome) -> dict[str, tuple[float, float]]:
    """What the best outcome has lost that no condition limits, by the name of the objective.

    Returns:
        The value of the best and that of the start, where the best's is worse by `WORSE`.
    """
    limited = {Requirement.parse(text).quantity for text in best.conditions}
    before, now = start.parts.get(WATCHED, {}), best.parts.get(WATCHED, {})
    found = {}
    for name in now.keys() & before.keys() - limited:
        sign = 1.0 if objective_of(name).lower_is_better else -1.0
        if sign * (now[name] - before[name]) > WORSE * abs(before[name]):
            found[name] = (now[name], before[name])
    return dict(sorted(found.items()))


def lost_note(best: Trial | None, start: Trial | None) -> str | None:
    """What the user should know where the score rose because the sensor got worse otherwise; None
    where it did not.
    """
    if best is None or start is None or best.is_start or not best.score > start.score:
        return None
    worse = lost(best.outcome, start.outcome)
    if not worse:
        return None
    told = ", ".join(
        f"{name} is {now:.3g}, where the start has {before:.3g}"
        for name, (now, before) in worse.items()
    )
    options = " ".join(
        f"--require '{name}{'<=' if objective_of(name).lower_is_better else '>='}{before:.3g}'"
        for name, (_, before) in worse.items()
    )
    return f"the score rose, but {told}: search with {options} to keep it"


def _shown(value: float | None) -> str:
    return "not measured" if value is None else f"{value:.4g}"

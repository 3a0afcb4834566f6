"""Texts about the conditions of a study: which ones trials meet, and which ones they break."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from optisense.objectives.combined import objective_of
from optisense.objectives.registry import WATCHED
from optisense.search.evaluation.outcome import Outcome
from optisense.search.evaluation.requirements import Requirement
from optisense.search.study.best import nearest
from optisense.search.study.trial import Trial

WORSE = 0.1
"""Share of the start's value by which a quantity must be worse to be reported, by commands and on
pages; smaller changes may come from the rounding of pixels and triangles.
"""


@dataclass(frozen=True)
class ConditionResult:
    """A condition of a study, and how a trial meets it.

    Attributes:
        text: text of the condition.
        value: value of the limited quantity; None if it was not measured.
        before: value of the start; None if it was not measured.
        margin: distance of the value from the limit, negative if it lies beyond; None if it was not
            measured.
        met: whether the condition is met; a value that misses the limit by rounding meets it.
    """

    text: str
    value: float | None
    before: float | None
    margin: float | None
    met: bool


def condition_results(
    texts: Iterable[str], trial: Trial | None, start: Trial | None = None
) -> list[ConditionResult]:
    """Return the results of conditions for a trial; without a trial, nothing was measured."""
    now, before = ({} if each is None else each.conditions for each in (trial, start))
    return [_result(text, now.get(text), before.get(text)) for text in texts]


def _result(text: str, value: float | None, before: float | None = None) -> ConditionResult:
    wanted = Requirement.parse(text)
    if value is None:
        return ConditionResult(text, None, before, None, met=False)
    met = wanted.violation(value) == 0.0
    return ConditionResult(text, value, before, wanted.margin(value), met)


def unmet(conditions: Mapping[str, float | None]) -> list[str]:
    """Return the conditions, by their text, that are broken by values of limited quantities, each
    with its value: ``coverage >= 0.6 (is 0.52)``.
    """
    results = [_result(text, value) for text, value in conditions.items()]
    return [f"{each.text} (is {shown(each.value)})" for each in results if not each.met]


def condition_lines(trial: Trial, start: Trial | None) -> list[str]:
    """Return a line of text for each condition: value of a trial, margin, value of the start."""
    lines = []
    for each in condition_results(trial.conditions, trial, start):
        state = f"margin {each.margin:.3g}" if each.met else "broken"
        beside = "" if each.before is None else f", start {shown(each.before)}"
        lines.append(f"{each.text}: {shown(each.value)} ({state}{beside})")
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


def is_worse(now: float, before: float, *, lower_is_better: bool) -> bool:
    """Return whether a quantity is worse than before by more than `WORSE`; not if one is NaN."""
    loss = now - before if lower_is_better else before - now
    return loss > WORSE * abs(before)


def worsened(best: Outcome, start: Outcome) -> dict[str, tuple[float, float]]:
    """Return the values in the best outcome and in the start of quantities without a condition that
    are worse in the best one by `WORSE`, by the name of the objective.
    """
    limited = {Requirement.parse(text).quantity for text in best.conditions}
    before, now = start.parts.get(WATCHED, {}), best.parts.get(WATCHED, {})
    found = {}
    for name in now.keys() & before.keys() - limited:
        lower_is_better = objective_of(name).lower_is_better
        if is_worse(now[name], before[name], lower_is_better=lower_is_better):
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


def shown(value: float | None) -> str:
    """Return a value of a limited quantity as text."""
    return "not measured" if value is None else f"{value:.4g}"

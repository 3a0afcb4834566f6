"""Trials without a score, or without another value, and the causes of that.

The first objective decides: a trial with a score by it has not failed, and may be the best. Causes
are the same for the same two parts or the same rule, with any coordinates.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from optisense.objectives.scoring import RETURNED
from optisense.search.space.constraints import RULE

if TYPE_CHECKING:
    from optisense.search.evaluation.outcome import Outcome
    from optisense.search.study.trial import Trial

FAILED = "failed"
"""Kind of the trials without a score; see `incomplete`."""

_PLACE = re.compile(r" at \([-+\d., e]+\)(?: mm)?")
"""Pattern of coordinates in a message, such as `` at (3.76, 11.51, 86.87) mm``."""

_NUMBER = re.compile(r"(?<![\w.'])(?<!\.py:)[-+]?\d+(?:[.,]\d+)*(?:e[-+]?\d+)?(?![\w'])")
"""Pattern of a number alone; digits in a name (``M1``) or in quotes (``'2'``) and the line of an
error in a file are no numbers."""

_DEFECT = re.compile(rf"{re.escape(RETURNED)} |\.py:\d+\)")
"""Pattern of the reason if the function of an objective, or of a rule, returned no valid value or
raised an error other than an `OptiSenseError`."""

_OF_RULE = re.compile(rf"{re.escape(RULE)} (returned|failed)")
"""Pattern of the reason if that was the function of a rule."""


@dataclass
class FailureCause:
    """Cause of failed trials.

    Attributes:
        text: reason without coordinates; other numbers are replaced by an ellipsis.
        example: first reason of this kind, in full.
        trials: trials that failed for this cause, in their order.
    """

    text: str
    example: str
    trials: list[Trial] = field(default_factory=list)


def is_defect(reason: str) -> bool:
    """Return whether a reason tells of an error in the function of an objective or of a rule."""
    return _DEFECT.search(reason) is not None or is_of_rule(reason)


def is_of_rule(reason: str) -> bool:
    """Return whether a reason tells of an error in the function of a rule."""
    return _OF_RULE.match(reason) is not None


def reason_of(outcome: Outcome) -> str:
    """Return why an outcome lacks a score or another value. The stored outcomes of earlier releases
    may have no reason for a condition without a value; the text then names what is missing.
    """
    return outcome.failure or f"there is no value of {', '.join(outcome.unmeasured)}"


def cause_of(reason: str) -> str:
    """Return the cause in a reason: the text without numbers that differ among trials."""
    return _NUMBER.sub("…", _PLACE.sub("", reason))


def incomplete(trials: Iterable[Trial]) -> dict[str, list[Trial]]:
    """Return the trials for which a value is missing, by kind: first those without a score
    (`FAILED`), then others, such as "without a value of aoap".
    """
    found: dict[str, list[Trial]] = {FAILED: []}
    for trial in trials:
        missing = trial.outcome.unmeasured
        if trial.outcome.lacking([trial.objective]):
            found[FAILED].append(trial)
        elif missing:
            found.setdefault(f"without a value of {', '.join(missing)}", []).append(trial)
    return {kind: members for kind, members in found.items() if members}


def counted(trials: Sequence[Trial]) -> str:
    """Return the number of trials as text; the start does not count against the budget and is named
    separately.
    """
    number = sum(not trial.is_start for trial in trials)
    parts = [f"{number:,} {'trial' if number == 1 else 'trials'}"] if number else []
    return " and ".join([*parts, *["the start"] * (number < len(trials))])


def causes_among(trials: Iterable[Trial]) -> list[FailureCause]:
    """Return the causes why trials have no score or lack a value, the most frequent first."""
    found: dict[str, FailureCause] = {}
    for trial in trials:
        reason = reason_of(trial.outcome)
        text = cause_of(reason)
        found.setdefault(text, FailureCause(text, reason)).trials.append(trial)
    return sorted(found.values(), key=lambda cause: -len(cause.trials))


def incomplete_note(best: Trial | None) -> str | None:
    """Return a note for the user if the best trial lacks the value of a further objective, else
    None.
    """
    if best is None or best.failure is None:
        return None
    return (
        f"trial {best.number} is the best by {best.objective}, the first objective, but another "
        f"objective failed: {best.failure}"
    )

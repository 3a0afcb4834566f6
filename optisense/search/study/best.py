"""Choice of the best trial of a study, also among trials with equal scores.

A trial that breaks a condition of the study is never the best. If trials were scored again with
fresh seeds, the means over these decide whether it breaks one.

The best trial has the highest score by fresh seeds if some trials were scored so, else the highest
score by the study's seed. A trial that was proposed after the last scoring with fresh seeds, as in
a resumed search that was interrupted, is the best if its score by the study's seed is higher than
that of each trial with fresh scores.

Scores that differ by rounding alone (`EQUAL`) are equal. Of trials with equal scores the one
nearest to the start is the best, since it changes least, and of equally near ones the one that was
proposed first. So the start itself wins every tie, and the same trials always have the same best
one, in whatever order workers finished.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from optisense.search.methods.dominance import front as front_of
from optisense.search.space.parameters import Choice
from optisense.search.study.trial import Trial

EQUAL = 1e-6
"""Relative difference of scores up to which they count as equal. Pictures are computed in single
precision, so that dimming all lights alike changes a score by up to 1e-7; no two sensors differ
noticeably by a millionth of a score."""


def without_rounding(scores: ArrayLike) -> NDArray[np.float64]:
    """Return scores (k,) of which those that differ by rounding alone (`EQUAL`) are the same: the
    highest of them.
    """
    found = np.array(scores, dtype=np.float64)
    highest = np.nan
    for number in np.argsort(-found):
        if not found[number] >= highest - EQUAL * abs(highest):
            highest = found[number]
        found[number] = highest
    return found


def distance(trial: Trial) -> float:
    """Return the distance of a trial from the start.

    It is the Euclidean norm over the parameters, each as a share (0 to 1) of its range; options of
    a choice count as 0 (the same) or 1 (another one).
    """
    space = trial.space
    share = np.abs(trial.vector - space.start) / space.span
    choices = np.array([isinstance(each.kind, Choice) for each in space.parameters])
    return float(np.linalg.norm(np.where(choices, share > 0.0, share)))


def ranked(trials: Iterable[Trial]) -> list[Trial]:
    """Return the trials scored by the study's seed that break no condition, the best first."""
    fine = [trial for trial in trials if math.isfinite(trial.score) and trial.is_feasible]
    scores = without_rounding([trial.score for trial in fine]).tolist()
    order = sorted(
        zip(scores, fine, strict=True), key=lambda it: (-it[0], distance(it[1]), it[1].number)
    )
    return [trial for _, trial in order]


def start_of(trials: Iterable[Trial]) -> Trial | None:
    """Return the trial of the starting design, or of the nearest point in the space, or None."""
    return next((trial for trial in trials if trial.is_start), None)


def best_of(trials: Sequence[Trial]) -> Trial | None:
    """Return the best trial by the rule above; None if none has a score and meets conditions."""
    fine = ranked(trials)
    candidates = [
        trial
        for trial in fine
        if math.isfinite(trial.fresh_score()) or (trial.is_newer and not trial.fresh)
    ]
    if candidates and not candidates[0].fresh:
        return candidates[0]
    again = [trial for trial in candidates if trial.fresh]
    if again:
        # `argmax` returns the first of equals, and `fine` is in the order of the rule.
        return again[int(without_rounding([trial.fresh_score() for trial in again]).argmax())]
    if any(trial.fresh for trial in trials):
        return None  # the rescored ones break conditions, and the others are not rescored
    return fine[0] if fine else None


def nearest(trials: Sequence[Trial]) -> Trial | None:
    """Return the trial with the smallest violation of the conditions, of equals the one with the
    highest score, or None if there is a best trial or none has a score.
    """
    scored = [trial for trial in trials if math.isfinite(trial.score) and not trial.is_feasible]
    if not scored or best_of(trials) is not None:
        return None
    return min(scored, key=lambda trial: (trial.violation, -trial.score, trial.number))


def newer_note(trials: Sequence[Trial]) -> str | None:
    """Return a note for the user if the best trial is newer than the fresh scores of others, else
    None.
    """
    best = best_of(trials)
    if best is None or best.fresh or not any(trial.fresh for trial in trials):
        return None
    return (
        f"trial {best.number} has not been scored with fresh seeds yet, so chance may be a part of "
        "its score; a search that is resumed does so at its end"
    )


def tied(trials: Sequence[Trial]) -> list[Trial]:
    """Return the trials that share the best score, each point once, the best trial first.

    Trials that fresh seeds have shown to be worse are left out.
    """
    best = best_of(trials)
    if best is None:
        return []
    fine = ranked(trials)
    place = fine.index(best)
    scores = without_rounding([trial.score for trial in fine])
    fresh = without_rounding([trial.fresh_score() for trial in fine])
    points: dict[bytes, Trial] = {best.vector.tobytes(): best}
    for number in np.flatnonzero((scores == scores[place]) & ~(fresh < fresh[place])):
        points.setdefault(fine[number].vector.tobytes(), fine[number])
    return list(points.values())


def tie_note(trials: Sequence[Trial]) -> str | None:
    """Return a note for the user if several trials share the best score, else None."""
    same = tied(trials)
    if len(same) < 2:
        return None
    best = same[0]
    points = {trial.vector.tobytes() for trial in ranked(trials)}
    if len(same) == len(points):
        return (
            f"all {len(same)} designs that were scored have the same score: within these bounds "
            f"{best.objective or 'it'} does not depend on the parameters"
        )
    named = "the start, which changes nothing, is" if best.is_start else f"trial {best.number} is"
    return (
        f"{len(same)} trials share the best score; {named} named the best, as the nearest to the "
        "start"
    )


def front_among(trials: Sequence[Trial], names: Sequence[str]) -> list[Trial]:
    """Return the trials that no other one dominates, the best in the first objective first.

    Trials that break a condition are left out. Scores that differ by rounding alone are equal.
    """
    trials = [trial for trial in trials if trial.is_feasible]
    if not trials:
        return []
    scores = [[trial.scores.get(name, np.nan) for trial in trials] for name in names]
    values = np.stack([without_rounding(each) for each in scores], axis=1)
    chosen = [trials[number] for number in front_of(values)]
    return sorted(chosen, key=lambda trial: -trial.score)

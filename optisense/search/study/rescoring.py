"""Scoring of the best trials with fresh seeds before one is announced.

The largest of many noisy scores is too large on average: it won partly by chance. So the best trial
is scored with seeds that were not used in its choice, and so are the next ones as long as they may
really be better.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from optisense.search.evaluation.outcome import Outcome
from optisense.search.methods import find
from optisense.search.study.best import ranked
from optisense.search.study.study import Study
from optisense.search.study.trial import Trial

SEEDS = 3
"""Number of fresh seeds with which each trial is scored again; their standard deviation tells how
well the mean is known.
"""

MOST_RESCORED = 5
"""Largest number of trials that are scored again, which bounds the time at the end of a search."""

MOST_BROKEN = 20
"""Largest number of trials that are scored again while each breaks a condition with fresh seeds:
scores beside a limit break it by chance in about half of the cases.
"""

_FRESH = 0xF2E5
"""Constant that is mixed into a study's seed, so that fresh seeds are independent of those of its
trials; its value is arbitrary.
"""

Work = Callable[[Sequence[tuple[Trial, int]], int], list[Outcome]]
"""Function that scores trials with seeds. It also takes the number of such scores that may follow
for these trials.
"""


def fresh_seeds(seed: int, count: int = SEEDS) -> list[int]:
    """Return seeds that are independent of a study's own."""
    words = np.random.SeedSequence([seed, _FRESH]).generate_state(count + 1).tolist()
    return [word for word in words if word != seed][:count]


def rescore(study: Study, work: Work) -> None:
    """Score the start and the best trials with fresh seeds; existing scores are kept."""
    seeds = fresh_seeds(study.settings.seed)
    trials = study.trials
    fine = ranked(trials)
    start = [trial for trial in fine if trial.is_start]
    others = [trial for trial in fine if not trial.is_start]
    if find(study.settings.method).multi_objective:
        _score([*start, *_along_front(study)], seeds, work)
        return
    best = -math.inf
    if start and not others and study.settings.requirements:
        _score(start, seeds, work)
    for number, trial in enumerate(others[:MOST_BROKEN]):
        if trial.score <= best or (number >= MOST_RESCORED and best > -math.inf):
            return  # even with its luck it is not better, or enough were scored
        group = [trial, *start] if number == 0 else [trial]
        again = _score(group, seeds, work)[0]
        if again.is_feasible and math.isfinite(again.fresh_score()):
            best = max(best, again.fresh_score())


def scored(trials: Sequence[Trial], seeds: Sequence[int], work: Work, more: int = 0) -> list[Trial]:
    """Return the trials with full scores by these seeds; `more` scores are expected later."""
    jobs = [(trial, seed) for trial in trials for seed in seeds if seed not in trial.fresh]
    outcomes = work(jobs, more) if jobs else []
    fresh = {trial.number: dict(trial.fresh) for trial in trials}
    for (trial, seed), outcome in zip(jobs, outcomes, strict=True):
        fresh[trial.number][seed] = outcome
    return [replace(trial, fresh=fresh[trial.number]) for trial in trials]


def _score(trials: Sequence[Trial], seeds: Sequence[int], work: Work) -> list[Trial]:
    """Return the trials with scores by fresh seeds, or by one of them if seeds do not matter."""
    first = scored(trials, seeds[:1], work, more=len(trials) * (len(seeds) - 1))
    noisy = [each for each in first if not _alike(each.fresh[seeds[0]], each.outcome)]
    known = {each.number: each for each in scored(noisy, seeds[1:], work)}
    return [known.get(each.number, each) for each in first]


def _alike(one: Outcome, other: Outcome) -> bool:
    """Return whether two seeds give the same scores and the same values of limited quantities."""
    same = dict(one.conditions) == dict(other.conditions)
    return same and dict(one.scores) == dict(other.scores)


def _along_front(study: Study) -> list[Trial]:
    """Return some trials of the front, from one end to the other."""
    front = study.front
    if len(front) <= MOST_RESCORED:
        return front
    places = np.linspace(0, len(front) - 1, MOST_RESCORED).round().astype(int)
    return [front[place] for place in places]

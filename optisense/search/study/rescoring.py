"""Scoring of the best trials with fresh seeds before one is announced.

The largest of many noisy scores is too large on average: it won partly by chance. So the best trial
is scored with seeds that were not used in its choice, and so are the next ones as long as they may
really be better.

Where trials have coarse scores, the promising ones get full scores. This is successive halving
(Jamieson and Talwalkar, "Non-stochastic best arm identification and hyperparameter optimization",
2016) in three rungs: coarse scores of all trials, a full score of those that may be the best, and
further full scores, with other seeds, of those that lead. How many trials are promoted follows from
the noise: the differences between full and coarse scores tell by how much a coarse score can be
wrong.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from optisense.search.evaluation.outcome import Outcome
from optisense.search.methods import find
from optisense.search.space.parameters import Choice
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

BATCH = 3
"""Number of trials that get a full score together: the fewest that show how much the difference
between full and coarse scores varies. More would take most of the time of a search of 40 trials.
"""

LEAST_PROMOTED, PROMOTED_SHARE = 6, 0.1
"""Largest number of trials that get full scores: a tenth of all trials, or 6 if that is more. A
full score takes as long as six coarse ones.
"""

DEVIATIONS = 2.0
"""Number of standard deviations by which the full score of a trial may exceed what its coarse score
suggests; 95 % of a normal distribution are within two."""

SAME_DESIGN = 0.02
"""Largest difference between two points, as a share of each range, at which they count as the same
design, so that only the better one is promoted: the last trials of CMA-ES are nearly equal.
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
    first, second = ([each.scores[name] for name in one.scores] for each in (one, other))
    same = dict(one.conditions) == dict(other.conditions)
    return same and np.array_equal(first, second, equal_nan=True)


def _along_front(study: Study) -> list[Trial]:
    """Return some trials of the front, from one end to the other."""
    front = study.front
    if len(front) <= MOST_RESCORED:
        return front
    places = np.linspace(0, len(front) - 1, MOST_RESCORED).round().astype(int)
    return [front[place] for place in places]


def promote(study: Study, work: Work) -> None:
    """Give the start and the promising trials of a study full scores with fresh seeds. The start
    gets one, and further ones only if chance may be why it is worse than the trial that leads.
    """
    seeds = fresh_seeds(study.settings.seed)
    trials = study.trials
    start = [trial for trial in trials if trial.is_start and math.isfinite(trial.score)]
    waiting = _different([trial for trial in ranked(trials) if not trial.is_start])
    most = max(LEAST_PROMOTED, math.ceil(PROMOTED_SHARE * len(trials)))
    promoted: list[Trial] = []
    while waiting and len(promoted) < (most if _leader(promoted) else MOST_BROKEN):
        batch = _promising(promoted, waiting[:BATCH])
        if not batch:
            break
        waiting = waiting[len(batch) :]
        further = len(seeds[1:])
        promoted += scored(batch, seeds[:1], work, further)
        if start:
            start = scored(start, seeds[:1], work, further)
    while (leader := _leader(promoted)) is not None and len(leader.fresh) < len(seeds):
        others = [trial for trial in promoted if trial.number != leader.number]
        promoted = [*scored([leader], seeds, work), *others]
    if start and leader is not None:  # two scores of a design differ by chance, as the leader's do
        chance = DEVIATIONS * math.sqrt(2.0) * leader.fresh_spread()
        if start[0].fresh_score() > leader.fresh_score() - chance:
            scored(start, seeds, work)


def _promising(promoted: Sequence[Trial], batch: Sequence[Trial]) -> list[Trial]:
    """Return the trials of a batch that may beat the promoted ones; all while none leads."""
    leader = _leader(promoted)
    if leader is None:
        return list(batch)
    shifts = np.array([trial.fresh_score() - trial.score for trial in promoted])
    known = shifts[np.isfinite(shifts)]
    slack = DEVIATIONS * float(known.std(ddof=1)) if len(known) > 1 else math.inf
    least = leader.fresh_score() - float(known.mean()) - slack
    return [trial for trial in batch if trial.score > least]


def _leader(promoted: Sequence[Trial]) -> Trial | None:
    """Return the trial with the best mean of full scores that meets all conditions, or None."""
    fine = [each for each in promoted if math.isfinite(each.fresh_score()) and each.is_feasible]
    return max(fine, key=lambda trial: (trial.fresh_score(), trial.score), default=None)


def _different(trials: Sequence[Trial]) -> list[Trial]:
    """Return the trials without those that are nearly equal (`SAME_DESIGN`) to one before them."""
    if not trials:
        return []
    space = trials[0].space
    choices = np.array([isinstance(each.kind, Choice) for each in space.parameters])
    span = np.where(choices, 1.0, space.span)
    kept: list[Trial] = []
    points = np.empty((0, space.size))
    for trial in trials:
        point = trial.vector / span
        if not (np.abs(points - point) <= SAME_DESIGN).all(axis=1).any():
            kept.append(trial)
            points = np.vstack([points, point])
    return kept

"""Stages of a search and their usual durations, for estimates of the time left."""

from __future__ import annotations

from optisense.objectives.usual_score import UsualTrials
from optisense.time_left import TimedStep, TimeLeft

START_STAGE, TRIALS, FRESH = "start", "trials", "fresh seeds"

USUAL_FRESH = 9
"""Number of scores with fresh seeds that a search is expected to need: three for the start, for the
best trial, and for one that might be better.
"""


def stages(
    limit: int, usual: UsualTrials | None, workers: int = 1, *, plain_trials: bool = True
) -> list[TimedStep]:
    """Return the stages of a search, with the usual durations of their scores, if known.

    Args:
        limit: largest number of trials.
        usual: usual durations of scores, s.
        plain_trials: whether the start and the trials are scored as usual; else their times, such
            as those with derivatives and their compiling, do not tell how fast this machine is.
    """
    if usual is None:
        return [
            TimedStep(START_STAGE),
            TimedStep(TRIALS, limit),
            TimedStep(FRESH, USUAL_FRESH),
        ]
    return [
        # each worker has a share of the processors
        TimedStep(START_STAGE, 1, usual.first * workers, gauges=plain_trials),
        TimedStep(TRIALS, limit, usual.trial, gauges=plain_trials),
        TimedStep(FRESH, USUAL_FRESH, usual.fresh),
    ]


def expect_stages(
    time_left: TimeLeft,
    limit: int,
    usual: UsualTrials | None,
    workers: int = 1,
    *,
    plain_trials: bool = True,
) -> None:
    """Update the expected durations of the stages of a search among the steps of a command."""
    for step in stages(limit, usual, workers, plain_trials=plain_trials):
        time_left.expect(step.name, step.count, step.seconds, step.gauges)

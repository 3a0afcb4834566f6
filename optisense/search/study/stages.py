"""The stages of a search, with what they usually take, for its time left."""

from __future__ import annotations

from optisense.objectives.usual_score import UsualTrials
from optisense.time_left import TimedStep, TimeLeft

START_STAGE, TRIALS, FRESH = "start", "trials", "fresh seeds"

USUAL_FRESH = 9
"""Scores with fresh seeds that a search is expected to need: three for the start, for the best
trial, and for one that might be better."""


def stages(
    limit: int, usual: UsualTrials | None, workers: int = 1, *, plain_trials: bool = True
) -> list[TimedStep]:
    """The stages of a search of so many trials, with what their scores usually take, if known.

    Args:
        limit: trials of the search, at most.
        usual: seconds that scores usually take.
        workers: processes that score.
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
        # on a share of the processors
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
    """Correct what is expected of the stages among the steps of a command that searches."""
    for step in stages(limit, usual, workers, plain_trials=plain_trials):
        time_left.expect(step.name, step.count, step.seconds, step.gauges)

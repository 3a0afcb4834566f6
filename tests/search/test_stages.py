"""The time left of a search."""

from __future__ import annotations

import pytest

from optisense.objectives.usual_score import UsualScore, UsualTrials
from optisense.search.study.stages import START_STAGE, TRIALS, expect_stages, stages
from optisense.time_left import TimeLeft


@pytest.mark.parametrize(("plain", "most"), [(True, 9 * 3.0 * 90), (False, 9 * 3.0 * 1.5)])
def test_trials_with_derivatives_do_not_make_the_machine_slow(plain: bool, most: float) -> None:
    """Trials take 80 times as long as usual, and the start compiles what gives derivatives; nine
    scores with fresh seeds follow."""
    now = [0.0]
    usual = UsualTrials(
        UsualScore(0.0, 0.0, 1.0, 1.0, 0.0, 0.0), first=2.0, trial=0.05, fresh=3.0, fresh_again=3.0
    )
    left = TimeLeft(stages(60, None), clock=lambda: now[0])  # as a command makes it
    expect_stages(left, 60, usual, plain_trials=plain)
    left.begin(START_STAGE)
    now[0] += 2.0 if plain else 60.0
    left.begin(TRIALS)
    for done in range(1, 60):
        now[0] += 4.0
        left.advance(done, 4.0, "this process")
    assert most / 3 < left.seconds_left < most

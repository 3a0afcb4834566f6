"""The time left, by a clock that the tests turn."""

from __future__ import annotations

import math

import pytest

from optisense.time_left import TimeLeft


class Clock:
    """Tells the time that it was set to."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


def test_nothing_is_promised_before_anything_is_known(clock: Clock) -> None:
    left = TimeLeft(40, clock=clock)
    clock.now = 30.0
    assert math.isnan(left.seconds_left)
    assert left.fraction == 0.0


def test_compiling_in_the_first_piece_is_soon_forgotten(clock: Clock) -> None:
    left = TimeLeft(100, clock=clock)
    clock.now = 70.0
    left.advance(1)
    for done in range(2, 76):
        clock.now += 1.0
        left.advance(done)
    assert left.seconds_left == pytest.approx(25.0)


@pytest.mark.parametrize("workers", [1, 2, 8])
def test_workers_share_the_pieces_and_each_compiles_first(clock: Clock, workers: int) -> None:
    compiling, each, count = 20.0, 5.0, 400
    ends = sorted(
        compiling + each * number + 0.1 * worker
        for worker in range(workers)
        for number in range(1, count // workers + 1)
    )
    whole = ends[-1]
    left = TimeLeft(count, clock=clock)
    for done, now in enumerate(ends, start=1):
        clock.now = now
        left.advance(done)
        if now > 0.25 * whole:
            assert now + left.seconds_left == pytest.approx(whole, rel=0.1)


def test_pieces_of_an_earlier_run_cost_nothing_now(clock: Clock) -> None:
    left = TimeLeft(100, done=60, clock=clock)
    assert left.fraction == 0.6
    for done in range(61, 66):
        clock.now += 2.0
        left.advance(done)
    assert left.seconds_left == pytest.approx(35 * 2.0)


def test_time_goes_by_between_pieces_and_a_late_one_does_not_count_below_zero(
    clock: Clock,
) -> None:
    left = TimeLeft(3, clock=clock)
    clock.now = 10.0
    left.advance(1)
    assert left.seconds_left == pytest.approx(20.0)
    clock.now = 16.0
    assert left.seconds_left == pytest.approx(14.0)
    clock.now = 60.0  # the second one is late; the third one still takes its time
    assert left.seconds_left == pytest.approx(10.0)


def test_a_pace_that_changes_is_followed(clock: Clock) -> None:
    left = TimeLeft(1000, clock=clock)
    for done in range(1, 221):
        clock.now += 5.0 if done <= 20 else 1.0
        left.advance(done)
    assert left.seconds_left == pytest.approx(780.0)


def test_many_pieces_are_not_all_remembered(clock: Clock) -> None:
    left = TimeLeft(100_000, clock=clock)
    for done in range(1, 50_001):
        clock.now += 0.01
        left.advance(done)
    assert left.seconds_left == pytest.approx(500.0, rel=1e-6)


def test_parts_of_a_piece_count(clock: Clock) -> None:
    left = TimeLeft(1.0, clock=clock)
    for done in (0.1, 0.2, 0.3):
        clock.now += 1.0
        left.advance(done)
    left.advance(0.3)  # nothing new
    assert left.seconds_left == pytest.approx(7.0)
    assert left.fraction == 0.3
    left.advance(1.0)
    assert left.seconds_left == 0.0

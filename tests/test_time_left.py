"""The time left, by a clock that the tests turn."""

from __future__ import annotations

import json
import math
import os
import time
from pathlib import Path

import pytest

from benchmarks.progress_records import promised
from optisense import usual_times
from optisense.objectives import Settings
from optisense.objectives.usual_score import usual_score
from optisense.sensors import load
from optisense.time_left import TimedStep, TimeLeft


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
    left = TimeLeft([TimedStep("trials", 40)], clock=clock)
    assert math.isnan(left.seconds_left)
    left.begin("trials")
    clock.now = 30.0
    assert math.isnan(left.seconds_left)
    assert left.fraction == 0.0


def test_compiling_in_the_first_trial_does_not_count(clock: Clock) -> None:
    # The search by light colours: a first trial of 70 s, the others of 0.1 s.
    left = TimeLeft([TimedStep("start"), TimedStep("trials", 6000)], clock=clock)
    left.begin("start")
    clock.now = 70.0
    left.advance(1, 70.0, "here")
    left.begin("trials")
    for done in range(1, 61):
        clock.now += 0.1
        left.advance(done, 0.1, "here")
    assert left.seconds_left == pytest.approx(594.0)


@pytest.mark.parametrize("workers", [2, 8])
def test_workers_share_the_pieces_and_each_compiles_first(clock: Clock, workers: int) -> None:
    compiling, each, count = 20.0, 5.0, 400
    ends = sorted(
        (compiling + each * number + 0.1 * worker, number == 1, f"worker {worker}")
        for worker in range(workers)
        for number in range(1, count // workers + 1)
    )
    whole = ends[-1][0]
    left = TimeLeft([TimedStep("trials", count)], workers, clock)
    left.begin("trials")
    for done, (now, first, worker) in enumerate(ends, start=1):
        clock.now = now
        left.advance(done, each + compiling * first, worker)
        if now > 0.1 * whole:
            assert now + left.seconds_left == pytest.approx(whole, rel=0.25)


def test_later_steps_take_longer_where_the_earlier_ones_did(clock: Clock) -> None:
    steps = [
        TimedStep("loading", 1, 2.0),
        TimedStep("tracing", 10, 1.0),
        TimedStep("shading", 1, 3.0),
    ]
    left = TimeLeft(steps, clock=clock)
    left.begin("loading")
    assert left.seconds_left == 15.0
    clock.now = 4.0  # twice the usual time
    left.begin("tracing")
    assert left.seconds_left == pytest.approx(26.0)
    for done in range(1, 11):
        clock.now += 3.0  # three times the usual time
        left.advance(done)
    left.begin("shading")
    assert left.seconds_left == pytest.approx(3.0 * (4.0 + 30.0) / 12.0)


def test_a_step_that_is_late_makes_the_later_ones_longer(clock: Clock) -> None:
    left = TimeLeft([TimedStep("before", 1, 10.0), TimedStep("after", 1, 8.0)], clock=clock)
    left.begin("before")
    clock.now = 5.0
    assert left.seconds_left == pytest.approx(13.0)
    clock.now = 20.0  # at least twice as slow as usual
    assert left.seconds_left == pytest.approx(16.0)


def test_a_later_step_counts_from_the_beginning(clock: Clock) -> None:
    left = TimeLeft([TimedStep("trials", 10), TimedStep("fresh seeds", 6)], clock=clock)
    left.begin("trials")
    clock.now = 2.0
    left.advance(1)
    assert math.isnan(left.seconds_left)  # nobody knows what a fresh seed takes
    left.expect("fresh seeds", seconds=4.0)
    assert left.seconds_left == pytest.approx(9 * 2.0 + 6 * 4.0)
    left.expect("fresh seeds", count=9)
    assert left.seconds_left == pytest.approx(9 * 2.0 + 9 * 4.0)
    assert left.seconds_left_of("fresh seeds") == pytest.approx(36.0)


def test_pieces_of_an_earlier_run_cost_nothing_now(clock: Clock) -> None:
    left = TimeLeft([TimedStep("samples", 100, warm_up=1)], clock=clock)
    left.begin("samples", done=60)
    clock.now = 30.0  # the first one of this run traces the light
    left.advance(61)
    assert math.isnan(left.seconds_left)
    for done in range(62, 66):
        clock.now += 2.0
        left.advance(done)
    assert left.seconds_left == pytest.approx(35 * 2.0)


def test_time_goes_by_between_pieces_and_a_late_one_does_not_count_below_zero(
    clock: Clock,
) -> None:
    left = TimeLeft([TimedStep("sensors", 3)], clock=clock)
    left.begin("sensors")
    clock.now = 10.0
    left.advance(1)
    assert left.seconds_left == pytest.approx(20.0)
    clock.now = 16.0
    assert left.seconds_left == pytest.approx(14.0)
    clock.now = 60.0  # the second one is late; the third one still takes its time
    assert left.seconds_left == pytest.approx(10.0)


def test_a_pace_that_changes_is_followed(clock: Clock) -> None:
    left = TimeLeft([TimedStep("trials", 1000)], clock=clock)
    left.begin("trials")
    for done in range(1, 101):
        clock.now += 5.0 if done <= 20 else 1.0
        left.advance(done)
    assert left.seconds_left == pytest.approx(900.0)


def test_the_fraction_never_falls(clock: Clock) -> None:
    left = TimeLeft([TimedStep("seeds", 10, 1.0)], clock=clock)
    left.begin("seeds")
    before = 0.0
    for done in range(1, 11):
        clock.now += 1.0 if done % 2 else 4.0
        left.advance(done)
        assert left.fraction >= before
        before = left.fraction
    assert before == 1.0


def test_many_pieces_are_not_all_remembered(clock: Clock) -> None:
    left = TimeLeft([TimedStep("trials", 100_000)], clock=clock)
    left.begin("trials")
    for done in range(1, 50_001):
        clock.now += 0.01
        left.advance(done)
    assert left.seconds_left == pytest.approx(500.0, rel=1e-6)


def test_pieces_of_unequal_size_count_by_their_size(clock: Clock) -> None:
    """The first score of a fresh seed traces light; later ones are a tenth of it."""
    left = TimeLeft([TimedStep("trials", 1), TimedStep("fresh", 3.6)], clock=clock)
    left.begin("trials")
    left.advance(1, 9.0, "here")  # compiles
    left.begin("fresh")
    for done, seconds in [(1.0, 4.0), (1.1, 0.4), (2.1, 4.0)]:
        clock.now += seconds
        left.advance(done, seconds, "here")
    assert left.seconds_left == pytest.approx(1.5 * 4.0)


def test_an_unknown_step_is_refused(clock: Clock) -> None:
    left = TimeLeft([TimedStep("a"), TimedStep("b")], clock=clock)
    left.begin("b")
    with pytest.raises(ValueError, match="no step 'a' follows"):
        left.begin("a")


RECORDS = sorted((Path(__file__).parent / "assets" / "progress").glob("*.json"))
"""What the progress lines of commands were told, with processor seconds: see
benchmarks/progress_records.py."""


LONG = 10.0
"""Seconds of a run, of whose first tenth loading is not the most."""


@pytest.mark.parametrize("file", RECORDS, ids=lambda file: file.stem)
def test_a_tenth_of_a_command_tells_its_total_within_a_quarter(file: Path) -> None:
    told = json.loads(file.read_text(encoding="utf-8"))
    first, *later, whole = promised(told, (0.1, 0.25, 0.5, 0.75))
    if whole >= LONG:
        assert 0.8 <= first <= 1.25
    assert all(0.74 <= each <= 1.25 for each in later)


def test_what_a_score_usually_takes_grows_with_its_work() -> None:
    mini, large = load("gelsight-mini-ideal"), load("gelbelt")
    few, many = Settings(photons=1_000_000), Settings(photons=5_000_000)
    one, more = (usual_score(mini, ["rgb2normal"], each) for each in (few, many))
    assert more.light > 3.0 * one.light
    assert more.images == pytest.approx(one.images, rel=0.2)
    assert usual_score(large, ["rgb2normal"], few).light > 2.0 * one.light
    assert usual_score(mini, ["aoap", "2to3pw"], few).light == 0.0
    assert 0.0 < one.share_of_first_image < more.share_of_first_image < 1.0


def test_work_of_other_processes_slows_this_one_and_a_wait_does_not(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(usual_times, "processors", lambda: 2)
    monkeypatch.setattr(
        usual_times, "_BEGAN", (time.monotonic() - 30.0, time.process_time() - 10.0)
    )
    for load_average, expected in [(0.2, 1.0), (3.0, 2.0), (20.0, 3.0)]:
        monkeypatch.setattr(os, "getloadavg", lambda load=load_average: (load, 0.0, 0.0), False)
        assert usual_times.crowding() == pytest.approx(expected, rel=0.01)

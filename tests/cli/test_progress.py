"""Progress of a long command on a terminal and in a log."""

from __future__ import annotations

import io
import math
import re

import pytest
from rich.console import Console

from optisense.cli import progress
from optisense.cli.progress import ProgressLine, about, duration, progress_line
from optisense.design import SensorDesign
from optisense.search import SearchProgress


class Clock:
    """Clock whose time the test sets."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


CLOCK_AND_LEFT = re.compile(r"(\d+:)?\d+:\d\d(, (\d+:)?\d+:\d\d left)?")
SEARCHES = [
    SearchProgress("start", 0, 2000, 0, math.nan, math.nan, 0.0, math.nan),
    SearchProgress("trials", 7, 2000, 0, 0.98765, 0.80712, 0.0, math.nan),
    SearchProgress("trials", 1234, 2000, 17, 0.98765, 0.80712, 126_632.0, 35.4),
    SearchProgress("trials", 65_612, 65_612, 1_017, -0.0098765, -10.807, 126_632.0, 616_444.0),
    SearchProgress("fresh seeds", 2, 9, 17, 0.98765, 0.80712, 126_632.0, 61.0),
]


@pytest.mark.parametrize("columns", [20, 40, 60, 80, 200])
@pytest.mark.parametrize("told", SEARCHES)
def test_a_search_fits_the_terminal(told: SearchProgress, columns: int) -> None:
    from optisense.cli.searching import notes, stage_text

    clock = Clock()
    line = ProgressLine(clock=clock)
    what, done, total = stage_text(told)
    line.follow(what, 0, total)
    clock.now = 4321.0
    line.follow(what, done, total, notes(told))
    text = line.text(columns - 1).plain
    assert len(text) < columns
    assert CLOCK_AND_LEFT.search(text) or columns < 40
    if columns >= 60:
        assert text.startswith(stage_text(told)[0])
        if told.stage == "trials":
            assert f"{told.done}/{told.total}" in text
        if told.stage == "trials":
            left = 4321.0 * (told.total - told.done) / told.done
            assert f"{duration(left)} left" in text
    if columns >= 80 and told.best == 0.98765 and told.stage == "trials":
        assert "best 0.9877 (start 0.8071)" in text
    if columns == 200 and told.failed and told.stage == "trials":
        assert "126,632 trials/h" in text
        assert f"{told.failed} failed" in text


def test_a_line_names_the_step_and_counts_its_time() -> None:
    clock = Clock()
    line = ProgressLine(clock=clock)
    line.begin("loading")
    clock.now = 2.0
    assert line.text(79).plain == f"loading {'─' * 30}  0:02"
    line.begin("tracing photons", 10)
    clock.now = 7.0
    line.advance(4, 10, "noise 2.4 %")
    text = line.text(79).plain
    assert text.startswith("tracing photons 4/10 ━")
    assert text.endswith("0:07, 0:08 left  noise 2.4 %")
    assert text.count("━") == pytest.approx(0.4 * (text.count("━") + text.count("─")), abs=1)
    assert line.pace == pytest.approx(1.25)


def test_the_bar_never_goes_back_and_the_clock_never_stops() -> None:
    clock = Clock()
    line = ProgressLine(clock=clock)
    line.begin("seeds", 6)
    full, clocks = 0, []
    for number in range(6):
        for part in (0.3, 0.2, 1.0):  # objectives of a seed begin anew
            clock.now += 5.0
            line.advance(number + part)
            text = line.text(79).plain
            assert text.count("━") >= full
            full = text.count("━")
            clocks.append(CLOCK_AND_LEFT.search(text)[0].split(",")[0])  # type: ignore[index]
    assert clocks == [duration(5.0 * k) for k in range(1, 19)]


def test_a_step_begins_where_the_text_changes() -> None:
    clock = Clock()
    line = ProgressLine(clock=clock)
    line.follow("scoring the start", None, None)
    clock.now = 30.0  # compiling
    for done in range(4):
        line.follow("trials", done, 9)
        clock.now += 2.0
    clock.now -= 1.0
    assert "0:37, 0:11 left" in line.text(79).plain


def test_in_a_log_a_line_comes_now_and_then(monkeypatch: pytest.MonkeyPatch) -> None:
    log = io.StringIO()
    monkeypatch.setattr(progress, "messages", Console(file=log, width=120))
    clock = Clock()
    monkeypatch.setattr(progress.time, "monotonic", clock)
    with progress_line() as line:
        line.begin("samples", 9)
        for done, now in enumerate([10.0, 45.0, 50.0, 80.0], start=1):
            clock.now = now
            line.advance(done, 9, f"contact {done}")
    assert log.getvalue().splitlines() == [
        "samples 2/9, 0:45 so far, 4:05 left, contact 2",
        "samples 4/9, 1:20 so far, 1:57 left, contact 4",
    ]


def test_on_a_terminal_one_line_is_drawn_and_goes(monkeypatch: pytest.MonkeyPatch) -> None:
    screen = io.StringIO()
    console = Console(file=screen, force_terminal=True, width=80)
    monkeypatch.setattr(progress, "messages", console)
    with progress_line() as line:
        line.begin("samples", 9)
        line.advance(3, 9, "contact 3")
    assert screen.getvalue().endswith("\x1b[2K")
    shown = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", screen.getvalue())
    assert "samples 3/9" in shown
    assert "contact 3" in shown


@pytest.mark.parametrize(
    ("seconds", "words"),
    [(math.nan, ""), (0.2, ", about 1 s"), (11.4, ", about 12 s"), (170.0, ", about 3 min")],
)
def test_times_in_words(seconds: float, words: str) -> None:
    assert about(seconds) == words
    assert duration(3725.0) == "1:02:05"


def test_the_bar_of_a_tolerance_counts_the_sensors_that_its_page_tells_of() -> None:
    from optisense.cli.tolerance import stage_text
    from optisense.search.tolerance.analysis import tolerance
    from optisense.sensors import load

    def flux(design: SensorDesign) -> float:
        return design.lights["red"].flux

    told: list[tuple[str, int, int]] = []
    found = tolerance(
        load("gelsight-mini-ideal"),
        flux,
        {"lights.red.flux": 0.1, "lights.blue.flux": 0.1},
        sensors=30,
        progress=lambda done, count, doing: told.append(stage_text(done, count)),
    )
    assert told[0] == ("scoring the nominal design", 0, 4)
    assert told[-1] == ("scoring sensors", found.sensors, found.sensors)


def test_a_search_that_runs_the_wrong_way_is_told_once_and_in_time() -> None:
    from optisense.cli.searching import WORTH_STOPPING, EarlyWarnings

    def told(
        left: float, worsened: dict[str, str], generations: int = 0, nearest: str = ""
    ) -> SearchProgress:
        return SearchProgress(
            *("trials", 20, 90, 0, 0.6, 0.3, 0.0, left),
            worsened=worsened,
            generations=generations,
            nearest=nearest,
        )

    warnings = EarlyWarnings()
    stretched = {"distortion": "2.1 (start 1.15)"}
    assert warnings.of(told(0.5 * WORTH_STOPPING, stretched)) == []
    assert warnings.of(told(math.nan, {})) == []
    (first,) = warnings.of(told(2.0 * WORTH_STOPPING, stretched))
    assert "distortion 2.1 (start 1.15)" in first
    assert warnings.of(told(2.0 * WORTH_STOPPING, stretched)) == []
    worse = {**stretched, "coverage": "0.35 (start 0.57)"}
    (second,) = warnings.of(told(2.0 * WORTH_STOPPING, worse))
    assert "coverage 0.35" in second
    broken = "coverage >= 0.9 (is 0.57)"
    assert warnings.of(told(2.0 * WORTH_STOPPING, worse, 0, broken)) == []
    (third,) = warnings.of(told(2.0 * WORTH_STOPPING, worse, 1, broken))
    assert "none of the first 20 trials" in third
    assert broken in third
    assert warnings.of(told(2.0 * WORTH_STOPPING, worse, 2, broken)) == []

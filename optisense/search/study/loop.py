"""The loop of a study: generation by generation, until its budget is spent or the user stops it."""

from __future__ import annotations

import math
import queue
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from contextlib import contextmanager
from dataclasses import replace
from functools import partial

import numpy as np

from optisense.search.evaluation.evaluator import Evaluator
from optisense.search.evaluation.outcome import Outcome
from optisense.search.executors import Runner, SerialRunner
from optisense.search.executors.base import outcome_of
from optisense.search.methods import Method, Problem, make
from optisense.search.study._evaluators import evaluators, usual_times
from optisense.search.study._promotion import promote
from optisense.search.study._reading_watch import ReadingWatch
from optisense.search.study._tally import Tally
from optisense.search.study.advice import moved_start_note
from optisense.search.study.best import tie_note
from optisense.search.study.conditions import condition_note, worsened_note
from optisense.search.study.progress import SearchProgress, SearchProgressCallback, SearchResult
from optisense.search.study.rescoring import SEEDS as FRESH_SEEDS
from optisense.search.study.rescoring import rescore
from optisense.search.study.settings import package_versions
from optisense.search.study.stages import (
    FRESH,
    START_STAGE,
    TRIALS,
    USUAL_FRESH,
    expect_stages,
    stages,
)
from optisense.search.study.store import START, Row
from optisense.search.study.study import Study
from optisense.search.study.trial import Trial
from optisense.time_left import TimeLeft

SAME_POINT = 1e-9
"""Largest difference, as a share of the range, between proposals that count as the same point;
releases of libraries differ in rounding.
"""

TICK = 0.2
"""Interval between checks of the clock while trials are scored, s; short for a smooth display."""

FRESH_SHARE = 0.8
"""Smallest duration of the first score with a fresh seed, as a share of the first trial's duration.
Such a score takes as long as a trial, or this share if that is longer: if trials share the light
that is traced for the first one, another seed needs its own. The rest of the first trial's time is
taken to be compiling.
"""


MakeRunner = Callable[[Evaluator], Runner]


class StudyRun:
    """Run of a study, in this process and on its workers."""

    def __init__(
        self,
        study: Study,
        make_runner: MakeRunner,
        progress: SearchProgressCallback | None = None,
        limit: int | None = None,
        variant: str = "auto",
        time_left: TimeLeft | None = None,
    ) -> None:
        """Set up the run; nothing is scored yet.

        Args:
            study: new study, or one that was stopped.
            make_runner: function that returns the executor of the trials.
            progress: function that is called a few times a second.
            limit: largest number of trials; the study's budget if None.
            time_left: time estimate of a command whose last steps are the stages of this search.

        Raises:
            OptiSenseError: the study can't be run here.
        """
        self.study = study
        settings = study.settings
        self.limit = settings.budget if limit is None else limit
        usual = study.evaluator(variant)
        self._coarse = settings.coarse_first
        problem = Problem(
            study.space,
            tuple(settings.names),
            settings.budget,
            settings.seed,
            tuple(settings.requirements),
        )
        self.method: Method = make(settings.method, problem, settings.options)
        self._evaluator, self._full = evaluators(study, usual, self.method)
        self._usual = usual_times(self._evaluator, self._full)
        self._make_runner = make_runner
        self._progress = progress or (lambda progress: None)
        self._notes: list[str] = []
        self._finished: queue.SimpleQueue[tuple[int, Future[Outcome]]] = queue.SimpleQueue()
        self._tally = Tally(study.objective)
        self._watch = ReadingWatch(study, self._tally, usual)
        self._first_seconds = 0.0
        self._last_report = time.monotonic()
        self._stage = START_STAGE
        self._plain = self._coarse or self._full is usual or settings.errors is not None
        steps = stages(self.limit, self._usual, plain_trials=self._plain)
        self._time_left = time_left or TimeLeft(steps)
        self._fresh_done = self._fresh_count = 0
        self._fresh_seeds: set[int] = set()
        self._again = 1.0
        self._trials_an_hour = 0.0
        self._doing = ""
        self._pace = math.nan
        self._generations = 0

    def run(self) -> SearchResult:
        """Run to the end, or until Ctrl-C; the caller unlocks the study.

        Raises:
            FolderInUseError: another process runs this study.
            SearchError: all trials fail.
            SetupError, OutputError: no trial can be scored, or written.
        """
        study = self.study
        study.lock()
        interrupted, ended = False, ""
        for row in study.store.rows():
            if row.outcome is not None:
                self._tally.count(row, row.outcome)
        try:
            with self._running(self._evaluator) as runner:
                expect_stages(
                    self._time_left,
                    self.limit,
                    self._usual,
                    runner.workers,
                    plain_trials=self._plain,
                )
                if self._usual is not None:
                    self._expect_fresh_scores(USUAL_FRESH)
                self._begin(START_STAGE)
                self._score_start(runner)
                self._begin(TRIALS, self._tally.done)
                ended = self._search(runner)
                self._watch_reading(last=True)
                self._report(now=True)
                if not self._coarse:
                    self._begin(FRESH)
                    rescore(study, partial(self._score_fresh, runner))
            if self._coarse:
                with self._running(self._full) as runner:
                    self._begin(FRESH)
                    promote(study, partial(self._score_fresh, runner))
        except KeyboardInterrupt:
            interrupted, ended = True, "interrupted"
        study.store.set_fact("ended", ended)
        study.store.set_fact("stage", None)
        if not interrupted and self._tally.has_no_score:
            raise self._tally.all_failed()
        several = self.method.multi_objective  # the result is a front, not one best trial
        tie = None if several else tie_note(study.trials)
        found_notes = [moved_start_note(study.space), tie, condition_note(study.trials)]
        found_notes += [] if several else [worsened_note(study.best, study.start)]
        notes = [
            *self._notes,
            *self.method.notes(),
            *(note for note in found_notes if note is not None),
        ]
        return SearchResult(study, interrupted, ended, tuple(notes))

    @contextmanager
    def _running(self, evaluator: Evaluator) -> Iterator[Runner]:
        """Yield a runner of an evaluator, which ends with the block."""
        with self._make_runner(evaluator) as runner:
            self._time_left.workers = runner.workers
            if isinstance(runner, SerialRunner):
                runner.report_progress_to(self._trial_progress)
            yield runner

    def _search(self, runner: Runner) -> str:
        """Run all generations, and return the reason why the search has ended."""
        known = self.study.store.last_generation()
        generation = 0
        while True:
            asked = self.method.ask()
            rows = self.study.store.rows(generation) if generation <= known else []
            self._check_proposals(asked, rows)
            room = self.limit - self.study.store.proposed_before(generation)
            missing = asked[len(rows) :][: max(0, room - len(rows))]
            if len(missing):
                self.study.store.propose(generation, missing, len(rows))
                rows = self.study.store.rows(generation)
            if not rows:
                return "the method has finished" if not len(asked) else "the budget is spent"
            self._score_rows(runner, rows)
            whole = self.study.store.rows(generation)
            if len(whole) < len(asked):
                return "the budget is spent"
            outcomes = [row.outcome for row in whole if row.outcome is not None]
            self.method.tell(np.array([row.vector for row in whole]), outcomes)
            generation = self._generations = generation + 1
            self._watch_reading()

    def _watch_reading(self, *, last: bool = False) -> None:
        """Read the best design so far, unless the method looks for a front."""
        if not self.method.multi_objective:
            self._watch.update(last=last)

    def _score_start(self, runner: Runner) -> None:
        store = self.study.store
        rows = store.rows(START)
        if not rows:
            store.propose(START, self.study.space.start[None])
            rows = store.rows(START)
        self._score_rows(runner, rows)

    def _score_rows(self, runner: Runner, rows: Sequence[Row]) -> None:
        """Score the rows that are not finished, and write each as it finishes.

        A point that was scored before keeps its score: a grid holds the start, and choices and
        integers repeat.
        """
        by_number = {row.number: row for row in rows if row.outcome is None}

        def finished(number: int, outcome: Outcome) -> None:
            self.study.store.finish(number, outcome)
            self._tally.count(by_number[number], outcome)
            if self._stage == TRIALS:
                self._time_left.advance(self._tally.done, outcome.seconds, outcome.worker)
            else:
                self._time_left.advance(1.0, outcome.seconds, outcome.worker)
            self._expect_fresh(outcome)
            self._report()

        jobs = []
        for row in by_number.values():
            known = self._tally.scored.get(row.vector.tobytes())
            if known is None:
                jobs.append((row.number, row.vector, self.study.settings.seed))
            else:
                finished(row.number, replace(known, seconds=0.0))
        self._run_jobs(runner, jobs, finished)

    def _score_fresh(
        self, runner: Runner, jobs: Sequence[tuple[Trial, int]], more: int, later: float
    ) -> list[Outcome]:
        """Score trials with other seeds; `more` may follow for these trials, `later` for others."""
        found: dict[int, Outcome] = {}
        self._fresh_count = self._fresh_done + len(jobs) + more
        self._expect_fresh_scores(self._fresh_count + later)
        self._report(now=True)

        def finished(number: int, outcome: Outcome) -> None:
            trial, seed = jobs[number]
            self.study.store.finish_fresh(trial.number, seed, outcome)
            found[number] = outcome
            self._fresh_done += 1
            self._fresh_seeds.add(seed)
            done = self._in_first_scores(self._fresh_done, len(self._fresh_seeds))
            self._time_left.advance(done, outcome.seconds, outcome.worker)
            self._report(now=True)

        numbered = [(k, trial.vector, seed) for k, (trial, seed) in enumerate(jobs)]
        self._run_jobs(runner, numbered, finished)
        return [found[number] for number in range(len(jobs))]

    def _run_jobs(
        self,
        runner: Runner,
        jobs: Sequence[tuple[int, np.ndarray, int]],
        finished: Callable[[int, Outcome], None],
    ) -> None:
        """Keep the workers busy with jobs (number, point, seed), and pass on each outcome."""
        waiting = list(reversed(jobs))
        open_jobs = 0
        while waiting or open_jobs:
            while waiting and open_jobs < runner.window:
                number, vector, seed = waiting.pop()
                future = runner.submit(vector, seed)
                open_jobs += 1
                future.add_done_callback(partial(self._enqueue, number))
            try:
                number, done = self._finished.get(timeout=TICK)
            except queue.Empty:
                self._report()
                continue
            open_jobs -= 1
            finished(number, outcome_of(done))

    def _enqueue(self, number: int, done: Future[Outcome]) -> None:
        """Queue a finished trial; it is called in the thread where the trial finished."""
        self._finished.put((number, done))

    def _check_proposals(self, asked: np.ndarray, rows: Sequence[Row]) -> None:
        """Note if the method proposes other points than it did before."""
        if not rows or self._notes:
            return
        stored = np.array([row.vector for row in rows])
        span = self.study.space.upper - self.study.space.lower
        fewer = len(asked) < len(stored)
        if not fewer and (np.abs(asked[: len(stored)] - stored) <= SAME_POINT * span).all():
            return
        then, now = self.study.settings.versions, package_versions()
        changed = [
            f"{name} {then.get(name)} -> {now[name]}" for name in now if then.get(name) != now[name]
        ]
        why = ", ".join(changed) or "another machine computes differently in the last digit"
        self._notes.append(
            "the method would propose other points than when the study was begun "
            f"({why}): it continues from the stored trials"
        )

    def _begin(self, stage: str, done: float = 0.0) -> None:
        """Begin a stage, of which earlier runs finished `done` pieces."""
        self._stage = stage
        self.study.store.set_fact("stage", stage)  # for those who only read the study
        self._time_left.begin(stage, done=done)
        self._report(now=True)

    def _expect_fresh(self, outcome: Outcome) -> None:
        """Estimate from a score how long one with a fresh seed will take."""
        if self._stage == START_STAGE:
            self._first_seconds = outcome.seconds
        pace = self._time_left.pace
        if math.isfinite(pace) and self._stage == TRIALS:
            self._pace = pace
            self._expect_fresh_scores(USUAL_FRESH)
            if pace > 0.0:
                self._trials_an_hour = 3600.0 / pace

    def _expect_fresh_scores(self, count: float) -> None:
        """Expect `count` scores with fresh seeds, the first one of each seed with its own light.

        Their time is counted in units of first scores; other scores take a part of one.
        """
        if self._usual is not None:
            first, again = self._usual.fresh, self._usual.fresh_again
        else:
            again = self._pace
            first = max(again, FRESH_SHARE * self._first_seconds / self._time_left.workers)
        if self._stage != FRESH:  # what is done is counted in them, too
            self._again = again / first if again < first else 1.0
        whole = self._in_first_scores(count, min(count, FRESH_SEEDS))
        known = first if math.isfinite(first) else None
        self._time_left.expect(FRESH, count=whole, seconds=known)

    def _in_first_scores(self, count: float, seeds: float) -> float:
        """Return how many first scores take as long as `count` scores with `seeds` seeds."""
        return seeds + (count - seeds) * self._again

    def _trial_progress(self, fraction: float, text: str) -> None:
        """Store the progress of the trial that this process is scoring."""
        self._doing = text
        if self._stage == START_STAGE and self._usual is not None:
            self._time_left.advance(self._usual.done(fraction))
        self._report()

    def _report(self, now: bool = False) -> None:
        clock = time.monotonic()
        if not now and clock - self._last_report < TICK / 2:
            return
        self._last_report = clock
        fresh, tally = self._stage == FRESH, self._tally
        self._progress(
            SearchProgress(
                stage=self._stage,
                done=self._fresh_done if fresh else tally.done,
                total=self._fresh_count if fresh else self.limit,
                failed=tally.failed,
                broken=tally.broken,
                nearest=tally.nearest_note(),
                worsened=tally.worsened(),
                generations=self._generations,
                best=tally.best,
                start=tally.start,
                trials_per_hour=self._trials_an_hour,
                seconds_left=self._time_left.seconds_left,
                facts=self.method.describe(),
                doing=self._doing,
            )
        )

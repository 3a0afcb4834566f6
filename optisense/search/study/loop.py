"""The loop of a study: generation by generation, until its budget is spent or the user stops it."""

from __future__ import annotations

import math
import reprlib
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial

import numpy as np

from optisense.array_types import FloatArray
from optisense.errors import SearchError
from optisense.search.evaluation.evaluator import Evaluator
from optisense.search.evaluation.outcome import Outcome
from optisense.search.executors import Runner
from optisense.search.executors.base import TICK, run_jobs
from optisense.search.methods import Method, Problem, make
from optisense.search.study._reading_watch import ReadingWatch
from optisense.search.study._same_scoring import SCORING, refuse_other_definitions
from optisense.search.study._tally import Tally
from optisense.search.study.advice import moved_start_note
from optisense.search.study.best import newer_note, tie_note
from optisense.search.study.conditions import condition_note, worsened_note
from optisense.search.study.failures import incomplete_note
from optisense.search.study.plan import evaluators
from optisense.search.study.progress import (
    FRESH,
    START_STAGE,
    TRIALS,
    SearchProgress,
    SearchProgressCallback,
    SearchResult,
)
from optisense.search.study.rescoring import promote, rescore
from optisense.search.study.settings import package_versions
from optisense.search.study.store import START, Row
from optisense.search.study.study import BUDGET, JUDGED, Study
from optisense.search.study.trial import Trial
from optisense.time_left import TimeLeft

SAME_POINT = 1e-9
"""Largest difference, as a share of the range, between proposals that count as the same point;
releases of libraries differ in rounding.
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
    ) -> None:
        """Set up the run of a study, with a function that returns the executor of its trials, and
        one that is called a few times a second; nothing is scored yet. `limit` is the largest
        number of trials: the largest that was asked for so far if None.
        """
        self.study = study
        settings = study.settings
        self.limit = study.budget if limit is None else limit
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
        self._evaluator, self._full = evaluators(settings, usual, self.method)
        self._make_runner = make_runner
        self._progress = progress or (lambda progress: None)
        self._notes: list[str] = []
        names = settings.names
        self._tally = Tally(names if self.method.multi_objective else names[:1])
        self._watch = ReadingWatch(study, self._tally, usual, front=self.method.multi_objective)
        self._last_report = time.monotonic()
        self._stage = START_STAGE
        self._time_left = TimeLeft(1)
        self._fresh_done = self._fresh_count = 0
        self._trials_an_hour = 0.0
        self._doing = ""
        self._generations = 0

    def run(self) -> SearchResult:
        """Run to the end, or until Ctrl-C; the caller unlocks the study. An error is raised if
        another process runs it, all trials fail, or no trial can be scored or written.
        """
        study = self.study
        study.lock()
        interrupted, ended = False, ""
        for row in study.store.rows():
            if row.outcome is not None:
                self._tally.count(row, row.outcome)
        try:
            with self._running(self._evaluator) as runner:
                self._check_definitions(runner)
                if self.limit > study.budget:
                    study.store.set_fact(BUDGET, self.limit)
                self._begin(START_STAGE, 1)
                self._score_start(runner)
                self._begin(TRIALS, self.limit, self._tally.done)
                ended = self._search(runner)
                self._watch.update(last=True)
                self._report(now=True)
                if not self._coarse:
                    self._begin(FRESH, 0)
                    rescore(study, partial(self._score_fresh, runner))
            if self._coarse:
                with self._running(self._full) as runner:
                    self._begin(FRESH, 0)
                    promote(study, partial(self._score_fresh, runner))
            study.store.set_fact(JUDGED, len(study.trials))
        except KeyboardInterrupt:
            interrupted, ended = True, "interrupted"
        study.store.set_fact("ended", ended)
        study.store.set_fact("stage", None)
        if not interrupted and self._tally.has_no_score:
            raise self._tally.all_failed()
        several = self.method.multi_objective  # the result is a front, not one best trial
        trials = study.trials
        found = [
            moved_start_note(study.space),
            newer_note(trials),
            None if several else tie_note(trials),
            condition_note(trials),
            incomplete_note(study.best),
            None if several else worsened_note(study.best, study.start),
        ]
        notes = [*study.shape_notes, *self._notes, *self.method.notes(), *filter(None, found)]
        return SearchResult(study, interrupted, ended, tuple(notes), self.limit)

    @contextmanager
    def _running(self, evaluator: Evaluator) -> Iterator[Runner]:
        """Yield a runner of an evaluator, which ends with the block."""
        with self._make_runner(evaluator) as runner:
            runner.report_progress_to(self._trial_progress)
            yield runner

    def _search(self, runner: Runner) -> str:
        """Run all generations, and return the reason why the search has ended."""
        known = self.study.store.last_generation()
        generation = 0
        while True:
            asked = self._ask()
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
            self._watch.update()

    def _ask(self) -> FloatArray:
        """Return the next generation (k, n) of the method. Coordinates that miss a bound or a whole
        number by rounding are moved onto it; SearchError if one is no point of the space.
        """
        space, given, name = self.study.space, self.method.ask(), self.study.settings.method
        hint = "The method must be repaired: its ask() must return points (k, n) of its space"
        try:
            asked = np.asarray(given, dtype=np.float64)
            if asked.ndim and not len(asked):
                return np.empty((0, space.size))
            _, size = asked.shape
            if size != space.size:
                raise ValueError
        except (TypeError, ValueError):  # no numbers, or not one point a row
            told = (
                f"an array {given.shape}" if isinstance(given, np.ndarray) else reprlib.repr(given)
            )
            message = f"the method {name} proposes {told} instead of points (k, {space.size})"
            raise SearchError(message, hint=hint) from None
        near = np.clip(np.where(space.discrete, np.round(asked), asked), space.lower, space.upper)
        rounded = (near != asked) & (np.abs(near - asked) <= SAME_POINT * space.span)
        points = np.where(rounded, near, asked)
        for point in points:
            try:
                space.check(point)
            except SearchError as error:
                message = f"the method {name} proposes a point outside the space: {error.message}"
                raise SearchError(message, where=error.where, hint=hint) from None
        return points

    def _check_definitions(self, runner: Runner) -> None:
        """Score the first trial of an earlier release that has a score again; SearchError if it
        scores otherwise.
        """
        settings = self.study.settings
        first = next((trial for trial in self.study.trials if math.isfinite(trial.score)), None)
        if settings.scoring == SCORING or first is None:
            return
        then = first.outcome
        job = (first.number, first.vector, settings.seed)
        run_jobs(runner, [job], lambda _, now: refuse_other_definitions(then, now), self._report)

    def _score_start(self, runner: Runner) -> None:
        store = self.study.store
        rows = store.rows(START)
        if not rows:
            store.propose(START, self.study.space.start[None])
            rows = store.rows(START)
        self._score_rows(runner, rows)

    def _score_rows(self, runner: Runner, rows: Sequence[Row]) -> None:
        """Score the rows that are not finished, and write each as it finishes. A point that was
        scored before keeps its score: a grid holds the start, and choices and integers repeat.
        """
        by_number = {row.number: row for row in rows if row.outcome is None}

        def finished(number: int, outcome: Outcome) -> None:
            self.study.store.finish(number, outcome)
            self._tally.count(by_number[number], outcome)
            if self._stage == TRIALS:
                self._time_left.advance(self._tally.done)
                pace = self._time_left.pace
                self._trials_an_hour = 3600.0 / pace if pace > 0.0 else self._trials_an_hour
            self._report()

        jobs = []
        for row in by_number.values():
            known = self._tally.scored.get(row.vector.tobytes())
            if known is None:
                jobs.append((row.number, row.vector, self.study.settings.seed))
            else:
                finished(row.number, replace(known, seconds=0.0))
        run_jobs(runner, jobs, finished, self._report)

    def _score_fresh(
        self, runner: Runner, jobs: Sequence[tuple[Trial, int]], more: int
    ) -> list[Outcome]:
        """Score trials with other seeds; `more` scores of these trials may follow."""
        found: dict[int, Outcome] = {}
        self._time_left.count = self._fresh_count = self._fresh_done + len(jobs) + more
        self._report(now=True)

        def finished(number: int, outcome: Outcome) -> None:
            trial, seed = jobs[number]
            self.study.store.finish_fresh(trial.number, seed, outcome)
            found[number] = outcome
            self._fresh_done += 1
            self._time_left.advance(self._fresh_done)
            self._report(now=True)

        numbered = [(k, trial.vector, seed) for k, (trial, seed) in enumerate(jobs)]
        run_jobs(runner, numbered, finished, self._report)
        return [found[number] for number in range(len(jobs))]

    def _check_proposals(self, asked: np.ndarray, rows: Sequence[Row]) -> None:
        """Note if the method proposes other points than it did before."""
        if not rows or self._notes:
            return
        stored = np.array([row.vector for row in rows])
        allowed = SAME_POINT * self.study.space.span
        if len(asked) >= len(stored) and ((np.abs(asked[: len(stored)] - stored) <= allowed).all()):
            return
        then, now = self.study.settings.versions, package_versions()
        changed = [
            f"{name} {then.get(name)} -> {now[name]}" for name in now if then.get(name) != now[name]
        ]
        why = ", ".join(changed) or "the versions of all packages are the same"
        self._notes.append(
            "the method would propose other points than when the study was begun "
            f"({why}): it continues from the stored trials"
        )

    def _begin(self, stage: str, count: int, done: int = 0) -> None:
        """Begin a stage of `count` scores, of which earlier runs finished `done`."""
        self._stage = stage
        self.study.store.set_fact("stage", stage)  # for those who only read the study
        self._time_left = TimeLeft(count, done)
        self._report(now=True)

    def _trial_progress(self, fraction: float, text: str) -> None:
        """Store the progress of the trial that this process is scoring."""
        self._doing = text
        if self._stage == START_STAGE:
            self._time_left.advance(fraction)
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
                doing=self._doing,
            )
        )

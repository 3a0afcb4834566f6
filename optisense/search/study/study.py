"""A study: one search with all its data, in a folder or in memory.

```text
STUDY/
  study.json       what is searched, how, and with which seed
  design/          the design that the search starts from
  trials.sqlite    every trial, written as it finishes
```
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from optisense.design import SensorDesign
from optisense.design.difference import differences, fingerprint, notes, plain_differences
from optisense.design.problems import listed
from optisense.errors import ObjectiveError, SearchError
from optisense.folders import FolderLock
from optisense.library import with_own_lights
from optisense.search.evaluation.evaluator import DesignEvaluator, Goal
from optisense.search.space.constraints import Constraint
from optisense.search.space.search_space import BoundSpace, SearchSpace
from optisense.search.study._same_scoring import refuse_other_packages
from optisense.search.study.best import best_of, front_among, nearest, start_of
from optisense.search.study.folder import (
    STORE_FILE,
    lock_new_folder,
    save_and_reload,
    unedited_design,
)
from optisense.search.study.plan import Plan, known_goals, known_rules
from optisense.search.study.settings import ONLY_HERE, StudySettings
from optisense.search.study.store import Row, Store
from optisense.search.study.trial import Trial
from optisense.search.study.trust import file_prints, not_trusted, trust

BUDGET = "budget"
"""Name of the fact that holds the budget of a study that was resumed with a larger one."""

JUDGED = "judged"
"""Name of the fact that holds how many trials there were when the best were last scored with fresh
seeds.
"""


class Study:
    """Search with stored trials.

    Create one with `create` or `open`, and run it with `optisense.search.run_study`.

    Attributes:
        folder: folder of the study; None in memory.
        settings: settings of the study.
        space: space that is searched, bound to the design.
        goals: goals of the search; empty if only the program that began the study knows them.
    """

    def __init__(
        self,
        folder: Path | None,
        settings: StudySettings,
        space: BoundSpace,
        goals: Sequence[Goal],
        store: Store,
        lock: FolderLock | None = None,
    ) -> None:
        """Store the arguments; use `create` or `open` instead."""
        self.folder = folder
        self.settings = settings
        self.goals = list(goals)
        self.space = space
        self.store = store
        self._lock = lock
        self._trusted = folder is None

    @property
    def shape_notes(self) -> list[str]:
        """Notes on images and rays of another shape than the camera's; see `Camera`."""
        sizes = (self.settings.settings.get(name) for name in ("resolution", "ray_resolution"))
        return self.space.design.camera.shape_notes(*(each and tuple(each) for each in sizes))

    @staticmethod
    def create(folder: str | Path | None, design: SensorDesign, plan: Plan) -> Study:
        """Create a study; nothing is scored yet. It holds the lock of its folder until it is
        closed.

        Args:
            folder: folder to create; None keeps the study in memory.
            design: design that the search starts from.
            plan: what to search and how.

        Raises:
            SearchError: the plan is invalid, or there is a study in the folder already.
            DesignError: a path names nothing in the design.
            ObjectiveError: an objective or a setting is unknown.
            FolderInUseError: another process is writing to the folder.
            OutputError: the folder is not empty, or can't be written.
        """
        place = None if folder is None else Path(folder)
        design = with_own_lights(design)
        rules = plan.space.constraints
        if place is None:
            settings = plan.settings_for(design)
            in_memory = Store.create(None, settings.names)
            space = SearchSpace.from_plain(settings.space, rules).bind(design, tried=False)
            return Study(None, settings, space, plan.goals, in_memory)
        lock = lock_new_folder(place, design)
        store: Store | None = None
        try:
            settings = plan.settings_for(design)
            design = save_and_reload(place, design)
            settings = replace(settings, fingerprint=fingerprint(design))
            store = Store.create(place / STORE_FILE, settings.names)
            store.set_fact("settings", settings.fingerprint_of_all())
            store.set_fact("study", settings.comparable())
            store.set_fact("design", notes(design))
            space = SearchSpace.from_plain(settings.space, rules).bind(design, tried=False)
            study = Study(place, settings, space, plan.goals, store, lock)
            settings.save(place)  # last: from here on it is a study
            study.trust()
        except BaseException:
            if store is not None:
                store.close()
            lock.undo()
            lock.release()
            raise
        lock.is_whole()
        return study

    @staticmethod
    def open(
        folder: str | Path,
        design: SensorDesign | None = None,
        goals: Sequence[Goal] | None = None,
        rules: Sequence[Constraint] | None = None,
    ) -> Study:
        """Open a study to read or resume it; nothing in its folder is written.

        Args:
            folder: folder of the study.
            design: expected design; an error is raised if it is not the study's.
            goals, rules: goals and rules that are functions of the program and in no file.

        Raises:
            SearchError: there is no study, it was edited, it is of a newer version, or the design
                differs; the message says where.
        """
        place = Path(folder)
        settings = StudySettings.load(place)
        if not (place / STORE_FILE).is_file():
            raise SearchError(f"the study has no {STORE_FILE}", where=str(place))
        store = Store.open(place / STORE_FILE, settings.names)
        try:
            own = unedited_design(place, settings, store)
            if design is not None:
                changed = differences(own, with_own_lights(design))
                if changed:
                    raise SearchError(
                        f"the design is not the one of this study any more:\n{listed(changed)}",
                        where=str(place),
                        hint="Undo the changes, or begin a new study in another folder",
                    )
        except BaseException:
            store.close()
            raise
        known = known_goals(settings, goals)
        space = SearchSpace.from_plain(settings.space, known_rules(settings, rules)).bind(own)
        study = Study(place, settings, space, known, store)
        store.check_points(study.space.size)
        return study

    def expect(self, wanted: Mapping[str, Any]) -> None:
        """Refuse to resume the study with other settings than those that it was begun with; the
        error lists those fields of `StudySettings` that differ.
        """
        here = json.loads(self.settings.to_text())
        changed = plain_differences({key: here[key] for key in wanted}, wanted)
        if changed:
            raise SearchError(
                f"the study was begun with other settings:\n{listed(changed)}",
                where=str(self.folder or "the study"),
                hint="Continue it with its own settings, or begin a new study in another folder",
            )

    @property
    def references(self) -> list[str]:
        """References to its objectives and rules, as stored."""
        return [*self.settings.objectives, *self.settings.rules]

    def trust(self) -> None:
        """Allow its Python files to run, now and later, once the user has named or confirmed them.

        See `optisense.search.study.trust`.
        """
        self._trusted = True
        trust(self.references)

    def evaluator(self, variant: str = "auto") -> DesignEvaluator:
        """Return the evaluator of its points, on a variant of the renderer.

        Raises:
            SearchError: a goal or rule is known only to the program that began the study, is in a
                Python file that the user has not named, or it, the method or a kind was changed.
        """
        known = self.references
        unknown = [each.removeprefix(ONLY_HERE) for each in known if each.startswith(ONLY_HERE)]
        lacks_goals = len(self.goals) < len(self.settings.names)
        lacks_rules = len(self.space.space.constraints) < len(self.settings.rules)
        if lacks_goals or lacks_rules:
            raise SearchError(
                f"only the program that began this study knows {', '.join(unknown)}",
                hint="Continue it from that program",
            )
        now = file_prints(known)
        for path, print_before in self.settings.files.items():
            if now.get(path) != print_before:
                raise SearchError(
                    "the file is missing or was edited since the study's trials were scored",
                    where=path,
                    hint="Undo the change, or begin a new study",
                )
        strange = [] if self._trusted else not_trusted(known)
        if strange:
            raise SearchError(
                f"the study runs Python code that you did not name: {', '.join(strange)}",
                where=str(self.folder),
                hint="Read it; if you trust it, continue with optisense search --resume --trust",
            )
        refuse_other_packages(self.settings, self.space)
        settings = self.settings
        return DesignEvaluator(
            self.space,
            self.goals,
            settings.settings,
            requirements=settings.requirements,
            apart=settings.apart,
            variant=variant,
        )

    @property
    def objective(self) -> str:
        """First goal, which methods for one goal maximise."""
        return self.settings.names[0]

    @property
    def trials(self) -> list[Trial]:
        """Finished trials in the order in which they were proposed, the start first."""
        fresh, judged = self.store.fresh_scores(), self._judged
        return [
            replace(self.trial_of(row, fresh.get(row.number)), is_newer=row.number >= judged)
            for row in self.store.rows()
            if row.outcome is not None
        ]

    @property
    def start(self) -> Trial | None:
        """Trial of the starting design, or of the nearest point in the space; None if unscored."""
        return start_of(self.trials)

    @property
    def best(self) -> Trial | None:
        """Best trial by the first objective; see `optisense.search.study.best` for the rule."""
        return best_of(self.trials)

    @property
    def front(self) -> list[Trial]:
        """Pareto front: the trials that no other one dominates, sorted by the first objective."""
        return front_among(self.trials, self.settings.names)

    def trial(self, which: int | str) -> Trial:
        """Return a trial by its number, or "best" or "start".

        Raises:
            SearchError: there is no such trial.
        """
        trials = self.trials
        if which == "best":
            found = best_of(trials)
        elif which == "start":
            found = start_of(trials)
        else:
            try:
                number = int(which)
            except ValueError:
                hint = "Write best, start, or its number"
                raise SearchError(f"'{which}' is not a trial", hint=hint) from None
            found = next((trial for trial in trials if trial.number == number), None)
        if found is None:
            last = max((trial.number for trial in trials), default=-1)
            hint = f"The study has trials 0 to {last}" if trials else "No trial is finished yet"
            if which == "best" and trials:
                hint = "All trials failed"
                close = nearest(trials)
                if close is not None:
                    hint = f"No trial meets all conditions; trial {close.number} comes nearest"
            raise SearchError(f"the study has no trial '{which}'", hint=hint)
        return found

    def trial_of(self, row: Row, fresh: Mapping[int, Any] | None = None) -> Trial:
        """Return a finished row of the store as a trial."""
        assert row.outcome is not None
        return Trial(
            number=row.number,
            generation=row.generation,
            vector=row.vector,
            outcome=row.outcome,
            space=self.space,
            objective=self.objective,
            fresh=fresh or {},
        )

    @property
    def budget(self) -> int:
        """Largest number of trials that was asked for: when the study was begun, or resumed."""
        found = self.store.fact(BUDGET)
        return max(self.settings.budget, found if isinstance(found, int) else 0)

    @property
    def _judged(self) -> float:
        """Number of trials that were considered when the best were last scored with fresh seeds: 0
        if they never were, and infinity in a study that ended in a release that did not store it.
        """
        found = self.store.fact(JUDGED)
        if isinstance(found, int):
            return found
        return 0 if self.store.fact("ended") in (None, "interrupted") else math.inf

    def lock(self) -> None:
        """Take the lock against other processes that write, and open the store for writing.

        Raises:
            FolderInUseError: another process is writing to the folder.
            OutputError: the folder can't be written.
        """
        if self.folder is None:
            return
        if self._lock is None:
            self._lock = FolderLock(self.folder)
        self.store.open_writer()

    @property
    def is_new(self) -> bool:
        """True if it was created in this process, and not unlocked since."""
        return self._lock is not None and self._lock.has_made

    def unlock(self) -> None:
        """Release the lock; the study can still be read."""
        if self._lock is not None:
            self.store.close()
            self._lock.release()
            self._lock = None

    def discard(self) -> None:
        """Close a study without scores, and remove the files that were made for it.

        A study that was opened and not created here is only closed: its files belong to another
        process.
        """
        self.store.close()
        if self._lock is not None:
            self._lock.undo()
        self.unlock()

    def close(self) -> None:
        """Close its files; a study in memory is lost."""
        self.store.close()
        self.unlock()


def beside(study: Study, trial: Trial) -> dict[str, float]:
    """Return the numbers that are shown beside a trial's score: its other scores, and the parts
    that an objective lists to be shown, such as the coverage with AOAP.

    Where a trial with a coarse score also has full ones, its other scores are the means of these,
    and parts that were computed from coarse images are left out.
    """
    found: dict[str, float] = {}
    is_promoted = study.settings.coarse_first and bool(trial.fresh)
    for number, name in enumerate(study.settings.names):
        if number:
            found[name] = trial.fresh_score(name) if is_promoted else trial.scores[name]
        parts = trial.parts.get(name, {})
        shown = _shown(name, rays_only=is_promoted)
        found |= {part: float(parts[part]) for part in shown if part in parts}
    return found


def _shown(name: str, *, rays_only: bool) -> tuple[str, ...]:
    """Return the parts that an objective lists to be shown with its value, or with `rays_only` none
    if it needs images; none for a user's objective, whose file is not run to look at a study.
    """
    from optisense.objectives.combined import objective_of
    from optisense.objectives.named import is_plain
    from optisense.objectives.registry import OBJECTIVES

    try:
        known = name in OBJECTIVES.built_in or not is_plain(name)
        measured = objective_of(name) if known else None
        return measured.beside if measured and (measured.rays_only or not rays_only) else ()
    except ObjectiveError:  # an expression with an objective that is not installed
        return ()

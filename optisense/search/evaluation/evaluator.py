"""Scoring one point of a search space: a pure function of the design, the point and a seed."""

from __future__ import annotations

import math
import os
import re
import time
from collections.abc import Callable, Collection, Mapping, Sequence
from functools import cached_property, partial
from typing import Any, ClassVar, Protocol

from optisense.array_types import FloatArray
from optisense.design import Role, SensorDesign
from optisense.design.cage_checks import contact_problems, fold_problems
from optisense.errors import (
    ObjectiveError,
    OptiSenseError,
    SearchError,
    SetupError,
    UnknownPartError,
)
from optisense.json_values import json_ready
from optisense.objectives import Objective, Score, Settings, evaluate
from optisense.objectives.combined import goal_of
from optisense.objectives.evaluation import ProgressCallback
from optisense.objectives.named import named_in
from optisense.objectives.registry import CONDITIONS, WATCHED, find
from optisense.objectives.run import split_settings
from optisense.objectives.scoring import score_of
from optisense.own_code import place_of
from optisense.search.evaluation.models import ModelCache, SameMirrors, least_skin, may_change_view
from optisense.search.evaluation.outcome import Outcome
from optisense.search.evaluation.requirements import requirements_of
from optisense.search.space.buildable import (
    LightsOnSupports,
    LightsOutsideParts,
    PartsInContact,
    SizeLimit,
    SolidsStaySolid,
)
from optisense.search.space.constraints import Constraint, NoCrossings, NoNewProblems, why_forbidden
from optisense.search.space.pickling import PickledWithoutCaches
from optisense.search.space.rigid_moves import PartShift, PartTurn
from optisense.search.space.search_space import BoundSpace
from optisense.text import brief

DesignFunction = Callable[[SensorDesign], float]
"""A goal that needs no image, such as a length or a price; higher is better."""

Goal = str | Objective | DesignFunction
"""A goal of a search."""


def as_goals(objective: Goal | Sequence[Goal]) -> list[Goal]:
    """Return one objective or several as a list.

    Raises:
        ObjectiveError: one is neither a name, an `Objective` nor a function.
    """
    goals: list[Any] = list(objective) if isinstance(objective, list | tuple) else [objective]
    for each in goals:
        if not (isinstance(each, str | Objective) or callable(each)):
            raise ObjectiveError(
                f"{brief(repr(each))} is no objective",
                hint="Give the name of one, or a function of the design",
            )
    return goals


RELIGHTS = re.compile(r"^lights\..*\.(flux|colour)(\W|$)")
"""Pattern of the names of parameters that only rescale the light of a group, so that no ray has to
be traced anew.
"""


MOVES_LIGHTS = re.compile(r"^lights\..*\b(shift|turn|position)\b")
"""Pattern of the names of parameters that move lights: their shift, turn and position."""

WATCHED_OBJECTIVES = ("coverage", "distortion")
"""Objectives by chief rays that are scored with every trial where the view may change, so that a
report can say that a design sees less of the skin, or sees it distorted. They take a tenth of the
time of AOAP."""

READING = "reading"
"""Objective that is scored with every trial whose goals or conditions need the same presses, so
that a report can say that a design is read worse. It takes about a tenth of the time of such a
trial."""

SAME_PRESSES = {"rgb2normal", "normdiff", "depth"}
"""Objectives that need the presses of `READING`."""


class Evaluator(Protocol):
    """Interface of the function that workers call; it pickles, and scores many points."""

    def __call__(self, vector: FloatArray, seed: int) -> Outcome:
        """Score the point `vector`, (n,), of the space.

        The outcome depends on the point and the seed only, not on the points scored before. A
        design that can't be scored gives an outcome with a failure; an error is raised only if no
        point can be scored.
        """


class DesignEvaluator(PickledWithoutCaches):
    """Scores points by objectives: the evaluator of all methods that bring none of their own.

    Attributes:
        space: space that is searched, bound to its design.
        goals: objectives by name, `Objective`s, or functions of the design.
        settings: settings of the objectives (see `optisense.evaluate`).
        requirements: conditions whose quantities are measured beside the goals.
        constraints: constraints on designs; a design that breaks one is not scored.
        kept: constraints on points of the space that preserve properties of the starting design;
            manufacturing errors may break them.
        renders: whether any goal needs the renderer.
        apart: the argument of this name.
        variant: variant of the renderer.
        coarse: whether images are coarse.
    """

    coarse: ClassVar[bool] = False

    def __init__(
        self,
        space: BoundSpace,
        goals: Sequence[Goal],
        settings: Mapping[str, Any] | None = None,
        *,
        requirements: Sequence[str] = (),
        apart: bool = True,
        keeps: bool = True,
        variant: str = "auto",
    ) -> None:
        """Check the goals.

        Args:
            apart: whether designs are forbidden whose parts cut through one another or leave the
                parts that they rest on.
            keeps: whether points must keep the properties of the starting design in `kept`; False
                for a space of manufacturing errors.

        Raises:
            SearchError: there is no goal, two goals have one name, or a condition can't be read.
            ObjectiveError: an objective or a setting is unknown.
        """
        self.space = space
        self.goals = [placed(goal) for goal in goals]
        self.settings = dict(settings or {})
        self.names = [goal_name(goal) for goal in self.goals]
        if not self.goals:
            raise SearchError("the search has no objective", hint="Name one or more")
        if len(set(self.names)) < len(self.names):
            raise SearchError(f"an objective is named twice: {', '.join(self.names)}")
        self.requirements = requirements_of(requirements)
        self._functions: dict[str, DesignFunction] = {}
        self._objectives: list[str | Objective] = []
        for name, goal in zip(self.names, self.goals, strict=True):
            if isinstance(goal, str | Objective):
                self._objectives.append(goal)
            else:
                self._functions[name] = goal
        self.constraints: list[Constraint] = list(space.space.constraints)
        if space.reshapes and apart:
            self.constraints.append(NoCrossings(space.design))
        if any(name.startswith("cages.") for name in space.names):
            self.constraints.append(NoNewProblems(space.design, fold_problems))
        self.apart = apart
        self.models = ModelCache(variant, coarse=self.coarse)
        self.renders = bool(self._objectives or self.requirements)
        self.kept: list[Constraint] = []
        if keeps:
            self._add_preserving(apart)
        self._asks_view = keeps and self.renders and may_change_view(space.names)
        self._watched = self._names_to_watch() if keeps and self.renders else ()
        self.variant = variant
        self._check_settings()

    def __call__(self, vector: FloatArray, seed: int) -> Outcome:
        """See `Evaluator`."""
        began = time.perf_counter()
        try:
            design = self.space.apply(vector)
        except OptiSenseError as error:
            return self.failed(str(error), began)
        return self.evaluate(design, seed, self.kept)

    def evaluate(
        self, design: SensorDesign, seed: int, further: Sequence[Constraint] = ()
    ) -> Outcome:
        """Score any design, of a point of the space or with manufacturing errors, under constraints
        beside those of `constraints`; SetupError or UnknownPartError if no design can be scored.
        """
        began = time.perf_counter()
        try:
            reason = why_forbidden(design, [*self.constraints, *further])
            if reason is not None:
                return self.failed(reason, began)
            scores, parts, failures = self._score(design, seed)
        except (SetupError, UnknownPartError):
            raise
        except OptiSenseError as error:
            return self.failed(str(error), began)
        except Exception as error:
            return self.failed(f"{type(error).__name__}: {error} ({place_of(error)})", began)
        failure = "; ".join(failures) or None
        return Outcome(scores, failure, parts, time.perf_counter() - began)

    def report_progress_to(self, callback: ProgressCallback) -> None:
        """Call `callback` while images are rendered in this process; pickled copies do not."""
        self._progress = callback

    @property
    def used_settings(self) -> Mapping[str, Any]:
        """The settings with which designs are scored."""
        return self.settings

    def failed(self, reason: str, began: float) -> Outcome:
        """Return an outcome without scores; `began` is the start time by `time.perf_counter`."""
        return Outcome.of_failure(self.names, reason, time.perf_counter() - began)

    def objective_scores(
        self, design: SensorDesign, seed: int, only: Collection[str] | None = None
    ) -> Mapping[str, Score]:
        """Return the scores by the objectives, or by those that are named in `only`, without plain
        functions. Subclasses may override it with a faster way.
        """
        settings = dict(self.used_settings)
        if self._asks_view and "least_skin" not in settings:
            settings["least_skin"] = self._least_skin
        model = self.models.model(design)
        wanted = self._all_objectives
        if only is not None:
            wanted = [each for each in wanted if each.name in only]
            shared, own = split_settings(settings, self._all_objectives)
            settings = {**shared, **{k: v for each in wanted for k, v in own[each.name].items()}}
        return evaluate(model, wanted, progress=self._progress, seed=seed, **settings)

    def _score(
        self, design: SensorDesign, seed: int
    ) -> tuple[dict[str, float], dict[str, Mapping[str, Any]], list[str]]:
        scores = dict.fromkeys(self.names, math.nan)
        parts: dict[str, Mapping[str, Any]] = {}
        asked: list[Score] = []
        for name, function in self._functions.items():
            score = score_of(Objective(name, function, name), partial(function, design))
            scores[name] = score.value
            asked.append(score)
        if self.renders:
            found = self.objective_scores(design, seed)
            needed = {each.name for each in self._goal_objectives}
            for name, score in found.items():
                if name in scores:
                    scores[name], parts[name] = score.value, score.to_dict()["parts"]
            asked += [found[name] for name in found if name in needed]
            watched = {each: found[each].value for each in self._watched}
            watched = {each: value for each, value in watched.items() if math.isfinite(value)}
            if watched:
                parts[WATCHED] = watched
            if self.requirements:
                parts[CONDITIONS] = {
                    str(each): json_ready(found[each.objective().name].value)
                    for each in self.requirements
                }
        return scores, parts, _failures(asked)

    def _add_preserving(self, apart: bool) -> None:
        """Add the constraints that keep properties of the start which the space may change."""
        design, names = self.space.design, self.space.names
        variables = [parameter.variable for parameter in self.space.parameters]
        moved = {each.name for each in variables if isinstance(each, PartShift | PartTurn)}
        if apart and moved:
            self.kept += [PartsInContact(design, moved), LightsOnSupports(design, moved)]
        bends = any(name.startswith("cages.") for name in names)
        if apart and bends:
            self.kept.append(NoNewProblems(design, contact_problems))
        if apart and (moved or bends):
            self.kept.append(SizeLimit(design))
        if apart and (moved or bends or any(MOVES_LIGHTS.search(name) for name in names)):
            self.kept.append(LightsOutsideParts(design))
        if any(name.startswith("materials.") for name in names):
            self.kept.append(SolidsStaySolid(design))
        if self.renders and may_change_view(names) and design.parts_of(Role.MIRROR):
            self.kept.append(SameMirrors(design, self.models))

    def _names_to_watch(self) -> tuple[str, ...]:
        """Return the objectives that are scored beside goals and conditions, to tell what a score
        costs.
        """
        watched = WATCHED_OBJECTIVES if may_change_view(self.space.names) else ()
        texts = [each for each in self._objectives if isinstance(each, str)]
        quantities = [each.quantity for each in self.requirements]
        wanted = {name.strip().lower() for name in named_in([*texts, *quantities])}
        shared = wanted & SAME_PRESSES and READING not in wanted
        return (*watched, READING) if shared else watched

    @cached_property
    def _all_objectives(self) -> list[Objective]:
        """Objectives of goals and conditions, and those that are watched, each once."""
        watched = [find(name) for name in self._watched]
        return list({each.name: each for each in [*self._goal_objectives, *watched]}.values())

    @cached_property
    def _goal_objectives(self) -> list[Objective]:
        """Objectives of goals and conditions."""
        goals = [goal_of(each) for each in self._objectives]
        return [*goals, *(each.objective() for each in self.requirements)]

    @cached_property
    def _least_skin(self) -> float:
        """Share of the sensing surface that trials must see."""
        return least_skin(self.space.design, self.models)

    @cached_property
    def _progress(self) -> ProgressCallback | None:
        """Function that is called with the progress of a score in this process."""
        return None

    def _check_settings(self) -> None:
        if not self.renders:
            if self.settings:
                raise SearchError(
                    "settings are given, but functions of the design, the objectives, take none"
                )
            return
        if "seed" in self.settings:
            raise SearchError(
                "the seed is an argument of the study and not a setting",
                hint="Give it beside the settings",
            )
        shared, _ = split_settings(self.settings, self._all_objectives)
        Settings(**shared)


def _failures(scores: Sequence[Score]) -> list[str]:
    """Return the reasons why scores are missing, each once, with the objectives concerned."""
    reasons: dict[str, list[str]] = {}
    for score in scores:
        if score.failure is not None:
            reasons.setdefault(score.failure, []).append(score.objective)
    if len(reasons) == 1 and all(score.failure is not None for score in scores):
        return list(reasons)
    return [f"{', '.join(names)}: {reason}" for reason, names in reasons.items()]


def goal_name(goal: Goal) -> str:
    """Return the name under which the scores of a goal are stored;
    ObjectiveError if it is unknown.
    """
    if isinstance(goal, str | Objective):
        return goal_of(goal).name
    return getattr(goal, "__name__", type(goal).__name__)


def placed(goal: Goal) -> Goal:
    """Return a goal with the absolute path of a user's file, which workers can find."""
    if not isinstance(goal, str):
        return goal
    file, colon, function = goal.rpartition(":")
    if colon and file.endswith(".py"):
        return f"{os.path.realpath(file)}:{function}"
    return os.path.realpath(goal) if goal.endswith(".py") else goal

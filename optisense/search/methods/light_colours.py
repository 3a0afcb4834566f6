"""Search over colours and powers of light groups, each scored from the same images.

Light adds up: with a layer for each light group, an image under any colours and powers is a
weighted sum, with no new rendering. So all 6,561 ways to make eight groups red, green or blue are
scored in the time of a few hundred renderings, each exactly as by a rendering of its own.
"""

from __future__ import annotations

import math
import re
from collections import OrderedDict
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

from optisense.design import SensorDesign
from optisense.errors import SearchError
from optisense.objectives import Evaluation, Objective, Score, Settings
from optisense.objectives.evaluation import ProgressCallback
from optisense.objectives.registry import pixels_read
from optisense.objectives.relighting import Relighting
from optisense.objectives.run import split_settings
from optisense.objectives.scoring import run_objective
from optisense.objectives.usual_score import UsualTrials
from optisense.search.evaluation.evaluator import DesignEvaluator, Evaluator
from optisense.search.methods.base import Problem
from optisense.search.methods.combinations import Combinations, Stage, levels_of
from optisense.search.space.search_space import BoundSpace

if TYPE_CHECKING:
    from optisense.optics import OpticalModel

MOST_USUAL = 20_000
"""Largest number of colourings that are tried where no budget is given."""

KEPT_SEEDS = 3
"""Number of seeds whose images are kept: the three fresh seeds of the final scoring, which starts
when the study's own seed is no longer needed.
"""


class LightColours(Combinations):
    """Search over all colourings if the budget allows it, else over one group after another.

    It works for spaces of colours and powers only: `lights.GROUP.colour=R,G,B` and
    `lights.GROUP.flux=LOW:HIGH:STEPS`, of any groups.
    """

    name = "light-colours"
    summary = "colours and powers of light groups, thousands from one rendering"
    renders_once = True

    def __init__(self, problem: Problem) -> None:
        super().__init__(problem, _levels(problem.space))

    @classmethod
    def usual_budget(cls, space: BoundSpace) -> int:
        """Return the number of all colourings, up to a limit."""
        return min(math.prod(len(levels) for levels in _levels(space)), MOST_USUAL)

    def plan(self) -> Iterator[Stage]:
        """See `Combinations.plan`."""
        if self.size <= self.problem.budget:
            yield from self.everything("all colourings")
            return
        singles = [[number] for number in range(self.space.size)]
        yield from self.climb("one group after another", singles)
        yield from self.climb_again("one group after another", singles)

    def evaluator(self, usual: DesignEvaluator) -> Evaluator:
        """Return an evaluator that renders once per seed."""
        return RelitEvaluator(usual)


RELIGHTING_SHARE = 0.02
"""Time to relight and judge the images of a score, as a share of the time to render and judge them;
measured on GelSight Mini, for nine presses of which only the contacts are read.
"""


class RelitEvaluator(DesignEvaluator):
    """Evaluator of designs that differ only in the colours and powers of their lights."""

    def __init__(self, usual: DesignEvaluator) -> None:
        """Copy the settings of the usual evaluator; nothing is rendered yet."""
        super().__init__(
            usual.space,
            usual.goals,
            usual.settings,
            requirements=[str(each) for each in usual.requirements],
            variant=usual.variant,
        )

    def _names_to_watch(self) -> tuple[str, ...]:
        """Return no names: a further score would take longer than all others of a trial."""
        return ()

    def objective_scores(
        self, design: SensorDesign, seed: int, only: Collection[str] | None = None
    ) -> Mapping[str, Score]:
        """See `DesignEvaluator.objective_scores`."""
        if seed not in self._lit:
            while len(self._lit) >= KEPT_SEEDS:
                self._lit.popitem(last=False)
            model = self.keeper.model(self.space.prepared)
            self._lit[seed] = _Lit(model, self._ready, self.settings, seed, self._progress)
        self._lit.move_to_end(seed)
        return self._lit[seed].scores(design, only)

    def usual_trials(self) -> UsualTrials | None:
        """Return the usual duration of the trials (see `DesignEvaluator.usual_trials`); a trial
        renders nothing, and all designs share the light of a fresh seed.
        """
        usual = self.usual_score()
        if usual is None:
            return None
        trial = RELIGHTING_SHARE * (usual.images + usual.judging)
        return UsualTrials.of(usual, trial, trial)

    @cached_property
    def _lit(self) -> OrderedDict[int, _Lit]:
        """Images and objectives of the last seeds, by the seed."""
        return OrderedDict()


class _Lit:
    """Images of one seed, and the objectives prepared for them."""

    def __init__(
        self,
        model: OpticalModel,
        objectives: Sequence[Objective],
        settings: Mapping[str, Any],
        seed: int,
        progress: ProgressCallback | None,
    ) -> None:
        shared, self._own = split_settings(settings, objectives)
        reads = pixels_read(objectives, self._own)
        given = Settings(**shared, seed=seed)
        self._relighting = Relighting(Evaluation(model, given, progress, reads))
        model.forget_light()  # the layers hold all that is needed
        self._objectives = objectives

    def scores(self, design: SensorDesign, only: Collection[str] | None = None) -> dict[str, Score]:
        """Return the scores by all objectives, or by those named in `only`."""
        cut, whole = (self._relighting.lit(design, whole=each) for each in (False, True))
        found = {}
        for each in self._objectives:
            if only is not None and each.name not in only:
                continue
            if _reads_contacts_only(each):
                score = run_objective(each, cut, self._own[each.name])
                found[each.name] = _without_details(score)
            else:
                found[each.name] = run_objective(each, whole, self._own[each.name])
        return found


def _reads_contacts_only(objective: Objective) -> bool:
    """Return whether an objective reads no pixel outside of the contacts, which is known of
    built-in objectives only.

    A user's objective may read pixels around a contact.
    """
    own = objective.function.__module__.startswith("optisense.objectives.")
    return own and objective.reads is not None


def _without_details(score: Score) -> Score:
    """Return a score with its main numbers only, because thousands of scores are stored."""
    if score.failure is not None:
        return score
    parts: dict[str, Any] = {name: score.parts[name] for name in score.shown}
    places = [place.get("score", place.get("error")) for place in score.parts.get("places", ())]
    if places:
        parts["places"] = places
    return replace(score, parts=parts, arrays={})


def _levels(space: BoundSpace) -> list[tuple[float, ...]]:
    """Return the levels of each parameter.

    Raises:
        SearchError: a parameter is no colour or power of a light group, or has no levels.
    """
    for parameter in space.parameters:
        paths = [target.path for target in parameter.targets]
        if not paths or not all(
            re.fullmatch(r"lights\.[^.\[\]]+\.(flux|colour(\.[rgb])?)", path) for path in paths
        ):
            raise SearchError(
                "this method searches colours and powers of light groups and nothing else",
                where=parameter.name,
                hint="Write --vary 'lights.*.colour=R,G,B' or lights.GROUP.flux=1:5:3",
            )
    return levels_of(space)

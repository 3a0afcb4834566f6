"""Scores of designs that differ only in the colours and powers of their lights.

Light is additive: with a layer for each light group, the images under any colours and powers are
weighted sums, with no new rendering.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

from optisense.design import SensorDesign
from optisense.objectives import Evaluation, Objective, Score, Settings
from optisense.objectives.evaluation import ProgressCallback
from optisense.objectives.named import named_in
from optisense.objectives.registry import pixels_read
from optisense.objectives.relighting import Relighting
from optisense.objectives.run import split_settings
from optisense.objectives.scoring import run_objective
from optisense.search.evaluation.evaluator import RELIGHTS, DesignEvaluator

if TYPE_CHECKING:
    from optisense.optics import OpticalModel

KEPT_SEEDS = 3
"""Number of seeds whose images are kept: the three fresh seeds of the final scoring, which starts
when the study's own seed is no longer needed.
"""


class RelitEvaluator(DesignEvaluator):
    """Evaluator of designs that differ only in the colours and powers of their lights."""

    def __init__(self, usual: DesignEvaluator, *, brief: bool = False) -> None:
        """Copy the settings of the usual evaluator; nothing is rendered yet. With `brief`, for
        thousands of trials, nothing is watched and only the main numbers of scores are stored.
        """
        self.brief = brief
        super().__init__(
            usual.space,
            usual.goals,
            usual.settings,
            requirements=[str(each) for each in usual.requirements],
            variant=usual.variant,
        )

    def _names_to_watch(self) -> tuple[str, ...]:
        """Return no names if thousands of trials follow, as further scores would take longest."""
        return () if self.brief else super()._names_to_watch()

    def objective_scores(
        self, design: SensorDesign, seed: int, only: Collection[str] | None = None
    ) -> Mapping[str, Score]:
        """See `DesignEvaluator.objective_scores`."""
        if seed not in self._images:
            while len(self._images) >= KEPT_SEEDS:
                del self._images[next(iter(self._images))]
            model = self.models.model(self.space.prepared)
            self._images[seed] = _SeedImages(
                model, self._all_objectives, self.settings, seed, self._progress
            )
        found = self._images[seed].scores(design, only)
        if not self.brief:
            return found
        return {name: _without_details(score) for name, score in found.items()}

    @cached_property
    def _images(self) -> dict[int, _SeedImages]:
        """Images and objectives of the last seeds, by the seed."""
        return {}


RELIGHTABLE = frozenset({"rgb2normal", "normdiff", "reading", "depth"})
"""Objectives by pictures that need no image besides those of presses, so that layers suffice."""

LIGHT_INDEPENDENT = frozenset({"aoap", "2to3pw", "coverage", "distortion", "power"})
"""Objectives that need no light."""


def can_relight(usual: DesignEvaluator) -> bool:
    """Return whether layers suffice for the scores of an evaluator: nothing varies but colours and
    powers of lights, and the goals and conditions are of `RELIGHTABLE` and `LIGHT_INDEPENDENT`.
    """
    texts = [goal for goal in usual.goals if isinstance(goal, str)]
    if len(texts) < len(usual.goals) or not all(map(RELIGHTS.search, usual.space.names)):
        return False
    wanted = set(named_in([*texts, *(each.quantity for each in usual.requirements)]))
    return wanted <= RELIGHTABLE | LIGHT_INDEPENDENT and not wanted <= LIGHT_INDEPENDENT


class _SeedImages:
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
        cut, whole = (self._relighting.relit(design, whole=each) for each in (False, True))
        found = {}
        for each in self._objectives:
            if only is None or each.name in only:
                evaluation = cut if _reads_contacts_only(each) else whole
                found[each.name] = run_objective(each, evaluation, self._own[each.name])
        return found


def _reads_contacts_only(objective: Objective) -> bool:
    """Return whether an objective reads no pixel outside of the contacts; a
    user's objective may.
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

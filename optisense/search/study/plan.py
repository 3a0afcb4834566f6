"""Plan of a new study: what to search and how, with all defaults resolved, and the evaluators of
its settings.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import NoneType
from typing import Any

from optisense.design import SensorDesign
from optisense.design.difference import fingerprint
from optisense.errors import SearchError
from optisense.keyword_types import as_type, set_plain_numbers
from optisense.objectives import Objective
from optisense.objectives.combined import goal_of
from optisense.quality import TRIAL_PHOTONS
from optisense.search.evaluation.coarse import CoarseEvaluator
from optisense.search.evaluation.evaluator import (
    DesignEvaluator,
    Evaluator,
    Goal,
    goal_name,
    placed,
)
from optisense.search.evaluation.relit import RelitEvaluator, can_relight
from optisense.search.evaluation.requirements import requirements_of
from optisense.search.evaluation.robust import RobustEvaluator
from optisense.search.methods import Method, Problem, find, make
from optisense.search.methods import names as method_names
from optisense.search.space.constraints import Constraint, UserRule
from optisense.search.space.manufacturing import SAMPLES, ManufacturingErrors
from optisense.search.space.search_space import SearchSpace
from optisense.search.study._same_scoring import SCORING, packages_of
from optisense.search.study.settings import ONLY_HERE, StudySettings
from optisense.search.study.trust import file_prints

RAYS_ACROSS = 320
"""Number of chief rays across the image unless `ray_resolution` is given: a quarter of the rays of
a single evaluation. Over shapes of GelSight Svelte's mirror both rank alike (Spearman 0.99)."""


@dataclass(frozen=True)
class Plan:
    """Plan of a new study; see `optisense.search.search` for each field."""

    space: SearchSpace
    goals: Sequence[Goal]
    method: str = "cma-es"
    options: Mapping[str, Any] | None = None
    budget: int | None = None
    seed: int = 0
    settings: Mapping[str, Any] | None = None
    apart: bool = True
    errors: ManufacturingErrors | None = None
    samples: int | None = None
    requirements: Sequence[str] = ()
    coarse_first: bool = False

    def __post_init__(self) -> None:
        set_plain_numbers(self)
        for name, types in (
            ("budget", (int, NoneType)),
            ("seed", (int,)),
            ("samples", (int, NoneType)),
        ):
            given = getattr(self, name)
            try:
                object.__setattr__(self, name, as_type(given, types))
            except ValueError as wanted:
                raise SearchError(f"the {name} is {given!r}", hint=f"Give {wanted}") from None

    def settings_for(self, design: SensorDesign) -> StudySettings:
        """Return the settings of the study for a design, with all defaults resolved; an error if a
        field of the plan is invalid or names nothing in the design.
        """
        bound = self.space.bind(design)
        settings = dict(self.settings or {})
        requirements = requirements_of(self.requirements)
        measured = [goal_of(goal) for goal in self.goals if isinstance(goal, str | Objective)]
        measured += [each.objective() for each in requirements]
        if any(each.rays_only for each in measured):
            settings.setdefault("ray_resolution", list(design.camera.size_at(RAYS_ACROSS)))
        chosen = find(self.method)
        if not all(each.rays_only for each in measured) and not chosen.renders_once:
            settings.setdefault("photons", TRIAL_PHOTONS)
        kept = [str(each) for each in requirements]
        evaluator = DesignEvaluator(
            bound, self.goals, settings, requirements=kept, apart=self.apart
        )
        samples = self._samples()
        if self.errors is not None:
            self.errors.bind(design)
        if self.coarse_first:
            from_pictures = [each for each in measured if not each.rays_only]
            self._refuse_coarse(chosen, evaluator, from_pictures)
        budget = chosen.default_budget(bound) if self.budget is None else self.budget
        if budget < 1:
            raise SearchError(f"the budget is {budget} trials", hint="Give 1 or more")
        if not 0 <= self.seed < 2**32:
            raise SearchError(f"the seed is {self.seed}", hint="Give a number from 0 to 4294967295")
        options = dict(self.options or {})
        names = tuple(evaluator.names)
        make(self.method, Problem(bound, names, budget, self.seed, tuple(kept)), options)
        objectives = [reference(goal) for goal in self.goals]
        rules = [rule_reference(rule) for rule in self.space.constraints]
        return StudySettings(
            design=design.name,
            fingerprint=fingerprint(design),
            space=self.space.to_plain(),
            objectives=objectives,
            names=evaluator.names,
            method=self.method.strip().lower(),
            options=options,
            budget=budget,
            seed=self.seed,
            settings=settings,
            apart=self.apart,
            rules=rules,
            files=file_prints([*objectives, *rules]),
            errors=None if self.errors is None else self.errors.to_plain(),
            samples=samples,
            requirements=kept,
            coarse_first=self.coarse_first,
            packages=packages_of(objectives, kept, self.method, bound),
            scoring=SCORING,
        )

    def _samples(self) -> int:
        """Return the number of manufactured sensors per trial; 0 without manufacturing errors."""
        if self.errors is not None:
            return SAMPLES if self.samples is None else self.samples
        if self.samples is not None:
            raise SearchError(
                "a number of manufactured sensors is given without a manufacturing error",
                hint="Give an error, such as --error camera.position.z=0.1, or leave --samples out",
            )
        return 0

    def _refuse_coarse(
        self, method: type[Method], evaluator: DesignEvaluator, from_pictures: Sequence[Objective]
    ) -> None:
        """Raise SearchError if coarse scores save nothing or can't guide the method."""
        if not method.accepts_coarse_scores:
            able = [name for name in method_names() if find(name).accepts_coarse_scores]
            raise SearchError(
                f"{self.method} can't search by coarse scores",
                hint=f"Use {', '.join(able)}, or leave --coarse-first out",
            )
        if not from_pictures:
            raise SearchError(
                "no objective or condition of this search needs pictures, so coarse scores would "
                "save no time",
                hint="Leave --coarse-first out",
            )
        if self.errors is None and can_relight(evaluator):
            raise SearchError(
                "only colours and powers of lights vary, so trials render no image, and coarse "
                "scores would save no time",
                hint="Leave --coarse-first out",
            )


def evaluators(
    settings: StudySettings, usual: DesignEvaluator, method: Method
) -> tuple[Evaluator, Evaluator]:
    """Return the evaluator of a study's trials, and that of full scores, which is the same unless
    trials have coarse scores. The method may replace `usual`, the evaluator of plain scores.
    """
    own = method.evaluator(usual)
    if own is usual and settings.errors is None and can_relight(usual):
        relit = RelitEvaluator(usual)
        return relit, relit
    if settings.errors is not None and own is not usual:
        raise SearchError(
            f"{settings.method} can't search with manufacturing errors: it scores in a way "
            "of its own",
            hint="Use cma-es, grid or random; or search without errors and look at the winner with "
            "`optisense tolerance`",
        )
    full = _with_errors(settings, usual) if own is usual else own
    return (_with_errors(settings, CoarseEvaluator(usual)) if settings.coarse_first else full), full


def _with_errors(settings: StudySettings, usual: DesignEvaluator) -> Evaluator:
    """Return an evaluator that also applies the manufacturing errors of a study, if it has any."""
    if settings.errors is None:
        return usual
    errors = ManufacturingErrors.from_plain(settings.errors)
    return RobustEvaluator(usual, errors, settings.seed, settings.samples)


def reference(goal: Goal) -> str:
    """Return the name of a goal in a stored study."""
    return str(placed(goal)) if isinstance(goal, str) else ONLY_HERE + goal_name(goal)


def rule_reference(rule: Constraint) -> str:
    """Return the name of a constraint in a stored study."""
    if isinstance(rule, UserRule):
        return str(rule)
    return ONLY_HERE + str(getattr(rule, "__name__", type(rule).__name__))


def known_goals(settings: StudySettings, given: Sequence[Goal] | None) -> list[Goal]:
    """Return the goals of a stored study, or none if one of them is not known in this process;
    SearchError if the given goals are not those of the study.
    """
    if given:
        names = [goal_name(goal) for goal in given]
        if names != settings.names:
            raise SearchError(
                f"the study searches for {', '.join(settings.names)}, not for {', '.join(names)}"
            )
        return list(given)
    if any(goal.startswith(ONLY_HERE) for goal in settings.objectives):
        return []
    return list(settings.objectives)


def known_rules(settings: StudySettings, given: Sequence[Constraint] | None) -> list[Constraint]:
    """Return the constraints of a stored study, without those unknown in this process."""
    if given:
        return list(given)
    return [UserRule(rule) for rule in settings.rules if not rule.startswith(ONLY_HERE)]

"""Objectives from text: a name, a file, or arithmetic with several objectives."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from optisense.errors import ObjectiveError, UnknownPartError
from optisense.near import suggestion
from optisense.objectives import _figures
from optisense.objectives.expressions import Expression, ScoreTerm
from optisense.objectives.named import is_plain
from optisense.objectives.registry import Objective, find
from optisense.objectives.score import numbers_of
from optisense.objectives.scoring import run_objective
from optisense.text import brief

if TYPE_CHECKING:
    from optisense.objectives.evaluation import Evaluation


@dataclass(frozen=True)
class CombinedObjective(Objective):
    """An objective that is computed from others, such as ``aoap + 0.5*coverage``.

    Its settings are those of its objectives; a setting that several of them have is passed to all.

    Attributes:
        terms: the objectives that it is computed from.
    """

    terms: tuple[Objective, ...] = ()

    @property
    def settings(self) -> dict[str, Any]:
        """The settings of all its objectives, and their defaults."""
        found: dict[str, Any] = {}
        for each in self.terms:
            found |= each.settings
        return found

    @property
    def summary(self) -> str:
        """The parts of the score as text."""
        return "combined from " + " and ".join(each.title for each in self.terms)


def combined(
    expression: Expression, known: Mapping[str, Objective] | None = None
) -> CombinedObjective:
    """Return the objective that an expression defines.

    Args:
        known: objectives by their names in the expression; others are looked up in the registry.

    Raises:
        ObjectiveError: the expression names an unknown objective.
        UnknownPartError: an objective has no such number among its parts.
    """
    terms = {name: (known or {}).get(name) or find(name) for name in expression.objectives}
    for quantity in expression.quantities:
        numbers = terms[quantity.objective].numbers
        if numbers is not None:
            _refuse_unknown_part(quantity, numbers)
    single = expression.single

    def function(evaluation: Evaluation, **settings: Any) -> tuple[float, dict[str, Any]]:
        values, parts = _measured(expression, terms, evaluation, settings)
        shown = {str(quantity): value for quantity, value in values.items()}
        return expression.value(values), {**shown, "parts": parts}

    return CombinedObjective(
        name=expression.text,
        function=function,
        title=expression.text,
        draw=_figures.draw_parts,
        beside=tuple(str(quantity) for quantity in expression.quantities),
        reads=None if any(each.reads is None for each in terms.values()) else _reads(terms),
        unit=_unit(expression, terms),
        lower_is_better=single is not None and terms[single.objective].lower_is_better,
        rays_only=all(each.rays_only for each in terms.values()),
        terms=tuple(terms.values()),
    )


def _measured(
    expression: Expression,
    terms: Mapping[str, Objective],
    evaluation: Evaluation,
    settings: Mapping[str, Any],
) -> tuple[dict[ScoreTerm, float], dict[str, Any]]:
    """Return the value of each quantity, and the parts of each objective."""
    scores = {}
    for name, each in terms.items():
        own = {key: value for key, value in settings.items() if key in each.settings}
        scores[name] = run_objective(each, evaluation, own)
        if scores[name].failure is not None:
            raise ObjectiveError(f"{each.title}: {scores[name].failure}")
    values = {}
    for quantity in expression.quantities:
        score = scores[quantity.objective]
        values[quantity] = score.value
        if quantity.part:
            numbers = numbers_of(score.parts)
            _refuse_unknown_part(quantity, numbers)
            values[quantity] = numbers[quantity.part]
    return values, {name: dict(score.parts) for name, score in scores.items()}


def _refuse_unknown_part(quantity: ScoreTerm, numbers: Collection[str]) -> None:
    """Raise UnknownPartError if the name of a part is not among the numbers of its objective."""
    if quantity.part and quantity.part not in numbers:
        raise UnknownPartError(
            f"{quantity.objective} has no part '{quantity.part}'",
            hint=suggestion(quantity.part, numbers, limit=30)
            if numbers
            else "It has no parts that are numbers",
        )


def _reads(terms: Mapping[str, Objective]) -> Any:
    """Return a function of a press and common settings: the pixels that the objectives read."""
    from optisense.objectives.registry import pixels_read

    def reads(press: Any, **settings: Any) -> Any:
        own = {
            name: {key: value for key, value in settings.items() if key in each.settings}
            for name, each in terms.items()
        }
        found = pixels_read(terms.values(), own)
        assert found is not None, "each objective of it names the pixels that it reads"
        return found(press)

    return reads


def _unit(expression: Expression, terms: Mapping[str, Objective]) -> str:
    """Return the unit of an expression that is one objective's value or its negative, or ""."""
    single = expression.single or (
        expression.quantities[0]
        if expression.text == f"-{expression.quantities[0]}" and len(expression.quantities) == 1
        else None
    )
    return terms[single.objective].unit if single is not None and not single.part else ""


def resolve(wanted: str | Objective | Iterable[str | Objective]) -> list[Objective]:
    """Return objectives by name, file or expression; objects that are objectives already are kept.

    Raises:
        ObjectiveError: an objective is unknown, named twice, or neither a text nor an `Objective`.
    """
    several: list[Any] = [wanted]
    if isinstance(wanted, Iterable) and not isinstance(wanted, str):
        several = list(wanted)
    for each in several:
        if not isinstance(each, str | Objective):
            raise ObjectiveError(
                f"{brief(repr(each))} is no objective",
                hint="Give its name, or a function with the decorator optisense.objective",
            )
    found = [each if isinstance(each, Objective) else objective_of(each) for each in several]
    seen: set[str] = set()
    for each in found:
        if each.name in seen:
            raise ObjectiveError(f"the objective '{each.name}' is named twice")
        seen.add(each.name)
    return found


def objective_of(text: str) -> Objective:
    """Return the objective that a text stands for: a name, ``FILE.py:FUNCTION``, or an expression.

    Raises:
        ObjectiveError: the text is none of these.
    """
    if is_plain(text):
        return find(text)
    expression = Expression.parse(text)
    single = expression.single
    if single is not None and not single.part:
        return find(single.objective)
    return combined(expression)


def goal_of(wanted: str | Objective) -> Objective:
    """Return the objective that a search maximises: the negative value if lower is better, as of
    `reading` and of its part `reading.mean_of_places`.

    Raises:
        ObjectiveError: the text is no objective.
    """
    found = objective_of(wanted) if isinstance(wanted, str) else wanted
    if not found.lower_is_better:
        return found
    if isinstance(found, CombinedObjective):
        return combined(Expression.parse(f"-{found.name}"))
    return combined(Expression.parse(f"-'{found.name}'"), {found.name: found})

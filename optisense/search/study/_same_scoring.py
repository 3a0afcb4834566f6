"""Checks that new trials of a study are scored as its stored ones: by the same definitions, and by
the same packages of objectives, search methods and kinds.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Any

from optisense.design import SensorDesign
from optisense.errors import OptiSenseError, SearchError
from optisense.objectives.named import named_in
from optisense.objectives.registry import OBJECTIVES
from optisense.registry import Registry
from optisense.search.evaluation.outcome import Outcome
from optisense.search.evaluation.requirements import requirements_of
from optisense.search.methods import METHODS
from optisense.search.space.parameters import Choice
from optisense.search.space.search_space import BoundSpace
from optisense.search.study.settings import ONLY_HERE, StudySettings

SCORING = 1
"""Version of how scores and limited quantities follow from a design, the settings and a seed, which
grows when a release changes one of them by more than rounding. Studies that store none have 0, from
before 2to3PW and distortion left out triangles between different reflections."""

SAME_SCORE = 1e-3
"""Largest relative difference between scores of the same definition. A shadow ray that rounding
changes alters scores of pictures by some 1e-5, and changed definitions alter them by 1e-2 and more.
"""

ROUNDING = 1e-9
"""Largest difference, in the unit of the value, between values near zero that count as equal."""


def refuse_other_definitions(then: Outcome, now: Outcome) -> None:
    """Raise SearchError if one design, scored with one seed by an earlier release and by this one,
    has different scores or values of limited quantities, or lacks one now.
    """
    changed = [*_changed(then.scores, now.scores), *_changed(then.conditions, now.conditions)]
    missing = [name for name in now.unmeasured if name not in then.unmeasured]
    if missing:
        changed.append(f"there is no value of {', '.join(missing)} now: {now.failure}")
    if changed:
        raise SearchError(
            "an earlier release scored this study by other definitions: for the same design and "
            f"seed, {'; '.join(changed)}",
            hint="Begin a new study in another folder; this one can still be reported and applied",
        )


def _changed(then: Mapping[str, float | None], now: Mapping[str, float | None]) -> Iterator[str]:
    """Yield a text for each value that is another one; those without a value are not compared."""
    for name, old in then.items():
        new = now.get(name)
        if old is None or new is None or not (math.isfinite(old) and math.isfinite(new)):
            continue
        if not math.isclose(old, new, rel_tol=SAME_SCORE, abs_tol=ROUNDING):
            yield f"{name} was {old:.4g} and is {new:.4g} now"


def packages_of(
    objectives: Sequence[str], requirements: Sequence[str], method: str, space: BoundSpace
) -> dict[str, dict[str, str]]:
    """Return the installed packages of the objectives, the method and the kinds of a search: those
    of the design that it starts from, and those that a choice has as an option. Package, version
    and SHA-256 of the module (`Registry.origin`) of each object from an entry point have its noun
    and name as their key, such as "search method 'halving'".
    """
    texts = [each for each in objectives if not each.startswith(ONLY_HERE)]
    texts += [each.quantity for each in requirements_of(requirements)]
    used: list[tuple[Registry[Any], str]] = [(OBJECTIVES, name) for name in named_in(texts)]
    used.append((METHODS, method.strip().lower()))
    for design in _designs(space):
        used += [(value.kinds, value.kind) for value in design.values_of_kinds().values()]
    found = {}
    for registry, name in dict.fromkeys(used):
        origin = registry.origin(name)
        if origin is not None:
            found[f"{registry.noun} '{name}'"] = origin._asdict()
    return found


def _designs(space: BoundSpace) -> Iterator[SensorDesign]:
    """Yield the design of a space, and one for each option that may be a kind."""
    yield space.design
    for number, parameter in enumerate(space.parameters):
        kind = parameter.kind
        if not isinstance(kind, Choice):
            continue
        for level, option in zip(kind.levels, kind.options, strict=True):
            if isinstance(option, Mapping):
                point = space.start.copy()
                point[number] = level
                with suppress(OptiSenseError):  # its trials fail
                    yield space.apply(point)


def refuse_other_packages(settings: StudySettings, space: BoundSpace) -> None:
    """Raise SearchError if an objective, the method or a kind was of another package, or its module
    another one, when the trials were scored. Studies that stored no packages are not checked.
    """
    then = settings.packages
    if not then:
        return
    now = packages_of(settings.objectives, settings.requirements, settings.method, space)
    for thing, before in then.items():
        after = now.get(thing)
        if after == before:
            continue
        package = _in_words(before)
        hint = f"Install {package} again, or begin a new study"
        if after is None:
            changed = "it is not of this package any more"
        elif _in_words(after) != package:
            changed = f"it is of {_in_words(after)} now"
        else:
            changed = "its module was edited since"
            hint = "Undo the change, or begin a new study"
        raise SearchError(
            f"the study's trials were scored with the {thing} of {package}; {changed}", hint=hint
        )


def _in_words(origin: Mapping[str, str]) -> str:
    return f"{origin.get('package')} {origin.get('version')}"

"""Check that a study is continued with the definitions by which its trials were scored."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from optisense.errors import SearchError
from optisense.search.evaluation.outcome import Outcome

SCORING = 1
"""Version of how scores and limited quantities follow from a design, the settings and a seed. It
grows when a release changes one of them by more than rounding. Studies store it; those of releases
that did not have 0, from before 2to3PW and distortion left out triangles between different
reflections."""

SAME_SCORE = 1e-3
"""Largest relative difference between scores of the same definition. A shadow ray that rounding
changes alters scores of pictures by some 1e-5, and changed definitions alter them by 1e-2 and more.
"""

ROUNDING = 1e-9
"""Largest difference, in the unit of the value, between values near zero that count as equal."""


def refuse_other_definitions(then: Outcome, now: Outcome) -> None:
    """Raise SearchError if one design, scored with one seed by an earlier release and by this one,
    has different scores or values of limited quantities.
    """
    changed = [*_changed(then.scores, now.scores), *_changed(then.conditions, now.conditions)]
    if now.failed:
        changed.append(f"its trial fails now: {now.failure}")
    if changed:
        raise SearchError(
            "an earlier release scored this study by other definitions: for the same design and "
            f"seed, {'; '.join(changed)}",
            hint="Begin a new study with another --out; this one can still be reported and applied",
        )


def _changed(then: Mapping[str, float | None], now: Mapping[str, float | None]) -> Iterator[str]:
    """Yield a text for each value that is another one; those without a value are not compared."""
    for name, old in then.items():
        new = now.get(name)
        if old is None or new is None or not (math.isfinite(old) and math.isfinite(new)):
            continue
        if not math.isclose(old, new, rel_tol=SAME_SCORE, abs_tol=ROUNDING):
            yield f"{name} was {old:.4g} and is {new:.4g} now"

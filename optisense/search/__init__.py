"""Find a better design: spaces of parameters, methods that search them, studies that keep it all.

The package can be called, so that `optisense.search(design, space, ...)` searches.
"""

from __future__ import annotations

import sys
from types import ModuleType
from typing import Any

from optisense.search.making import MakingErrors, Spread
from optisense.search.outcome import Outcome
from optisense.search.parameters import Around, CagePoints, Choice, Continuous, Integer
from optisense.search.plan import Plan
from optisense.search.run import run_study, search
from optisense.search.running import Progress, Result
from optisense.search.space import BoundSpace, SearchSpace
from optisense.search.study import Study
from optisense.search.trial import Trial

__all__ = [
    "Around",
    "BoundSpace",
    "CagePoints",
    "Choice",
    "Continuous",
    "Integer",
    "MakingErrors",
    "Outcome",
    "Plan",
    "Progress",
    "Result",
    "SearchSpace",
    "Spread",
    "Study",
    "Trial",
    "run_study",
    "search",
]


class _Callable(ModuleType):
    """A module that can be called like its function `search`."""

    def __call__(self, *args: Any, **settings: Any) -> Result:
        return search(*args, **settings)


sys.modules[__name__].__class__ = _Callable

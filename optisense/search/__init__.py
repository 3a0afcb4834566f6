"""Find a better design: search spaces, search methods, and the studies that keep every trial.

`search` takes a design, a `SearchSpace` and an objective, and returns a `SearchResult` with its
`Study`. The subpackages, from the bottom up: `space` (the parameters that may change), `evaluation`
(from a point of the space to its scores), `methods` (which points to score next), `executors`
(which process scores them), `study` (the folder of a search and its loop), `tolerance`
(manufacturing errors).
"""

from optisense.search._run_search import run_study, search
from optisense.search.evaluation.outcome import Outcome
from optisense.search.space.manufacturing import ManufacturingErrors, ToleranceDistribution
from optisense.search.space.parameters import (
    Around,
    CagePoints,
    Choice,
    Continuous,
    Integer,
    Together,
)
from optisense.search.space.search_space import BoundSpace, SearchSpace
from optisense.search.study.plan import Plan
from optisense.search.study.progress import SearchProgress, SearchResult
from optisense.search.study.study import Study
from optisense.search.study.trial import Trial

__all__ = [
    "Around",
    "BoundSpace",
    "CagePoints",
    "Choice",
    "Continuous",
    "Integer",
    "ManufacturingErrors",
    "Outcome",
    "Plan",
    "SearchProgress",
    "SearchResult",
    "SearchSpace",
    "Study",
    "Together",
    "ToleranceDistribution",
    "Trial",
    "run_study",
    "search",
]

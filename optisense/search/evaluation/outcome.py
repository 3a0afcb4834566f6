"""What came of trying one point of a search space."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Outcome:
    """The scores of one design.

    Attributes:
        scores: by objective, higher is better; NaN where there is none.
        failure: why a score is missing, or None.
        parts: what the scores are made of, by objective, ready for JSON.
        seconds: wall time.
        gradient: (n,) of the first objective by the coordinates, where a method asks for it.
        worker: who worked it out.
    """

    scores: Mapping[str, float]
    failure: str | None = None
    parts: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    seconds: float = 0.0
    gradient: NDArray[np.float64] | None = field(default=None, compare=False)
    worker: str = ""

    @property
    def failed(self) -> bool:
        """Whether a score is missing."""
        return self.failure is not None

    @staticmethod
    def of_failure(objectives: list[str], reason: str, seconds: float = 0.0) -> Outcome:
        """An outcome without scores."""
        return Outcome(dict.fromkeys(objectives, math.nan), reason, seconds=seconds)

"""Power function as a tone curve."""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from optisense.array_types import FloatingArray
from optisense.design.fields import Positive
from optisense.design.responses._tone_curve import ToneCurve


class GammaCurve(ToneCurve):
    """A power: the stored level is the linear one to the power of 1 / gamma."""

    title: ClassVar[str] = "Gamma"

    kind: Literal["gamma"] = "gamma"
    gamma: Positive = Field(default=2.2, description="1 stores linear levels", examples=[2.2])

    def curve(self, linear: FloatingArray) -> NDArray[np.float64]:
        """Return the stored levels (...), 0 to 1: a power of linear levels (...)."""
        level = np.clip(np.asarray(linear, dtype=float), 0.0, 1.0)
        return np.asarray(level ** (1.0 / self.gamma))

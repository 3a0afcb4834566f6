"""Tone curves: from the linear level of a channel to the stored level."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import FloatingArray
from optisense.design.kinds import KindModel
from optisense.design.responses.base import LEVELS, ramp
from optisense.errors import DesignError
from optisense.registry import Registry


class ToneCurve(KindModel):
    """Conversion of linear levels, 0 to 1, into stored ones, 0 to 1; each kind is a subclass."""

    kinds: ClassVar[Registry[Any]] = Registry(
        "kind of tone curve",
        "optisense.tone_curves",
        DesignError,
        {
            "srgb": "optisense.design.responses._srgb_curve:SrgbCurve",
            "gamma": "optisense.design.responses.gamma_curve:GammaCurve",
            "points": "optisense.design.responses._points_curve:PointsCurve",
        },
    )

    def _check_own_kind(self) -> None:
        """Check the stored levels of a ramp.

        Raises:
            LibraryError: a level is not within 0 to 1, or they are of another shape.
        """
        self._require("curve", self.curve(ramp(1.0)), LEVELS)

    @abstractmethod
    def curve(self, linear: FloatingArray) -> NDArray[np.float64]:
        """Return the stored levels (...), 0 to 1 before rounding, of linear levels (...).

        Linear levels are clipped to 0..1.
        """

    def encode(self, linear: FloatingArray) -> NDArray[np.uint8]:
        """Return the stored levels (...) in 8 bits."""
        return np.round(255.0 * self.curve(linear)).astype(np.uint8)

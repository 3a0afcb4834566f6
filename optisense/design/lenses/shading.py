"""Lens shading: the dimming of the picture towards its corners by the lens and the sensor's pixels.

`transmission` is the share of the light that reaches the sensor. `corrected` is the share of the
dimming that the camera's processor undoes: its gain at a place is 1 + corrected (1 / transmission -
1), as libcamera's `luminance_strength` scales its table. The noise is amplified with it.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, ClassVar

from pydantic import Field

from optisense.array_types import FloatingArray
from optisense.design.fields import Fraction
from optisense.design.kinds import KindModel, Limits
from optisense.design.lenses.film import FilmPlaces, film_places
from optisense.errors import DesignError
from optisense.registry import Registry

ABOVE_0 = Limits("an array (h, w, 3) of finite numbers above 0", (4, 5, 3), above=0.0)
"""Limits of transmission and gain in the small picture by which own kinds are tried."""


class LensShading(KindModel):
    """The transmittance of a lens over the picture; each kind is a subclass."""

    kinds: ClassVar[Registry[Any]] = Registry(
        "kind of lens shading",
        "optisense.shadings",
        DesignError,
        {
            "table": "optisense.design.lenses._table_shading:TableShading",
            "radial": "optisense.design.lenses.radial_shading:RadialShading",
        },
    )

    kind: str
    corrected: Fraction = Field(
        default=0.0, description="share of the dimming that the camera's processor undoes"
    )

    def _check_own_kind(self) -> None:
        """Check the transmission over a small picture, and its correction.

        Raises:
            LibraryError: a number is not above 0, or the result is of another shape.
        """
        found = self.transmission(film_places(*ABOVE_0.shape[:2]))
        self._require("transmission", found, ABOVE_0)
        self._require("correction", self.correction(found), ABOVE_0)

    @abstractmethod
    def transmission(self, places: FilmPlaces) -> FloatingArray:
        """Return the share (h, w, 3) of the light of R, G, B that reaches the sensor, above 0."""

    def correction(self, transmission: FloatingArray) -> FloatingArray:
        """Return the gain (h, w, 3) by which the processor undoes a transmission."""
        return 1.0 + self.corrected * (1.0 / transmission - 1.0)

"""Lens shading: the dimming of the picture towards its corners by the lens and the sensor's pixels.

`transmission` is the share of the light that reaches the sensor. `corrected` is the share of the
dimming that the camera's processor undoes: its gain at a place is 1 + corrected (1 / transmission -
1), as libcamera's `luminance_strength` scales its table. The noise is amplified with it.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from optisense.array_types import FloatingArray
from optisense.design.fields import Fraction, InconsistentValueError, Number
from optisense.design.kinds import KindModel, Limits
from optisense.design.lenses.film import FilmPlaces, film_places
from optisense.errors import DesignError
from optisense.registry import Registry

PICTURE_ABOVE_0 = Limits("an array (h, w, 3) of finite numbers above 0", (4, 5, 3), above=0.0)
"""Limits of transmission and gain in the small picture by which own kinds are tried."""

TABLE_ROWS, TABLE_COLUMNS = 12, 16
"""Size of shading tables in libcamera's tuning files for Raspberry Pi (rpi.alsc on VC4)."""

Gain = Annotated[Number, Field(ge=0.1, le=1000.0)]

GainTable = list[list[Gain]]

Falloff = Annotated[Number, Field(ge=0.0, lt=1.0)]


class LensShading(KindModel):
    """The transmittance of a lens over the picture; each kind is a subclass."""

    kinds: ClassVar[Registry[Any]] = Registry(
        "kind of lens shading",
        "optisense.shadings",
        DesignError,
        {
            "table": "optisense.design.lenses.shading:TableShading",
            "radial": "optisense.design.lenses.shading:RadialShading",
        },
    )

    kind: str
    corrected: Fraction = Field(
        default=0.0, description="share of the dimming that the camera's processor undoes"
    )

    def _check_own_kind(self) -> None:
        """Check the transmission over a small picture, and its correction."""
        found = self.transmission(film_places(*PICTURE_ABOVE_0.shape[:2]))
        self._require("transmission", found, PICTURE_ABOVE_0)
        self._require("correction", self.correction(found), PICTURE_ABOVE_0)

    @abstractmethod
    def transmission(self, places: FilmPlaces) -> FloatingArray:
        """Return the share (h, w, 3) of the light of R, G, B that reaches the sensor, above 0."""

    def correction(self, transmission: FloatingArray) -> FloatingArray:
        """Return the gain (h, w, 3) by which the processor undoes a transmission."""
        return 1.0 + self.corrected * (1.0 / transmission - 1.0)


class TableShading(LensShading):
    """A table of the gains that undo the shading, as tuning files of cameras hold it.

    A row of the table describes a band of the picture, and a number in it a cell of that band. The
    gain is interpolated between the middles of cells and constant beyond the outermost ones.
    """

    title: ClassVar[str] = "Table"

    kind: Literal["table"] = "table"
    gain: GainTable = Field(
        description="rows, from the top, of the gain that undoes the shading of green"
    )
    red: GainTable | None = Field(
        default=None, description="rows of red's further gain, over that of green"
    )
    blue: GainTable | None = Field(
        default=None, description="rows of blue's further gain, over that of green"
    )
    colour_corrected: Fraction = Field(
        default=0.0, description="share of the further gains that the camera's processor applies"
    )

    @model_validator(mode="after")
    def _tables_fit(self) -> TableShading:
        for name in ("gain", "red", "blue"):
            table = getattr(self, name)
            if table is None:
                continue
            widths = [len(row) for row in table]
            if len(table) < 2 or min(widths) < 2 or len(set(widths)) > 1:
                shape = f"{len(table)} rows of " + " or ".join(map(str, sorted(set(widths))))
                raise InconsistentValueError(
                    f"the shading table '{name}' has {shape} numbers",
                    (name,),
                    "Give rows of equal length, two or more of each, such as "
                    f"{TABLE_ROWS} rows of {TABLE_COLUMNS}",
                )
            if (len(table), widths[0]) != (len(self.gain), len(self.gain[0])):
                raise InconsistentValueError(
                    f"the shading table '{name}' has {len(table)} rows of {widths[0]} numbers, "
                    f"and 'gain' has {len(self.gain)} of {len(self.gain[0])}",
                    (name,),
                    "Give tables of one size",
                )
        return self

    def transmission(self, places: FilmPlaces) -> FloatingArray:
        """Return the transmission (h, w, 3): the inverse of the gains."""
        from scipy.ndimage import map_coordinates  # takes a third of a second to load

        rows, columns = len(self.gain), len(self.gain[0])
        at = np.array([places.down * rows - 0.5, places.across * columns - 0.5])

        def spread(table: GainTable) -> FloatingArray:
            return map_coordinates(np.array(table), at, order=1, mode="nearest")

        green = spread(self.gain)
        further = [1.0 if table is None else spread(table) for table in (self.red, self.blue)]
        return 1.0 / np.stack([green * further[0], green, green * further[1]], axis=-1)

    def correction(self, transmission: FloatingArray) -> FloatingArray:
        """Return the gain (h, w, 3) that the processor applies for a transmission (h, w, 3).

        It is the gain of green, times the further gains of red and blue, each in its share.
        """
        green = transmission[..., 1:2]
        further = green / transmission
        gain = 1.0 + self.corrected * (1.0 / green - 1.0)
        return gain * (1.0 + self.colour_corrected * (further - 1.0))


class RadialShading(LensShading):
    """The transmission falls with a power of the distance from the picture's middle.

    With another lens than the one for which its shading was corrected, a sensor's pictures have
    corners of another colour than their middle, so each channel may have its own loss.
    """

    title: ClassVar[str] = "Radial"

    kind: Literal["radial"] = "radial"
    falloff: Falloff = Field(
        default=0.5, description="share of the light that is lost in the picture's corners"
    )
    red_falloff: Falloff | None = Field(
        default=None, description="share of red light that is lost there, if it is another"
    )
    blue_falloff: Falloff | None = Field(
        default=None, description="share of blue light that is lost there, if it is another"
    )
    power: Annotated[Number, Field(ge=1.0, le=16.0)] = Field(
        default=2.0, description="power of the distance with which the loss grows"
    )

    def transmission(self, places: FilmPlaces) -> FloatingArray:
        """Return the transmission (h, w, 3): 1 in the middle, 1 - falloff in the corners and beyond
        them.
        """
        each = [
            self.falloff if own is None else own
            for own in (self.red_falloff, None, self.blue_falloff)
        ]
        return 1.0 - np.multiply.outer(np.minimum(places.radius, 1.0) ** self.power, np.array(each))

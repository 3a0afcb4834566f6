"""Shading by a table of gains, as in tuning files of cameras."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from optisense.array_types import FloatingArray
from optisense.design.fields import Fraction, InconsistentValueError, Number
from optisense.design.lenses.film import FilmPlaces
from optisense.design.lenses.shading import LensShading

TABLE_ROWS, TABLE_COLUMNS = 12, 16
"""Size of shading tables in libcamera's tuning files for Raspberry Pi (rpi.alsc on VC4)."""

Gain = Annotated[Number, Field(ge=0.1, le=1000.0)]

GainTable = list[list[Gain]]


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

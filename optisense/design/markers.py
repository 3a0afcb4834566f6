"""Dots printed on the skin, whose motion shows its lateral displacement."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from optisense.design.fields import (
    MILLIMETRES,
    Colour,
    InconsistentValueError,
    Model,
    Number,
    Positive,
    is_left_out,
)

MOST_MARKERS = 4000
"""Largest number of dots of one design; sensors have some dozens to some hundreds."""

Places = Annotated[list[tuple[Number, Number]], Field(min_length=1, max_length=MOST_MARKERS)]
Side = Annotated[int, Field(strict=True, ge=1, le=200)]


class Markers(Model):
    """Dots on the sensing surface: a grid of them around its middle, or a list of positions."""

    radius: Positive = Field(
        description="radius of a dot", examples=[0.4], json_schema_extra=MILLIMETRES
    )
    reflectance: Colour = Field(
        default=(0.03, 0.03, 0.03), description="diffuse reflectance of the dots' ink for R, G, B"
    )
    grid: tuple[Side, Side] | None = Field(
        default=None, exclude_if=is_left_out, description="numbers of dots along u and along v"
    )
    pitch: Positive | None = Field(
        default=None,
        exclude_if=is_left_out,
        description="distance between dots of the grid",
        json_schema_extra=MILLIMETRES,
    )
    places: Places | None = Field(
        default=None,
        exclude_if=is_left_out,
        description="surface coordinates u, v of each dot, in place of a grid",
        json_schema_extra=MILLIMETRES,
    )

    @model_validator(mode="after")
    def _check_one_layout(self) -> Markers:
        if (self.grid is None) == (self.places is None):
            raise InconsistentValueError(
                "markers have a grid or places, one of both", ("grid",), "Give one of them"
            )
        if (self.grid is None) != (self.pitch is None):
            raise InconsistentValueError(
                "markers have a grid without a pitch, or a pitch without a grid",
                ("pitch",),
                "Give both, or places",
            )
        return self

    def coordinates(self) -> list[tuple[float, float]]:
        """Return the surface coordinates u, v of each dot, mm: row by row from the lowest v."""
        if self.places is not None:
            return list(self.places)
        assert self.grid is not None and self.pitch is not None
        across, along = self.grid
        return [
            (self.pitch * (i - (across - 1) / 2), self.pitch * (j - (along - 1) / 2))
            for j in range(along)
            for i in range(across)
        ]

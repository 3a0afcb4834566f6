"""Blur of one width over the whole picture."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from optisense.array_types import FloatingArray
from optisense.design.fields import NonNegative
from optisense.design.lenses.blur import LensBlur, LensView


class GaussianBlur(LensBlur):
    """Blur of the same width everywhere."""

    title: ClassVar[str] = "Gaussian"

    kind: Literal["gaussian"] = "gaussian"
    width: Annotated[NonNegative, Field(le=1000.0)] = Field(
        description="standard deviation in pixels of the camera's own resolution",
        examples=[0.7],
        json_schema_extra={"unit": "pixels"},
    )

    def deviation(self, camera: LensView, vergence: FloatingArray) -> FloatingArray:
        """Return the width over the number of pixels across, in the shape of `vergence`."""
        return np.asarray(self.width / camera.resolution[0]) + 0.0 * vergence

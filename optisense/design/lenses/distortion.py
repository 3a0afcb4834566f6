"""Lens distortion: where a lens shows what an ideal one would show elsewhere.

An ideal lens shows a direction at a place of its *image plane*: x to the right and y down. For a
perspective lens that place is the tangent of the angle to the axis, for an equidistant one the
angle itself, in radians. `distort` gives the place where the real lens shows it; `undistort` goes
back.

Coefficients, signs and axes are those of OpenCV, whose calibrations can be entered as they are.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from optisense.design.fields import Number
from optisense.design.kinds import KindModel
from optisense.errors import DesignError
from optisense.registry import Registry

FloatArray = NDArray[np.floating]

NEWTON_STEPS = 12
"""Steps of Newton's method in `undistort`. Seven reach the rounding of single precision for lenses
that move the picture's corners by half of their distance from the middle."""

Share = Annotated[Number, Field(ge=0.0, le=1.0)]

Coefficient = Annotated[Number, Field(ge=-1e6, le=1e6)]


class LensDistortion(KindModel):
    """The departure of a lens from its projection; each kind is a subclass.

    `distort` and `slopes` use nothing but the four operations of arithmetic, so that they serve
    NumPy's arrays and those of the renderer alike. The coefficients are handed to them, as they are
    numbers of the renderer there.
    """

    kinds: ClassVar[Registry[Any]] = Registry(
        "kind of lens distortion",
        "optisense.distortions",
        DesignError,
        {
            "brown-conrady": "optisense.design.lenses.brown_conrady:BrownConrady",
            "kannala-brandt": "optisense.design.lenses.kannala_brandt:KannalaBrandt",
        },
    )

    projection: ClassVar[str] = "perspective"
    """The projection that it departs from."""

    kind: str
    centre: tuple[Share, Share] = Field(
        default=(0.5, 0.5),
        description="where the lens's axis meets the picture, shares of its width and height from "
        "the top left",
    )

    @abstractmethod
    def coefficients(self) -> tuple[float, ...]:
        """The numbers of the model."""

    @staticmethod
    @abstractmethod
    def distort(x: Any, y: Any, numbers: tuple[Any, ...]) -> tuple[Any, Any]:
        """Where the lens shows a place of the ideal image plane.

        Args:
            x, y: the place.
            numbers: as of `coefficients`.
        """

    @staticmethod
    @abstractmethod
    def slopes(x: Any, y: Any, numbers: tuple[Any, ...]) -> tuple[Any, Any, Any, Any]:
        """Derivatives of `distort`: of its x by x and by y, of its y by x and by y."""

    def undistort(self, x: Any, y: Any, numbers: tuple[Any, ...]) -> tuple[Any, Any]:
        """The place of the ideal image plane that the lens shows at a place, by Newton's method."""
        ideal_x, ideal_y = x, y
        for _ in range(NEWTON_STEPS):
            shown_x, shown_y = self.distort(ideal_x, ideal_y, numbers)
            a, b, c, d = self.slopes(ideal_x, ideal_y, numbers)
            off_x, off_y = shown_x - x, shown_y - y
            inverse = 1.0 / (a * d - b * c)
            ideal_x = ideal_x - (d * off_x - b * off_y) * inverse
            ideal_y = ideal_y - (a * off_y - c * off_x) * inverse
        return ideal_x, ideal_y

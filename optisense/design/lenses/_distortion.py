"""Lens distortion: the displacement of image points from those of an ideal lens.

An ideal lens maps a direction to a point of its *image plane*, x to the right and y down. For a
perspective lens that point is the tangent of the angle to the axis, for an equidistant one the
angle itself, in radians. `distort` returns the point where the real lens shows it; `undistort` is
the inverse.

Coefficients, signs and axes are those of OpenCV, whose calibrations can be entered as they are.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import Annotated, Any, ClassVar

from pydantic import Field

from optisense.design.fields import Number
from optisense.design.kinds import KindModel
from optisense.errors import DesignError
from optisense.registry import Registry

NEWTON_STEPS = 12
"""Number of Newton steps in `undistort`. Seven reach single precision for lenses that move the
picture's corners by half of their distance from the middle.
"""

Share = Annotated[Number, Field(ge=0.0, le=1.0)]

Coefficient = Annotated[Number, Field(ge=-1e6, le=1e6)]


class LensDistortion(KindModel):
    """Departure of a lens from its projection; each kind is a subclass.

    `distort` and `jacobian` use only the four arithmetic operations, so that they work for NumPy's
    arrays and those of the renderer. The coefficients are arguments, because they are arrays of the
    renderer there.
    """

    kinds: ClassVar[Registry[Any]] = Registry(
        "kind of lens distortion",
        "optisense.distortions",
        DesignError,
        {
            "brown-conrady": "optisense.design.lenses._brown_conrady:BrownConrady",
            "kannala-brandt": "optisense.design.lenses._kannala_brandt:KannalaBrandt",
        },
    )

    projection: ClassVar[str] = "perspective"
    """Projection of the lens without distortion."""

    kind: str
    centre: tuple[Share, Share] = Field(
        default=(0.5, 0.5),
        description="point where the lens's axis meets the picture, in shares of its width and "
        "height from the top left",
    )

    @abstractmethod
    def coefficients(self) -> tuple[float, ...]:
        """Return the coefficients of the model."""

    @staticmethod
    @abstractmethod
    def distort(x: Any, y: Any, numbers: tuple[Any, ...]) -> tuple[Any, Any]:
        """Return the position (x, y) at which the lens shows points of the ideal image plane.

        Args:
            x, y: points of the ideal image plane, arrays of one shape.
            numbers: coefficients, as from `coefficients`.
        """

    @staticmethod
    @abstractmethod
    def jacobian(x: Any, y: Any, numbers: tuple[Any, ...]) -> tuple[Any, Any, Any, Any]:
        """Return the derivatives of `distort`: dx/dx, dx/dy, dy/dx and dy/dy.

        Args:
            x, y: points of the ideal image plane, arrays of one shape.
            numbers: coefficients, as from `coefficients`.
        """

    def undistort(self, x: Any, y: Any, numbers: tuple[Any, ...]) -> tuple[Any, Any]:
        """Return the points (x, y) of the ideal image plane that the lens shows at positions.

        Newton's method is used; where the lens folds, it does not converge.

        Args:
            x, y: positions as the lens shows them, arrays of one shape.
            numbers: coefficients, as from `coefficients`.
        """
        ideal_x, ideal_y = x, y
        for _ in range(NEWTON_STEPS):
            shown_x, shown_y = self.distort(ideal_x, ideal_y, numbers)
            a, b, c, d = self.jacobian(ideal_x, ideal_y, numbers)
            off_x, off_y = shown_x - x, shown_y - y
            inverse = 1.0 / (a * d - b * c)
            ideal_x = ideal_x - (d * off_x - b * off_y) * inverse
            ideal_y = ideal_y - (a * off_y - c * off_x) * inverse
        return ideal_x, ideal_y

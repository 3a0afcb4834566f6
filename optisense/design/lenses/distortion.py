"""Lens distortion: where a lens shows what an ideal one would show elsewhere.

An ideal lens shows a direction at a place of its *image plane*: x to the right and y down. For a
perspective lens that place is the tangent of the angle to the axis, for an equidistant one the
angle itself, in radians. `distort` gives the place where the real lens shows it; `undistort` goes
back.

Coefficients, signs and axes are those of OpenCV, whose calibrations can be entered as they are.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from optisense.design.fields import Number
from optisense.design.kinds import KindModel
from optisense.errors import DesignError
from optisense.registry import Registry

FloatArray = NDArray[np.floating]

HOME = "optisense.design.lenses.distortion"

NEWTON_STEPS = 12
"""Steps of Newton's method in `undistort`. Seven reach the rounding of single precision for lenses
that move the picture's corners by half of their distance from the middle."""

Share = Annotated[Number, Field(ge=0.0, le=1.0)]

Coefficient = Annotated[Number, Field(ge=-1e6, le=1e6)]


class LensDistortion(KindModel):
    """How a lens departs from its projection; each kind is a subclass.

    `distort` and `slopes` use nothing but the four operations of arithmetic, so that they serve
    NumPy's arrays and those of the renderer alike. The coefficients are handed to them, as they are
    numbers of the renderer there.
    """

    kinds: ClassVar[Registry[Any]] = Registry(
        "kind of lens distortion",
        "optisense.distortions",
        DesignError,
        {"brown-conrady": f"{HOME}:BrownConrady", "kannala-brandt": f"{HOME}:KannalaBrandt"},
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


class BrownConrady(LensDistortion):
    """Radial and tangential distortion of a perspective lens (Brown 1966).

    With r the distance from the axis, x becomes x (1 + k1 r^2 + k2 r^4 + k3 r^6) + 2 p1 x y +
    p2 (r^2 + 2 x^2), and y becomes y (1 + k1 r^2 + k2 r^4 + k3 r^6) + p1 (r^2 + 2 y^2) + 2 p2 x y.
    """

    title: ClassVar[str] = "Brown-Conrady"
    projection: ClassVar[str] = "perspective"

    kind: Literal["brown-conrady"] = "brown-conrady"
    k1: Coefficient = Field(default=0.0, description="below 0 is a barrel, above 0 a pincushion")
    k2: Coefficient = Field(default=0.0, description="of the fourth power of the radius")
    p1: Coefficient = Field(default=0.0, description="tangential, along y")
    p2: Coefficient = Field(default=0.0, description="tangential, along x")
    k3: Coefficient = Field(default=0.0, description="of the sixth power of the radius")

    def coefficients(self) -> tuple[float, ...]:
        """k1, k2, p1, p2, k3: OpenCV's order."""
        return self.k1, self.k2, self.p1, self.p2, self.k3

    @staticmethod
    def distort(x: Any, y: Any, numbers: tuple[Any, ...]) -> tuple[Any, Any]:
        """Where the lens shows a place of the ideal image plane."""
        k1, k2, p1, p2, k3 = numbers
        square = x * x + y * y
        radial = 1.0 + square * (k1 + square * (k2 + square * k3))
        return (
            x * radial + 2.0 * p1 * x * y + p2 * (square + 2.0 * x * x),
            y * radial + p1 * (square + 2.0 * y * y) + 2.0 * p2 * x * y,
        )

    @staticmethod
    def slopes(x: Any, y: Any, numbers: tuple[Any, ...]) -> tuple[Any, Any, Any, Any]:
        """Derivatives of `distort`."""
        k1, k2, p1, p2, k3 = numbers
        square = x * x + y * y
        radial = 1.0 + square * (k1 + square * (k2 + square * k3))
        rise = 2.0 * (k1 + square * (2.0 * k2 + square * 3.0 * k3))
        cross = x * y * rise + 2.0 * (p1 * x + p2 * y)
        return (
            radial + x * x * rise + 2.0 * p1 * y + 6.0 * p2 * x,
            cross,
            cross,
            radial + y * y * rise + 6.0 * p1 * y + 2.0 * p2 * x,
        )


class KannalaBrandt(LensDistortion):
    """Radial distortion of a fisheye lens (Kannala and Brandt 2006).

    A ray at the angle t from the axis is shown at t (1 + k1 t^2 + k2 t^4 + k3 t^6 + k4 t^8), where
    an equidistant lens shows it at t.
    """

    title: ClassVar[str] = "Kannala-Brandt"
    projection: ClassVar[str] = "equidistant"

    kind: Literal["kannala-brandt"] = "kannala-brandt"
    k1: Coefficient = Field(default=0.0, description="of the third power of the angle")
    k2: Coefficient = Field(default=0.0, description="of the fifth power of the angle")
    k3: Coefficient = Field(default=0.0, description="of the seventh power of the angle")
    k4: Coefficient = Field(default=0.0, description="of the ninth power of the angle")

    def coefficients(self) -> tuple[float, ...]:
        """k1 to k4: OpenCV's order."""
        return self.k1, self.k2, self.k3, self.k4

    @staticmethod
    def distort(x: Any, y: Any, numbers: tuple[Any, ...]) -> tuple[Any, Any]:
        """Where the lens shows a place of the ideal image plane."""
        k1, k2, k3, k4 = numbers
        square = x * x + y * y
        radial = 1.0 + square * (k1 + square * (k2 + square * (k3 + square * k4)))
        return x * radial, y * radial

    @staticmethod
    def slopes(x: Any, y: Any, numbers: tuple[Any, ...]) -> tuple[Any, Any, Any, Any]:
        """Derivatives of `distort`."""
        k1, k2, k3, k4 = numbers
        square = x * x + y * y
        radial = 1.0 + square * (k1 + square * (k2 + square * (k3 + square * k4)))
        rise = 2.0 * (k1 + square * (2.0 * k2 + square * (3.0 * k3 + square * 4.0 * k4)))
        return radial + x * x * rise, x * y * rise, x * y * rise, radial + y * y * rise

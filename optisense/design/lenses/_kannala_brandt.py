"""Distortion of fisheyes: a polynomial of the angle."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

from pydantic import Field

from optisense.design.lenses._distortion import Coefficient, LensDistortion


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
        """Return k1 to k4, in OpenCV's order."""
        return self.k1, self.k2, self.k3, self.k4

    @staticmethod
    def distort(x: Any, y: Any, numbers: tuple[Any, ...]) -> tuple[Any, Any]:
        """Return the position (x, y) at which the lens shows points of the ideal image plane."""
        k1, k2, k3, k4 = numbers
        square = x * x + y * y
        radial = 1.0 + square * (k1 + square * (k2 + square * (k3 + square * k4)))
        return x * radial, y * radial

    @staticmethod
    def jacobian(x: Any, y: Any, numbers: tuple[Any, ...]) -> tuple[Any, Any, Any, Any]:
        """Return dx/dx, dx/dy, dy/dx and dy/dy of `distort`, each in the shape of `x`."""
        k1, k2, k3, k4 = numbers
        square = x * x + y * y
        radial = 1.0 + square * (k1 + square * (k2 + square * (k3 + square * k4)))
        rise = 2.0 * (k1 + square * (2.0 * k2 + square * (3.0 * k3 + square * 4.0 * k4)))
        return radial + x * x * rise, x * y * rise, x * y * rise, radial + y * y * rise

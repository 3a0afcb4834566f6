"""Radial and tangential distortion of perspective lenses."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

from pydantic import Field

from optisense.design.lenses._distortion import Coefficient, LensDistortion


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
        """Return k1, k2, p1, p2, k3, in OpenCV's order."""
        return self.k1, self.k2, self.p1, self.p2, self.k3

    @staticmethod
    def distort(x: Any, y: Any, numbers: tuple[Any, ...]) -> tuple[Any, Any]:
        """Return the position (x, y) at which the lens shows points of the ideal image plane."""
        k1, k2, p1, p2, k3 = numbers
        square = x * x + y * y
        radial = 1.0 + square * (k1 + square * (k2 + square * k3))
        return (
            x * radial + 2.0 * p1 * x * y + p2 * (square + 2.0 * x * x),
            y * radial + p1 * (square + 2.0 * y * y) + 2.0 * p2 * x * y,
        )

    @staticmethod
    def jacobian(x: Any, y: Any, numbers: tuple[Any, ...]) -> tuple[Any, Any, Any, Any]:
        """Return dx/dx, dx/dy, dy/dx and dy/dy of `distort`, each in the shape of `x`."""
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

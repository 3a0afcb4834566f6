"""Lens distortion: the displacement of image points from those of an ideal lens.

An ideal lens maps a direction to a point of its *image plane*, x to the right and y down. For a
perspective lens that point is the tangent of the angle to the axis, for an equidistant one the
angle itself, in radians. `distort` returns the point where the real lens shows it; `undistort` is
the inverse.

Coefficients, signs and axes are those of OpenCV, whose calibrations can be entered as they are.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from optisense.array_types import FloatArray
from optisense.design.fields import Fraction, Number
from optisense.design.kinds import KindModel, Limits
from optisense.errors import DesignError, LibraryError
from optisense.registry import Registry

NEWTON_STEPS = 16
"""Number of Newton steps in `undistort`, with those that are halved. Of 4,000 random lenses that do
not fold up to the picture's corners, all are inverted to 1e-9 with 16, and 2 are not with 12."""

TRIED_WITHIN = 0.3
"""Largest coordinate of the points at which own kinds are tried: some 17 degrees off the axis."""

STEP = 1e-5
"""Difference of coordinates by which derivatives are tried; their error is near 1e-10."""

SAME_SLOPE = 1e-4
"""Largest difference of derivatives, relative to the largest of them, that counts as rounding."""

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
            "brown-conrady": "optisense.design.lenses.distortion:BrownConrady",
            "kannala-brandt": "optisense.design.lenses.distortion:KannalaBrandt",
        },
    )

    projection: ClassVar[str] = "perspective"
    """Projection of the lens without distortion."""

    kind: str
    centre: tuple[Fraction, Fraction] = Field(
        default=(0.5, 0.5),
        description="point where the lens's axis meets the picture, in shares of its width and "
        "height from the top left",
    )

    def _check_own_kind(self) -> None:
        """Check its coefficients, and its derivatives against differences near the axis."""
        numbers = self.coefficients()
        kept = np.asarray(numbers)
        self._require("coefficients", kept, Limits("a tuple of finite numbers", (kept.size,)))
        x, y = np.meshgrid(*(np.linspace(-TRIED_WITHIN, TRIED_WITHIN, count) for count in (5, 4)))
        shape = (2, *x.shape)
        words = "arrays of finite numbers in the shape of x and y"

        def shown(off_x: float, off_y: float) -> FloatArray:
            found = np.array(self.distort(x + off_x, y + off_y, numbers))
            self._require("distort", found, Limits(f"two {words}", shape))
            return found

        across = (shown(STEP, 0.0) - shown(-STEP, 0.0)) / (2.0 * STEP)
        down = (shown(0.0, STEP) - shown(0.0, -STEP)) / (2.0 * STEP)
        slopes = [across[0], down[0], across[1], down[1]]
        told = np.array(np.broadcast_arrays(x, *self.jacobian(x, y, numbers))[1:])
        self._require("jacobian", told, Limits(f"four {words}", (4, *x.shape)))
        if np.abs(told - slopes).max() > SAME_SLOPE * max(1.0, np.abs(slopes).max()):
            raise LibraryError(
                f"jacobian() of the {self.kinds.noun} '{self.kind}' does not return the "
                "derivatives of distort()",
                hint="Repair its class: return dx/dx, dx/dy, dy/dx and dy/dy",
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

    def undistort(
        self, x: Any, y: Any, numbers: tuple[Any, ...], select: Callable[..., Any] = np.where
    ) -> tuple[Any, Any]:
        """Return the points (x, y) of the ideal image plane that the lens shows at positions.

        Newton's method starts on the axis. A step that leads farther away or beyond a fold is
        halved until it does not, so that the points are found wherever the lens does not fold on
        the way to them; where it folds, the method does not converge.

        Args:
            x, y: positions as the lens shows them, arrays of one shape.
            numbers: coefficients, as from `coefficients`.
            select: function of a mask and two arrays that returns the elements of the first one
                where the mask is true, and those of the second one elsewhere.
        """

        def state(ideal_x: Any, ideal_y: Any) -> tuple[Any, ...]:
            shown_x, shown_y = self.distort(ideal_x, ideal_y, numbers)
            off_x, off_y = shown_x - x, shown_y - y
            slopes = self.jacobian(ideal_x, ideal_y, numbers)
            return ideal_x, ideal_y, off_x, off_y, off_x * off_x + off_y * off_y, *slopes

        now = state(0.0 * x, 0.0 * y)
        share = 1.0 + 0.0 * x
        for _ in range(NEWTON_STEPS):
            ideal_x, ideal_y, off_x, off_y, error, a, b, c, d = now
            step = share / (a * d - b * c)
            tried = state(
                ideal_x - (d * off_x - b * off_y) * step, ideal_y - (a * off_y - c * off_x) * step
            )
            *_, new_error, a, b, c, d = tried
            nearer = (new_error < error) & (a * d - b * c > 0.0)
            now = tuple(select(nearer, new, old) for new, old in zip(tried, now, strict=True))
            share = select(nearer, 1.0, 0.5 * share)
        return now[0], now[1]


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

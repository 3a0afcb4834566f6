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
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field

from optisense.array_types import FloatArray
from optisense.design.fields import Number
from optisense.design.kinds import KindModel, Limits
from optisense.errors import DesignError, LibraryError
from optisense.registry import Registry

NEWTON_STEPS = 16
"""Number of Newton steps in `undistort`, with those that are halved. Of 4,000 random lenses that do
not fold up to the picture's corners, all are inverted to 1e-9 with 16, and 2 are not with 12.
"""

TRIED_WITHIN = 0.3
"""Largest coordinate of the points at which own kinds are tried: some 17 degrees off the axis."""

STEP = 1e-5
"""Difference of coordinates by which derivatives are tried; their error is near 1e-10."""

SAME_SLOPE = 1e-4
"""Largest difference of derivatives, relative to the largest of them, that counts as rounding."""

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
            "brown-conrady": "optisense.design.lenses.brown_conrady:BrownConrady",
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

    def _check_own_kind(self) -> None:
        """Check its coefficients, and its derivatives against difference quotients near the axis.

        Raises:
            LibraryError: a number is not finite, or the derivatives are not those of `distort`.
        """
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

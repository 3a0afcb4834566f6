"""Camera rays: perspective (a pinhole) and equidistant (fisheye), with the lens's distortion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np

from optisense.design.lenses import LensDistortion
from optisense.errors import LibraryError
from optisense.own_code import error_of_own_code
from optisense.registry import place_of_definition

OUT_OF_SIGHT = 1e4
"""Distance (mm) from the camera at which rays start that see nothing, and lead away from it: more
than the size of any sensor."""


class Pose(NamedTuple):
    """The pose and lens of a camera: position (mm), unit axes of the image, field of view across
    the image's width (degrees), and coefficients of the lens's distortion.
    """

    position: mi.Point3f
    right: mi.Vector3f
    up: mi.Vector3f
    forward: mi.Vector3f
    fov: mi.Float
    lens: tuple[mi.Float, ...] = ()

    def numbers(self) -> tuple[mi.Point3f | mi.Vector3f | mi.Float, ...]:
        """Return all variables, one after the other; each has shape (n,) or (3, n)."""
        return (*self[:-1], *self.lens)


@dataclass(frozen=True)
class RayCamera:
    """A camera that generates rays.

    Attributes:
        position: the camera's place, mm.
        direction: the viewing direction.
        up: a direction towards the top of the image; it need not be perpendicular to ``direction``.
        fov: field of view across the image's width, degrees.
        width, height: size of the image, pixels.
        equidistant: whether the lens is an equidistant fisheye instead of a perspective lens.
        distortion: the lens's distortion; None for an ideal lens.
        film: height of the camera's own picture over its width, to which the distortion's centre
            refers; that of the image if None.
    """

    position: tuple[float, float, float]
    direction: tuple[float, float, float]
    up: tuple[float, float, float]
    fov: float
    width: int
    height: int
    equidistant: bool = False
    distortion: LensDistortion | None = None
    film: float | None = None

    def axes(self) -> np.ndarray:
        """Return the unit axes (3, 3) as rows: image right, image up and viewing direction."""
        forward = np.asarray(self.direction, float)
        forward = forward / np.linalg.norm(forward)
        right = np.cross(forward, np.asarray(self.up, float))
        right = right / np.linalg.norm(right)
        return np.stack([right, np.cross(right, forward), forward])

    def pose(self, rays: int = 1) -> Pose:
        """Return the position, axes and field of view as device arrays.

        Args:
            rays: number of entries of each variable. With 1, all rays share it. With one entry per
                ray, derivatives are summed after the backward pass and not within it, where each
                sum would compile the preceding computation once more.
        """

        def number(value: float) -> mi.Float:
            return dr.opaque(mi.Float, float(value), rays)  # opaque: one kernel for all values

        right, up, forward = (mi.Vector3f(*map(number, row)) for row in self.axes())
        lens = () if self.distortion is None else self.distortion.coefficients()
        return Pose(
            mi.Point3f(*map(number, self.position)),
            right,
            up,
            forward,
            number(self.fov),
            tuple(map(number, lens)),
        )

    def rays(
        self, x: mi.Float, y: mi.Float, pose: Pose | None = None
    ) -> tuple[mi.Point3f, mi.Vector3f]:
        """Return the origins (3, n), mm, and unit directions (3, n) of the rays through film
        positions.

        A fisheye shows nothing at positions that would be more than 180 degrees off its axis: their
        rays start `OUT_OF_SIGHT` and escape.

        Args:
            x, y: film positions (n,) in pixels from the top left corner.
            pose: the pose to use, for derivatives with respect to it; the camera's own if None.
        """
        position, right, up, forward, fov, lens = self.pose() if pose is None else pose
        half = fov * float(np.pi / 360)
        # Opaque: one kernel for all sizes. A factor, as Dr.Jit makes of a constant divisor.
        pixel, height = dr.opaque(mi.Float, 1 / self.width), dr.opaque(mi.Float, float(self.height))
        u = 2 * x * pixel - 1
        v = (height - 2 * y) * pixel
        if self.distortion is not None:
            u, v = self._undistorted(self.distortion, u, v, half, lens)
        if self.equidistant:
            radius = dr.sqrt(u * u + v * v)
            angle = radius * half
            scale = dr.select(radius > 1e-6, dr.sin(angle) / dr.maximum(radius, 1e-6), half)
            direction = right * (u * scale) + up * (v * scale) + forward * dr.cos(angle)
        else:
            tangent = dr.tan(half)
            direction = right * (u * tangent) + up * (v * tangent) + forward
        direction = dr.normalize(direction)
        origin = position + dr.zeros(mi.Vector3f, dr.width(direction))
        if self.equidistant:
            origin += dr.select(angle > dr.pi, OUT_OF_SIGHT, 0) * direction
        return origin, direction

    def _undistorted(
        self,
        distortion: LensDistortion,
        u: mi.Float,
        v: mi.Float,
        half: mi.Float,
        lens: tuple[mi.Float, ...],
    ) -> tuple[mi.Float, mi.Float]:
        """Return the film position at which an ideal lens shows what this lens shows at (u, v).

        Newton's method finds it without recording derivatives. One further recorded step does not
        change the result, but carries the derivatives with respect to the field of view and the
        coefficients (the implicit function theorem).
        """
        across, down = distortion.centre
        edge = half if self.equidistant else dr.tan(half)
        x = (u + (1 - 2 * across)) * edge
        shape = dr.opaque(mi.Float, self.film or self.height / self.width)
        y = -(v - (1 - 2 * down) * shape) * edge
        numbers = tuple(dr.detach(each) for each in lens)
        ideal_x, ideal_y = distortion.undistort(dr.detach(x), dr.detach(y), numbers, dr.select)
        a, b, c, d = distortion.jacobian(ideal_x, ideal_y, numbers)
        shown_x, shown_y = distortion.distort(ideal_x, ideal_y, lens)
        off_x, off_y = shown_x - x, shown_y - y
        inverse = 1 / (a * d - b * c)
        ideal_x = ideal_x - (d * off_x - b * off_y) * inverse
        ideal_y = ideal_y - (a * off_y - c * off_x) * inverse
        return ideal_x / edge, -ideal_y / edge


def refuse_numpy(distortion: LensDistortion) -> None:
    """Raise LibraryError if a distortion can't be computed for arrays of the renderer, as if a
    method of its class calls functions of NumPy, which return arrays of NumPy.
    """
    x, y = mi.Float(0.1, 0.2), mi.Float(0.2, 0.1)
    numbers = tuple(map(mi.Float, distortion.coefficients()))
    for method in (distortion.distort, distortion.jacobian):
        where: str | None = place_of_definition(method)
        try:
            if not any(isinstance(each, np.ndarray) for each in method(x, y, numbers)):
                continue
            found = "returns arrays of NumPy"
        except Exception as error:
            own = error_of_own_code(error)
            where = where if own is None else own.where
            found = f"fails with {type(error).__name__}: {error},"
        raise LibraryError(
            f"{method.__name__}() of the {distortion.kinds.noun} '{distortion.kind}' {found} for "
            "arrays of the renderer",
            where=where,
            hint="Use only + - * / on x, y and the coefficients there: functions of NumPy and math "
            "do not work on arrays of the renderer",
        )

"""Camera rays: perspective (a pinhole) and equidistant (fisheye), with the lens's distortion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np

from optisense.design.lenses import LensDistortion


class Pose(NamedTuple):
    """Where a camera is and how it looks: mm, unit axes of the image, degrees across its width, and
    the coefficients of its lens's distortion."""

    position: mi.Point3f
    right: mi.Vector3f
    up: mi.Vector3f
    forward: mi.Vector3f
    fov: mi.Float
    lens: tuple[mi.Float, ...] = ()

    def numbers(self) -> tuple[mi.Point3f | mi.Vector3f | mi.Float, ...]:
        """All of them, one after the other."""
        return (*self[:-1], *self.lens)


@dataclass(frozen=True)
class RayCamera:
    """A camera ready to shoot rays. ``fov`` is in degrees along the image's width.

    position, direction and up as in the design; width and height in pixels.
    """

    position: tuple[float, float, float]
    direction: tuple[float, float, float]
    up: tuple[float, float, float]
    fov: float
    width: int
    height: int
    equidistant: bool = False
    distortion: LensDistortion | None = None

    def axes(self) -> np.ndarray:
        """(3, 3): image right, image up, viewing direction as rows, right-handed as seen from
        the camera.
        """
        forward = np.asarray(self.direction, float)
        forward = forward / np.linalg.norm(forward)
        right = np.cross(forward, np.asarray(self.up, float))
        right = right / np.linalg.norm(right)
        return np.stack([right, np.cross(right, forward), forward])

    def pose(self, rays: int = 1) -> Pose:
        """Place, axes and field of view on the device.

        Args:
            rays: entries of each number. One serves all rays; as many as there are rays have
                derivatives that are summed afterwards, and not amid them, where each sum would
                compile all that leads to it once more.
        """

        def number(value: float) -> mi.Float:
            return dr.opaque(mi.Float, float(value), rays)  # no part of kernels: they serve all

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
        """Rays through film positions in pixels, (0, 0) the top left corner; unit directions.

        Args:
            x, y: pixels.
            pose: the camera's own if None; another one to differentiate by.
        """
        position, right, up, forward, fov, lens = self.pose() if pose is None else pose
        half = fov * float(np.pi / 360)
        u = 2 * x / self.width - 1
        v = (self.height - 2 * y) / self.width
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
        origin = position + dr.zeros(mi.Vector3f, dr.width(direction))
        return origin, dr.normalize(direction)

    def _undistorted(
        self,
        distortion: LensDistortion,
        u: mi.Float,
        v: mi.Float,
        half: mi.Float,
        lens: tuple[mi.Float, ...],
    ) -> tuple[mi.Float, mi.Float]:
        """The film position at which an ideal lens shows what this one shows at (u, v).

        Newton's method finds it without derivatives. One more step, of the functions themselves,
        then has the derivatives by the field of view and by the coefficients (the implicit
        function theorem), and changes nothing else.
        """
        across, down = distortion.centre
        edge = half if self.equidistant else dr.tan(half)
        x = (u + (1 - 2 * across)) * edge
        y = -(v + (1 - 2 * down) * (-self.height / self.width)) * edge
        numbers = tuple(dr.detach(each) for each in lens)
        ideal_x, ideal_y = distortion.undistort(dr.detach(x), dr.detach(y), numbers)
        a, b, c, d = distortion.slopes(ideal_x, ideal_y, numbers)
        shown_x, shown_y = distortion.distort(ideal_x, ideal_y, lens)
        off_x, off_y = shown_x - x, shown_y - y
        inverse = 1 / (a * d - b * c)
        ideal_x = ideal_x - (d * off_x - b * off_y) * inverse
        ideal_y = ideal_y - (a * off_y - c * off_x) * inverse
        return ideal_x / edge, -ideal_y / edge

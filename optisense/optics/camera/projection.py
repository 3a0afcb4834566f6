"""Camera rays: perspective (a pinhole) and equidistant (fisheye)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np


class Pose(NamedTuple):
    """Where a camera is and how it looks: mm, unit axes of the image, degrees across its width."""

    position: mi.Point3f
    right: mi.Vector3f
    up: mi.Vector3f
    forward: mi.Vector3f
    fov: mi.Float


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

    def axes(self) -> np.ndarray:
        """(3, 3): image right, image up, viewing direction as rows, right-handed as seen from
        the camera.
        """
        forward = np.asarray(self.direction, float)
        forward = forward / np.linalg.norm(forward)
        right = np.cross(forward, np.asarray(self.up, float))
        right = right / np.linalg.norm(right)
        return np.stack([right, np.cross(right, forward), forward])

    def pose(self) -> Pose:
        """Place, axes and field of view on the device."""
        right, up, forward = (mi.Vector3f(*map(float, row)) for row in self.axes())
        position = mi.Point3f(*map(float, self.position))
        pose = Pose(position, right, up, forward, mi.Float(self.fov))
        dr.make_opaque(*pose)  # no part of kernels, which serve every camera
        return pose

    def rays(
        self, x: mi.Float, y: mi.Float, pose: Pose | None = None
    ) -> tuple[mi.Point3f, mi.Vector3f]:
        """Rays through film positions in pixels, (0, 0) the top left corner; unit directions.

        Args:
            x, y: pixels.
            pose: the camera's own if None; another one to differentiate by.
        """
        position, right, up, forward, fov = self.pose() if pose is None else pose
        half = fov * float(np.pi / 360)
        u = 2 * x / self.width - 1
        v = (self.height - 2 * y) / self.width
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

"""Camera rays: perspective (a pinhole) and equidistant (fisheye)."""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np


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

    def rays(self, x: mi.Float, y: mi.Float) -> tuple[mi.Point3f, mi.Vector3f]:
        """Rays through film positions in pixels, (0, 0) the top left corner; unit directions."""
        right, up, forward = (mi.Vector3f(*map(float, row)) for row in self.axes())
        half = float(np.radians(self.fov) / 2)
        u = (2 * x / self.width - 1) * 1.0
        v = (self.height - 2 * y) / self.width
        if self.equidistant:
            radius = dr.sqrt(u * u + v * v)
            angle = radius * half
            scale = dr.select(radius > 1e-6, dr.sin(angle) / dr.maximum(radius, 1e-6), half)
            direction = right * (u * scale) + up * (v * scale) + forward * dr.cos(angle)
        else:
            tangent = float(np.tan(half))
            direction = right * (u * tangent) + up * (v * tangent) + forward
        origin = mi.Point3f(*map(float, self.position))
        return origin + dr.zeros(mi.Vector3f, dr.width(direction)), dr.normalize(direction)

"""The camera of a dataset: a ray for each pixel, and the pinhole that comes nearest.

The rays are those inside the gel, where they arrive at the skin: between the skin at rest and a
skin that is pressed in they are straight, so they are right through glass, gel and over mirrors. A
pinhole, which most programs expect, is fitted to them; how far it is off is told beside it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from optisense.design import Camera

if TYPE_CHECKING:
    from optisense.optics import ChiefRays

PRESSED = 1.0
"""mm under the skin at rest at which a pinhole is fitted too, about as deep as gels are pressed."""

MOST_POINTS = 3000
"""Number of pixels that a pinhole is fitted to, spread over the picture; it has 12 parameters."""

WIDEST = 150.0
"""Degrees of view across the picture above which no pinhole is fitted: a flat picture stretches its
edge without bound there."""

FloatArray = NDArray[np.float64]


def ray_arrays(rays: ChiefRays) -> dict[str, NDArray[np.float32]]:
    """The ray of each pixel inside the gel, NaN where the camera sees no skin.

    Args:
        rays: without contacts.

    Returns:
        "points" (h, w, 3) mm, where it meets the skin at rest, and "directions" (h, w, 3), unit,
        the way that light from the skin goes, against which the camera looks; both in the frame of
        the design. What is seen of a pressed skin lies at ``points + s * directions`` with some
        s >= 0 in mm.
    """
    seen = rays.hit[..., None]
    return {
        "points": np.where(seen, rays.points, np.nan).astype(np.float32),
        "directions": np.where(seen, -rays.directions, np.nan).astype(np.float32),
    }


@dataclass(frozen=True)
class Pinhole:
    """A pinhole camera with radial distortion, as OpenCV has it.

    A point X (mm, design's frame) is ``x = rotation @ X + translation`` before the camera, x to the
    right, y down, z forward; with ``a = x[0] / x[2]``, ``b = x[1] / x[2]``, ``r2 = a*a + b*b`` and
    ``f = 1 + radial[0]*r2 + radial[1]*r2*r2`` it is seen in column ``focal[0]*f*a + centre[0]`` and
    row ``focal[1]*f*b + centre[1]``. Columns and rows count from the picture's edge: the middle of
    the first pixel is at 0.5, where OpenCV has 0.

    Attributes:
        rotation: (3, 3). translation: (3,) mm. focal: (2,) pixels. centre: (2,) pixels.
        radial: (2,) k1 and k2.
    """

    rotation: FloatArray
    translation: FloatArray
    focal: FloatArray
    centre: FloatArray
    radial: FloatArray

    @staticmethod
    def of(camera: Camera, resolution: tuple[int, int]) -> Pinhole:
        """The camera of a design, without any refraction before its lens.

        Args:
            camera: its field of view is that across the picture.
            resolution: width and height in pixels.
        """
        right, up, forward = camera.axes()
        rotation = np.array([right, -up, forward])
        width, height = resolution
        focal = 0.5 * width / np.tan(np.radians(0.5 * camera.fov))
        return Pinhole(
            rotation,
            -rotation @ np.array(camera.position, dtype=np.float64),
            np.array([focal, focal]),
            np.array([0.5 * width, 0.5 * height]),
            np.zeros(2),
        )

    def project(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(n, 2) columns and rows of (n, 3) points, and (n,) their distances along the view, mm."""
        seen = points @ self.rotation.T + self.translation
        flat = seen[:, :2] / seen[:, 2:]
        r2 = (flat**2).sum(axis=1, keepdims=True)
        bent = flat * (1.0 + self.radial[0] * r2 + self.radial[1] * r2 * r2)
        return self.focal * bent + self.centre, seen[:, 2]

    def errors(self, points: FloatArray, pixels: FloatArray) -> dict[str, float]:
        """How far it is off in pixels, and in mm at the points: root mean square and at most."""
        seen, along = self.project(points)
        apart = np.linalg.norm(seen - pixels, axis=1)
        real = apart * along / float(self.focal.mean())
        return {
            "rms_pixels": float(np.sqrt((apart**2).mean())),
            "most_pixels": float(apart.max()),
            "rms_mm": float(np.sqrt((real**2).mean())),
            "most_mm": float(real.max()),
        }

    def as_dict(self) -> dict[str, Any]:
        """The numbers, ready for JSON."""
        return {
            "rotation": self.rotation.tolist(),
            "translation_mm": self.translation.tolist(),
            "focal_pixels": self.focal.tolist(),
            "centre_pixels": self.centre.tolist(),
            "radial": self.radial.tolist(),
        }


def fit_pinhole(start: Pinhole, points: FloatArray, pixels: FloatArray) -> Pinhole:
    """The pinhole that sees points in pixels, by least squares of the distances in pixels.

    Args:
        start: near it.
        points: (n, 3) mm, of more than one depth.
        pixels: (n, 2) columns and rows, where they are seen.
    """
    from scipy.optimize import least_squares
    from scipy.spatial.transform import Rotation

    begun = Rotation.from_matrix(start.rotation)
    away = float(np.linalg.norm(points.mean(axis=0) @ start.rotation.T + start.translation))
    focal = float(start.focal.mean())

    def made(x: FloatArray) -> Pinhole:
        return Pinhole(
            (Rotation.from_rotvec(x[:3]) * begun).as_matrix(),
            start.translation + away * x[3:6],
            start.focal * np.exp(x[6:8]),
            start.centre + focal * x[8:10],
            start.radial + x[10:],
        )

    def apart(x: FloatArray) -> FloatArray:
        return np.asarray((made(x).project(points)[0] - pixels).ravel())

    return made(np.asarray(least_squares(apart, np.zeros(12), method="lm").x))


def camera_model(camera: Camera, rays: ChiefRays) -> dict[str, Any]:
    """The pinhole of the design and the fitted one, each with its errors, ready for JSON.

    Args:
        camera: of the design.
        rays: without contacts.

    Returns:
        "as_designed" and "fitted"; None where a pinhole makes no sense: a fisheye, a very wide
        view, or a camera that sees part of the skin from behind, as over mirrors.
    """
    height, width = rays.hit.shape
    pair = _seen(rays)
    nothing: dict[str, Any] = {"as_designed": None, "fitted": None}
    if camera.projection != "perspective" or camera.fov > WIDEST or len(pair[0]) < 2 * LEAST:
        return nothing
    points, pixels = pair
    designed = Pinhole.of(camera, (width, height))
    if (designed.project(points)[1] <= 0.0).any():
        return nothing
    fitted = fit_pinhole(designed, points, pixels)
    return {
        name: each.as_dict() | {"error": each.errors(points, pixels)}
        for name, each in (("as_designed", designed), ("fitted", fitted))
    }


LEAST = 50
"""Number of pixels below which no pinhole is fitted; 12 parameters need many more."""


def _seen(rays: ChiefRays) -> tuple[FloatArray, FloatArray]:
    """(n, 3) points of the skin at rest and `PRESSED` mm along the rays; (n, 2) their pixels."""
    rows, columns = np.nonzero(rays.hit)
    every = max(1, len(rows) // MOST_POINTS)
    rows, columns = rows[::every], columns[::every]
    rest = rays.points[rows, columns].astype(np.float64)
    pressed = rest - PRESSED * rays.directions[rows, columns]
    pixels = np.column_stack([columns + 0.5, rows + 0.5])
    return np.concatenate([rest, pressed]), np.concatenate([pixels, pixels])

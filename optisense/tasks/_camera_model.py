"""The camera of a dataset: a ray for each pixel, and the best-fitting pinhole camera.

The rays are those inside the gel where they arrive at the skin. They are straight between the skin
at rest and a skin that is pressed in, so they are exact through glass and gel and over mirrors. A
pinhole camera, which most programs expect, is fitted to them, and its errors are reported.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import FloatArray
from optisense.design import Camera
from optisense.design.lenses.distortion import BrownConrady

if TYPE_CHECKING:
    from optisense.optics import ChiefRays

PRESSED = 1.0
"""Depth (mm) below the skin at rest of the second layer of points that a pinhole is fitted to,
about as deep as gels are pressed."""

MOST_POINTS = 3000
"""Largest number of pixels that a pinhole is fitted to; it has 12 parameters."""

WIDEST = 150.0
"""Field of view (degrees) across the picture above which no pinhole is fitted, as a flat picture
stretches its edge without bound."""


def ray_arrays(rays: ChiefRays) -> dict[str, NDArray[np.float32]]:
    """Return the ray of each pixel inside the gel, from chief rays without contacts: "points" (h,
    w, 3), mm, where it meets the skin at rest, and "directions" (h, w, 3), unit vectors along which
    light from the skin travels, in the frame of the design; NaN where the camera sees no skin.

    A visible point of a pressed skin lies at ``points + s * directions`` with some s >= 0 in mm.
    """
    seen = rays.hit[..., None]
    return {
        "points": np.where(seen, rays.points, np.nan).astype(np.float32),
        "directions": np.where(seen, -rays.directions, np.nan).astype(np.float32),
    }


@dataclass(frozen=True)
class Pinhole:
    """A pinhole camera with radial and tangential distortion, as in OpenCV.

    A point X (mm, design's frame) has the coordinates ``x = rotation @ X + translation`` in the
    camera's frame, x to the right, y down, z forward. With ``a = x[0] / x[2]``, ``b = x[1] /
    x[2]`` and ``c, d`` their distorted values (`BrownConrady.distort`), it appears in column
    ``focal[0]*c + centre[0]`` and row ``focal[1]*d + centre[1]``. Columns and rows count from the
    picture's edge: the middle of the first pixel is at 0.5, while it is at 0 in OpenCV.

    Attributes:
        rotation: (3, 3) rotation from the design's frame to the camera's.
        translation: (3,) translation, mm.
        focal: (2,) focal lengths, pixels.
        centre: (2,) column and row of the axis, pixels.
        radial: (2,) coefficients k1 and k2.
        further: (3,) coefficients p1, p2 and k3, which are not fitted.
    """

    rotation: FloatArray
    translation: FloatArray
    focal: FloatArray
    centre: FloatArray
    radial: FloatArray
    further: FloatArray = field(default_factory=lambda: np.zeros(3))

    @staticmethod
    def of(camera: Camera, resolution: tuple[int, int]) -> Pinhole:
        """Return the pinhole of a design's camera, without any refraction in front of its lens, in
        a picture of a width and height in pixels. A distortion of another kind than Brown-Conrady
        is left out.
        """
        right, up, forward = camera.axes()
        rotation = np.array([right, -up, forward])
        width, height = resolution
        focal = 0.5 * width / np.tan(np.radians(0.5 * camera.fov))
        lens = camera.distortion
        across, down = (0.5, 0.5) if lens is None else lens.centre
        tall = width * camera.resolution[1] / camera.resolution[0]
        numbers = np.array(lens.coefficients() if isinstance(lens, BrownConrady) else np.zeros(5))
        return Pinhole(
            rotation,
            -rotation @ np.array(camera.position, dtype=np.float64),
            np.array([focal, focal]),
            np.array([across * width, 0.5 * height + (down - 0.5) * tall]),
            numbers[:2],
            numbers[2:],
        )

    def project(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the columns and rows (n, 2) of points (n, 3), mm, and their distances (n,), mm,
        along the viewing direction.
        """
        seen = points @ self.rotation.T + self.translation
        across, down = (seen[:, :2] / seen[:, 2:]).T
        numbers = (*self.radial, *self.further)
        bent = np.stack(BrownConrady.distort(across, down, numbers), axis=1)
        return self.focal * bent + self.centre, seen[:, 2]

    def errors(self, points: FloatArray, pixels: FloatArray) -> dict[str, float]:
        """Return the root-mean-square and largest errors, in pixels and in mm, of points (n, 3),
        mm, that are seen at columns and rows (n, 2).
        """
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
        """Return the parameters, ready for JSON."""
        return {
            "rotation": self.rotation.tolist(),
            "translation_mm": self.translation.tolist(),
            "focal_pixels": self.focal.tolist(),
            "centre_pixels": self.centre.tolist(),
            "radial": self.radial.tolist(),
            "distortion": [*self.radial.tolist(), *self.further.tolist()],
        }


def fit_pinhole(start: Pinhole, points: FloatArray, pixels: FloatArray) -> Pinhole:
    """Fit a pinhole camera to points (n, 3), mm, at more than one depth, and their columns and rows
    (n, 2), by least squares of the distances in pixels.
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
            start.further,
        )

    def apart(x: FloatArray) -> FloatArray:
        return np.asarray((made(x).project(points)[0] - pixels).ravel())

    return made(np.asarray(least_squares(apart, np.zeros(12), method="lm").x))


def camera_model(camera: Camera, rays: ChiefRays) -> dict[str, Any]:
    """Return the pinhole of the design and the fitted one, each with its errors, ready for JSON,
    from chief rays without contacts.

    They are under "as_designed" and "fitted", and a "note" tells of a distortion that OpenCV's
    coefficients can't state. Both are None for a camera that no pinhole describes: a fisheye, a
    very wide view, or one that sees part of the skin from behind, as over mirrors.
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
    lens = camera.distortion
    note = {}
    if lens is not None and not isinstance(lens, BrownConrady):
        note["note"] = (
            f"OpenCV's coefficients can't state a distortion of kind '{lens.kind}': as_designed "
            "leaves it out"
        )
    return note | {
        name: each.as_dict() | {"error": each.errors(points, pixels)}
        for name, each in (("as_designed", designed), ("fitted", fitted))
    }


LEAST = 50
"""Number of pixels below which no pinhole is fitted; 12 parameters need many more."""


def _seen(rays: ChiefRays) -> tuple[FloatArray, FloatArray]:
    """Return points (n, 3) of the skin at rest and at `PRESSED` (mm), and their pixels (n, 2)."""
    rows, columns = np.nonzero(rays.hit)
    every = max(1, len(rows) // MOST_POINTS)
    rows, columns = rows[::every], columns[::every]
    rest = rays.points[rows, columns].astype(np.float64)
    pressed = rest - PRESSED * rays.directions[rows, columns]
    pixels = np.column_stack([columns + 0.5, rows + 0.5])
    return np.concatenate([rest, pressed]), np.concatenate([pixels, pixels])

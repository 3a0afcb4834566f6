"""The apparent distance of the skin from the camera, after all reflections and refractions.

A lens sees a point from its whole pupil. From a place beside the pupil's centre the point appears
in another direction, and the nearer the point, the larger the change. The change is measured with
five rays per place of the picture: the chief ray, one from a pupil shifted along each of its two
axes, and two in slightly different directions. From their intersections with the skin follows the
change of direction with the pupil that keeps the same point in sight. The rays are refracted and
reflected as usual. The change is a matrix, whose eigenvalues are the two principal vergences. In
air both are one over the distance.
"""

from __future__ import annotations

from collections.abc import Callable

import drjit as dr
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from optisense.array_types import FloatArray
from optisense.design.camera import Camera
from optisense.design.responses import PictureChain
from optisense.optics.backend.arrays import floats
from optisense.optics.camera.projection import RayCamera
from optisense.optics.scene.ray_scene import RayScene
from optisense.optics.transport.chief_rays import trace_to_skin

PUPIL_SHIFT = 0.02
"""Shift of the pupil (mm): small against all distances of a sensor (some mm and more), and large
against the rounding of points in single precision (some 1e-6 mm)."""

FILM_SHIFT = 0.1
"""Distance on the film (pixels) by which rays are turned: small against a pixel, and, with 64
pixels over 60 degrees, 0.1 degrees, large against the rounding of directions (1e-5 degrees)."""

LARGEST = 10.0
"""Upper bound on the vergence (1/mm), that of a distance of a tenth of a millimetre, at which no
sensor has its skin. Larger values come from rays of nearly the same end point."""

FOCUS_ACROSS = 64
"""Number of places across the picture at which the apparent distance is computed: each stands for
five pixels of a picture 320 pixels wide, over which the blur of depth of field hardly varies."""


def focused_chain(
    camera: Camera,
    scene: Callable[[], RayScene],
    rays: Callable[[tuple[int, int]], RayCamera],
) -> PictureChain:
    """Return the picture chain of a design's camera, with the blur of its depth of field, if it has
    one.

    Args:
        scene: function that returns the surfaces; called only if the blur depends on depth.
        rays: function that returns the ray camera of a resolution.
    """
    if camera.blur is None or not camera.blur.by_depth:
        return camera.picture_chain()
    width, height = camera.resolution
    size = FOCUS_ACROSS, max(2, round(FOCUS_ACROSS * height / width))
    return camera.picture_chain(apparent_vergences(scene(), rays(size)))


def apparent_vergences(scene: RayScene, camera: RayCamera) -> FloatArray:
    """Return the principal vergences of the skin, for the middle of each pixel.

    A curved mirror or an oblique face shows a point at two distances, one in each principal plane
    of the pencil of rays (astigmatism). A principal vergence is one over such a distance; it is
    negative if the rays from the point converge towards the pupil.

    Distances are measured along the axis for perspective lenses, whose field of focus is flat, and
    along the ray for fisheyes. Pixels that do not see the skin, or see it over an edge, where the
    rays of a pixel meet different surfaces, get the values of the nearest one that does.

    Args:
        camera: the camera whose pixels are evaluated.

    Returns:
        The smaller and the larger vergence (h, w, 2), 1/mm; 0 everywhere if no pixel sees the skin.
    """
    height, width = camera.height, camera.width
    index = np.arange(height * width)
    x, y = index % width + 0.5, index // width + 0.5
    origin, direction = _rays(camera, x, y)
    turned = [_rays(camera, x + FILM_SHIFT, y)[1], _rays(camera, x, y + FILM_SHIFT)[1]]
    right, up, forward = camera.axes()
    path, points = trace_to_skin(scene, origin, direction)
    seen = path != 0
    by_film, by_pupil = [], []
    for way in turned:
        other, moved = trace_to_skin(scene, origin, way)
        seen &= other == path
        by_film.append((moved - points) / FILM_SHIFT)
    for shift in (right, up):
        other, moved = trace_to_skin(scene, origin + PUPIL_SHIFT * shift, direction)
        seen &= other == path
        by_pupil.append((moved - points) / PUPIL_SHIFT)
    turning = np.stack([(way - direction) / FILM_SHIFT for way in turned], axis=-1)
    across = (
        np.stack([right, up], axis=-1)
        - direction[:, :, None] * np.stack([direction @ right, direction @ up], axis=-1)[:, None, :]
    )
    with np.errstate(all="ignore"):
        needed = _solved(np.stack(by_film, axis=-1), np.stack(by_pupil, axis=-1))
        in_air = _solved(turning, across)  # at a distance of 1 mm
        ratio = needed @ np.linalg.inv(_safe(in_air))
        vergences = _eigenvalues(ratio)
        if not camera.equidistant:
            vergences = vergences / (direction @ forward)[:, None]
        good = seen & (np.abs(vergences) < LARGEST).all(axis=1)
    return _filled(vergences.reshape(height, width, 2), good.reshape(height, width))


def _rays(
    camera: RayCamera, x: NDArray[np.floating], y: NDArray[np.floating]
) -> tuple[FloatArray, FloatArray]:
    """Return origins (k, 3), mm, and directions (k, 3) of rays in double precision."""
    origin, direction = camera.rays(floats(x), floats(y))
    dr.eval(origin, direction)
    unit = np.asarray(direction, dtype=np.float64).T
    return np.asarray(origin, dtype=np.float64).T, unit / np.linalg.norm(unit, axis=1)[:, None]


def _solved(matrix: FloatArray, right: FloatArray) -> FloatArray:
    """Return the least-squares solutions x (k, 2, 2) of matrix (k, 3, 2) x = right (k, 3, 2)."""
    turned = np.swapaxes(matrix, 1, 2)
    return np.linalg.inv(_safe(turned @ matrix)) @ turned @ right


def _eigenvalues(matrix: FloatArray) -> FloatArray:
    """Return the eigenvalues (k, 2), ascending, of matrices (k, 2, 2) whose eigenvalues are real.

    Rounding can turn two equal eigenvalues into a complex pair, which counts as its real part.
    """
    mean = 0.5 * np.trace(matrix, axis1=1, axis2=2)
    split = np.sqrt(np.maximum(mean**2 - np.linalg.det(matrix), 0.0))
    return np.stack([mean - split, mean + split], axis=1)


def _safe(matrix: FloatArray) -> FloatArray:
    """Return matrices (k, 2, 2) with NaN in place of those that cannot be inverted."""
    single = np.abs(np.linalg.det(matrix)) < 1e-30
    return np.where(single[:, None, None], np.nan, matrix)


def _filled(values: FloatArray, good: NDArray[np.bool_]) -> FloatArray:
    """Return values (h, w, 2), each that of the nearest good pixel (h, w)."""
    if not good.any():
        return np.zeros_like(values)
    nearest = distance_transform_edt(~good, return_distances=False, return_indices=True)
    return np.asarray(values[tuple(nearest)])

"""The paths of chief rays from the camera to their ends, for drawing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from optisense.geometry import Contact
from optisense.optics.scene.ray_scene import Ray
from optisense.optics.transport.chief_rays import trace_chief_rays
from optisense.optics.transport.interact import RayKind, interact

if TYPE_CHECKING:
    from optisense.optics._model import OpticalModel

ESCAPE_LENGTH = 5.0
"""Length (mm) of the last segment of a ray that escapes, in a drawing: enough to show its direction
beside a sensor of some 20 mm."""


@dataclass(frozen=True)
class RayPaths:
    """The polylines of rays, one after the other.

    Attributes:
        vertices: (n, 3) float32, the vertices of all polylines, mm.
        counts: (rays,) int32, the number of vertices of each polyline, at least two.
        outcomes: (rays,) uint8, the `RayOutcome` of each ray.
    """

    vertices: NDArray[np.float32]
    counts: NDArray[np.int32]
    outcomes: NDArray[np.uint8]


def trace_paths(
    model: OpticalModel, resolution: tuple[int, int], contacts: Sequence[Contact] = ()
) -> RayPaths:
    """Trace the path of the ray through the middle of each pixel, row by row.

    The rays are traced once more for their outcomes, as chief rays are, which takes some
    milliseconds for the few hundred rays of a drawing.

    Args:
        resolution: (width, height) of the grid of pixels.

    Raises:
        ContactError: a contact is off the surface or deeper than the gel.
        RenderError: the resolution is invalid.
    """
    camera = model.camera(resolution)
    scene = model.scenes.fine.scene
    if contacts:
        placed = [model.place(contact) for contact in contacts]
        scene = model.scenes.with_indenters(placed)
    index = dr.arange(mi.UInt32, camera.width * camera.height)
    origin, direction = camera.rays(
        mi.Float(index % camera.width) + 0.5, mi.Float(index // camera.width) + 0.5
    )
    count = camera.width * camera.height
    points = [np.broadcast_to(_rows(origin), (count, 3))]
    lengths = np.ones(count, dtype=np.int32)
    ray = Ray(origin, direction, dr.full(mi.Bool, True, count))
    while (going := np.asarray(ray.active).astype(bool)).any():
        step = interact(scene, ray, RayKind.CHIEF)
        end = dr.select(step.hit.valid, step.hit.point, ray.origin + ESCAPE_LENGTH * ray.direction)
        dr.eval(step, end)
        points.append(_rows(end))
        lengths[going] += 1
        ray = step.ray
    every = np.stack(points, axis=1)
    chosen = np.arange(every.shape[1])[None, :] < lengths[:, None]
    outcomes = trace_chief_rays(scene, camera).outcome.ravel()
    return RayPaths(every[chosen].astype(np.float32), lengths, outcomes)


def _rows(values: object) -> NDArray[np.float32]:
    """Return the array (n, 3) of a Dr.Jit vector."""
    return np.asarray(values, dtype=np.float32).T.reshape(-1, 3)

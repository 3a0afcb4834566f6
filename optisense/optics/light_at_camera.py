"""The power that reaches the camera: the light that its lens gathers from the scene."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from optisense.design.lenses.defocus import Defocus
from optisense.optics.camera.projection import RayCamera
from optisense.quality import PICTURE_PHOTONS

if TYPE_CHECKING:
    from optisense.optics.model import OpticalModel

WIDTH = 96
"""Pixels: width of the picture that is summed up. Radiance varies over more than one of them."""


@dataclass(frozen=True)
class CameraLight:
    """Light at the camera's place, nothing pressed in.

    Attributes:
        irradiance: mW/mm^2 of each light group on the plane of the lens, from all that the picture
            shows.
        pupil: mm^2 of the lens's opening; None where the design does not give its lens.
    """

    irradiance: dict[str, float]
    pupil: float | None

    def power(self, group: str) -> float | None:
        """The mW of a group that the lens lets in; None where the design does not give its lens."""
        return None if self.pupil is None else self.irradiance[group] * self.pupil

    def as_text(self) -> dict[str, dict[str, str]]:
        """Numbers of each group as text, under a title with their unit."""
        rows = {
            "at the lens (µW/mm²)": {
                group: f"{1000 * value:.3g}" for group, value in self.irradiance.items()
            }
        }
        if self.pupil is not None:
            rows["into the lens (µW)"] = {
                group: f"{1000 * value * self.pupil:.3g}"
                for group, value in self.irradiance.items()
            }
        return rows

    def as_data(self) -> dict[str, Any]:
        """The values as plain numbers and names, to be written as JSON."""
        return {
            "units": {"irradiance": "mW/mm^2", "area": "mm^2", "power": "mW"},
            "irradiance": self.irradiance,
            "pupil": self.pupil,
            "power": {group: self.power(group) for group in self.irradiance},
        }


def camera_light(model: OpticalModel, photons: int = PICTURE_PHOTONS, seed: int = 0) -> CameraLight:
    """Sum up the light of a picture, as it reaches the lens.

    The irradiance of the lens is the sum of radiance times projected solid angle over the pixels.
    The pupil of a lens follows from its blur by defocus, as focal length over f-number.

    Args:
        model: the sensor.
        photons: to trace.
        seed: another one gives other photons.
    """
    width, height = model.design.camera.resolution
    resolution = (WIDTH, max(1, round(WIDTH * height / width)))
    image = model.render((), resolution, photons, seed=seed)
    camera = model.camera(resolution)
    angle = projected_solid_angles(camera)
    blur = model.design.camera.blur
    pupil = None
    if isinstance(blur, Defocus):
        pupil = float(np.pi / 4 * (blur.focal_length / blur.f_number) ** 2)
    totals = {
        name: float((layer.astype(np.float64) * angle[..., None]).sum())
        for name, layer in image.layers.items()
    }
    return CameraLight(totals, pupil)


def projected_solid_angles(camera: RayCamera) -> NDArray[np.float64]:
    """(h, w) solid angles of pixels times the cosine with the camera's axis, in steradians.

    They are the areas of the pixels on the plane of direction cosines.
    """
    rows, columns = np.indices((camera.height + 1, camera.width + 1), dtype=np.float32)
    _, ways = camera.rays(mi.Float(columns.ravel()), mi.Float(rows.ravel()))
    right, up, _ = camera.axes()
    direction = np.array(ways, dtype=np.float64).T.reshape(*rows.shape, 3)
    corners = np.stack([direction @ right, direction @ up], axis=-1)
    one = corners[1:, 1:] - corners[:-1, :-1]
    other = corners[1:, :-1] - corners[:-1, 1:]
    return np.asarray(np.abs(one[..., 0] * other[..., 1] - one[..., 1] * other[..., 0]) / 2)

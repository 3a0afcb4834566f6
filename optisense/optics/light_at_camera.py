"""The power that reaches the camera: the light that its lens gathers from the scene."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from optisense.design.lenses.blur import Defocus
from optisense.design.sensor_design import refuse_design
from optisense.optics.backend.arrays import floats
from optisense.optics.camera.projection import RayCamera
from optisense.quality import PICTURE_PHOTONS

if TYPE_CHECKING:
    from optisense.optics._model import OpticalModel

WIDTH = 96
"""Width (pixels) of the picture that is summed up. The sum does not depend on the size of pixels;
few are enough as radiance varies over more than one of them."""


@dataclass(frozen=True)
class CameraLight:
    """The light that reaches the camera in the untouched sensor.

    Attributes:
        irradiance: irradiance (mW/mm^2) by each light group on the plane of the lens, from the
            field of view of the picture.
        pupil: area (mm^2) of the lens's entrance pupil; None if the design does not specify it.
    """

    irradiance: dict[str, float]
    pupil: float | None

    def power(self, group: str) -> float | None:
        """Return the power (mW) of a group that enters the lens; None if its pupil is unknown."""
        return None if self.pupil is None else self.irradiance[group] * self.pupil

    def as_text(self) -> dict[str, dict[str, str]]:
        """Return the values of each group as text, by a title with the unit."""
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
        """Return the values as plain numbers and names, ready for JSON."""
        return {
            "units": {"irradiance": "mW/mm^2", "area": "mm^2", "power": "mW"},
            "irradiance": self.irradiance,
            "pupil": self.pupil,
            "power": {group: self.power(group) for group in self.irradiance},
        }


def camera_light(
    model: OpticalModel, photons: int | str = PICTURE_PHOTONS, seed: int = 0
) -> CameraLight:
    """Compute the irradiance of the lens from a rendered picture.

    The irradiance of the lens is the sum of radiance times projected solid angle over the pixels.
    The diameter of the pupil is the focal length over the f-number of the lens's depth of field.

    Args:
        model: the sensor.
        photons: number of photons to trace, or a level of `optisense.quality`.
        seed: seed of the photons.

    Raises:
        DesignError: there is a design instead of a model.
        RenderError: there is no such level.
    """
    refuse_design(model)
    resolution = model.design.camera.size_at(WIDTH)
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
    """Return the solid angle (h, w), sr, of each pixel times the cosine with the camera's axis.

    It is the area of the pixel on the plane of direction cosines.
    """
    rows, columns = np.indices((camera.height + 1, camera.width + 1), dtype=np.float32)
    _, ways = camera.rays(floats(columns), floats(rows))
    right, up, _ = camera.axes()
    direction = np.array(ways, dtype=np.float64).T.reshape(*rows.shape, 3)
    corners = np.stack([direction @ right, direction @ up], axis=-1)
    one = corners[1:, 1:] - corners[:-1, :-1]
    other = corners[1:, :-1] - corners[:-1, 1:]
    return np.asarray(np.abs(one[..., 0] * other[..., 1] - one[..., 1] * other[..., 0]) / 2)

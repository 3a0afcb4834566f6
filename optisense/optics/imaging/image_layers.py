"""The layers of an image, one for each light group, with the ground truth of each pixel."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from optisense.optics.scene.surfaces import Region
from optisense.optics.transport.chief_rays import ChiefRays

if TYPE_CHECKING:
    from optisense.optics.imaging.sppm import SppmResult


@dataclass
class ImageLayers:
    """The layers of an image for lights of 1 mW in each channel, and its ground truth.

    Attributes:
        radiance: (groups, h, w, 3) radiance by light group, mW/(mm^2 sr).
        normals: (h, w, 3) unit normals; NaN where the camera sees no coating.
        points: (h, w, 3) points of the coating, mm; NaN where the camera sees none.
        contact_mask: (h, w) mask of the pixels that see an indenter.
        photons: number of emitted photons.
        noise: relative RMS noise of the light; infinite if it is not known.
        worst_noise: relative RMS noise that the noisiest 5 % of the area have at least; None if it
            is not known.
        samples: numbers of camera samples per pixel far from, around and in contacts.
        interrupted: whether Ctrl-C ended the photon tracing early.
        light_seconds: time (s) of the photon tracing.
        image_seconds: time (s) of the shading.
    """

    radiance: NDArray[np.float32]
    normals: NDArray[np.float32]
    points: NDArray[np.float32]
    contact_mask: NDArray[np.bool_]
    photons: int
    noise: float
    worst_noise: float | None
    samples: list[int]
    interrupted: bool
    light_seconds: float
    image_seconds: float

    @classmethod
    def from_sppm(cls, result: SppmResult, rays: ChiefRays, began: float) -> ImageLayers:
        """Return the layers of progressive photon mapping, with ground truth from chief rays."""
        hit = rays.hit
        difference = result.halves[0] - result.halves[1]
        mean = float(result.layers.mean())
        noise = float(np.sqrt((difference**2).mean()) / 2 / mean) if mean > 0 else 0.0
        return cls(
            radiance=result.layers,
            normals=masked(rays.normals, hit),
            points=masked(rays.points, hit),
            contact_mask=hit & (rays.region == Region.INDENTER),
            photons=result.photons,
            noise=noise if result.passes > 1 else float("inf"),
            worst_noise=None,
            samples=[result.passes, result.passes],
            interrupted=False,
            light_seconds=0.0,
            image_seconds=time.perf_counter() - began,
        )


def masked(values: NDArray[np.float32], where: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Return values (h, w, 3) with NaN outside a mask."""
    return np.where(where[..., None], values, np.nan).astype(np.float32)

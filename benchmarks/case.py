"""The scene of the benchmarks: GelSight Mini with one ball."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

import optisense
from optisense.mechanics import CONFORMING
from optisense.optics import OpticalModel

FloatArray = NDArray[np.float32]

DESIGN = "gelsight-mini-ideal"
RADIUS, DEPTH = 1.5, 0.8
"""Radius and depth (mm) of the ball in the OptiSense paper."""
RESOLUTION = (320, 240)
"""Width and height (pixels) of the images, as in the OptiSense paper."""
PHOTONS = 560_000
"""Number of photons of an image, about the smallest for an error of 3 % in the contact."""
CONTACT_TEXT = f"sphere:{RADIUS}@0,0:{DEPTH}"


def ball(u: float = 0.0, v: float = 0.0) -> optisense.Contact:
    """Return the contact of the ball at surface coordinates (mm)."""
    return optisense.Contact(optisense.Sphere(radius=RADIUS), at=(u, v), depth=DEPTH)


@dataclass(frozen=True)
class Case:
    """The model, and the pixels in which its camera sees the ball."""

    model: OpticalModel

    @classmethod
    def load(cls, variant: str = "auto") -> Case:
        """Return the case with a new model."""
        return cls(OpticalModel(optisense.load(DESIGN), variant))

    @cached_property
    def mask(self) -> NDArray[np.bool_]:
        """Mask (h, w) of the pixels whose centre sees the ball."""
        return self.model.chief_rays(RESOLUTION, [ball()], CONFORMING).contact_mask


def relative_error(
    image: FloatArray, truth: FloatArray, mask: NDArray[np.bool_], truth_noise: float = 0.0
) -> float:
    """Return the RMS difference of radiances (h, w, 3), divided by the mean of the reference.

    Args:
        truth_noise: the reference's own error in the same measure, which is subtracted in
            quadrature; the result is 0 where it is larger than the difference.
    """
    difference = image[mask].astype(np.float64) - truth[mask]
    square = (difference**2).mean() / truth[mask].astype(np.float64).mean() ** 2
    return float(np.sqrt(max(square - truth_noise**2, 0.0)))

"""Pictures of a model for the background and presses of photographs."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from optisense.array_types import FloatArray
from optisense.calibration._covered_view import with_smooth_outline
from optisense.calibration._layered_pictures import layered_pictures
from optisense.calibration.photographs import Photographs
from optisense.calibration.seen_contacts import SeenContact, check_shape
from optisense.errors import CalibrationError
from optisense.geometry import Contact
from optisense.kept_arrays import NOTHING_KEPT, KeptArrays

if TYPE_CHECKING:
    from optisense.design.responses import PictureChain
    from optisense.optics import OpticalModel

WIDEST_RANGE = 4.0
"""Largest factor from the first guess at which exposures are searched; the guess is far closer."""


@dataclass(frozen=True)
class ModelPictures:
    """Pictures of a model for the photographed background and presses.

    Attributes:
        exposure: factor on its radiance that brings it closest to the photographed background.
        background: levels (h, w, 3), 0 to 255.
        presses: levels of each press, (h, w, 3).
        contacts: contacts that were pressed in.
    """

    exposure: float
    background: FloatArray = field(repr=False)
    presses: tuple[FloatArray, ...] = field(repr=False)
    contacts: tuple[Contact, ...]


def model_pictures(
    model: OpticalModel,
    photographs: Photographs,
    seen: Sequence[SeenContact],
    *,
    photons: int,
    seed: int = 0,
    exposure: float | None = None,
    kept: KeptArrays = NOTHING_KEPT,
    progress: Callable[[int], None] = lambda done: None,
) -> ModelPictures:
    """Render the background and the presses of photographs, with an exposure that brings the
    background closest if it is None.

    Photographs of another shape than the model's pictures, and contacts that are not on its skin,
    raise CalibrationError. `progress` is called with the number of finished pictures.
    """
    check_shape(photographs, model)
    layers = layered_pictures(model, photographs, seen, photons, seed, kept=kept, progress=progress)
    background, *presses = (each.sum(axis=0) for each in layers.pictures)
    if exposure is None:
        exposure = matched_exposure(background, layers.chain, photographs.background)
    pictures = [levels_of(each, layers.chain, exposure) for each in (background, *presses)]
    if layers.coverage is not None:
        pictures = list(with_smooth_outline(np.stack(pictures), layers.coverage))
    return ModelPictures(exposure, pictures[0], tuple(pictures[1:]), layers.contacts)


def levels_of(radiance: NDArray[np.floating], chain: PictureChain, exposure: float) -> FloatArray:
    """Return the unrounded levels (h, w, 3), to 255, of radiance (h, w, 3), mW/(mm^2 sr)."""
    return 255.0 * np.asarray(chain.curve(chain.respond(exposure * radiance)), dtype=np.float64)


def matched_exposure(
    radiance: NDArray[np.floating], chain: PictureChain, photograph: NDArray[np.uint8]
) -> float:
    """Return the factor on radiance (h, w, 3), mW/(mm^2 sr), whose picture is closest to a
    photograph (h, w, 3), by least squares; CalibrationError is raised if the radiance is 0
    everywhere.
    """
    if not radiance.max() > 0.0:
        raise CalibrationError(
            "the model's picture is black", hint="Check the design with optisense check"
        )
    wanted = photograph.astype(np.float64)
    start = chain.auto_exposure(radiance)

    def error(log: float) -> float:
        shown = levels_of(radiance, chain, start * math.exp(log))
        return float(((shown - wanted) ** 2).mean())

    reach = math.log(WIDEST_RANGE)
    found = minimize_scalar(error, bounds=(-reach, reach), method="bounded")
    return float(start * math.exp(float(found.x)))

"""Pictures of a model for the background and presses of photographs: their layers, the derivatives
of these by the fitted numbers, and their levels.

Light adds up: a layer for each light group is rendered once, and mixed for any powers. For small
changes of numbers that need a new rendering, the layers change linearly: by difference quotients
for numbers of the design, and in closed form for the position and radius of a contact. If a contact
of one ball is slightly wider, its response is the same, stretched and stronger in proportion: the
slope of a ball's surface grows with the distance from its middle.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from optisense.array_types import FloatArray
from optisense.calibration._covered_view import CoveredView, with_smooth_outline
from optisense.calibration.photographs import Photographs
from optisense.calibration.seen_contacts import SeenContact, check_shape, contact_of
from optisense.design.difference import fingerprint
from optisense.errors import CalibrationError
from optisense.geometry import Contact
from optisense.kept_arrays import NOTHING_KEPT, KeptArrays
from optisense.mechanics import ELASTIC

if TYPE_CHECKING:
    from optisense.design.responses import PictureChain
    from optisense.optics import OpticalModel

WIDEST_RANGE = 4.0
"""Largest factor from the first guess at which exposures are searched; the guess is far closer."""

Radiance = NDArray[np.float32]


@dataclass(frozen=True)
class LayeredPictures:
    """Layers of the background and of each press.

    Attributes:
        groups: names of the light groups.
        pictures: radiance (groups, h, w, 3) of the background and of each press.
        chain: picture chain of the model's camera, without noise.
        contacts: contacts that were pressed in.
        coverage: share (h, w) of each pixel that sees skin, if the photographs are averages of the
            levels of smaller pixels; else None.
    """

    groups: tuple[str, ...]
    pictures: tuple[Radiance, ...] = field(repr=False)
    chain: PictureChain
    contacts: tuple[Contact, ...]
    coverage: FloatArray | None = field(default=None, repr=False)

    @property
    def background(self) -> Radiance:
        """Radiance (groups, h, w, 3) with nothing pressed in."""
        return self.pictures[0]

    def plus(self, changes: Sequence[Radiance]) -> LayeredPictures:
        """Return the layers with a change (groups, h, w, 3) of each picture."""
        pairs = zip(self.pictures, changes, strict=True)
        return replace(self, pictures=tuple(one + change for one, change in pairs))


@dataclass(frozen=True)
class PictureSlopes:
    """Derivatives of layered pictures by a number, per plausible range.

    Attributes:
        layers: derivatives (groups, h, w, 3) of the background and of each press.
        coverage: derivative (h, w) of the coverage; None if it does not change.
        noise: sample of the noise of `layers`, in the same form; empty if they have none.
    """

    layers: Sequence[Radiance] = field(repr=False)
    coverage: FloatArray | None = field(default=None, repr=False)
    noise: Sequence[Radiance] = field(default=(), repr=False)

    @staticmethod
    def of_two(one: Sequence[Radiance], other: Sequence[Radiance]) -> PictureSlopes:
        """Return the mean of derivatives from two renderings with independent noise."""
        half = np.float32(0.5)
        pairs = list(zip(one, other, strict=True))
        return PictureSlopes(
            [half * (a + b) for a, b in pairs], noise=[half * (a - b) for a, b in pairs]
        )

    def half(self) -> PictureSlopes:
        """Return those of the first of the two renderings; these, if they have no noise."""
        if not self.noise:
            return self
        return PictureSlopes([a + b for a, b in zip(self.layers, self.noise, strict=True)])


def layered_pictures(
    model: OpticalModel,
    photographs: Photographs,
    seen: Sequence[SeenContact],
    photons: int,
    seed: int,
    contacts: Sequence[Contact] | None = None,
    kept: KeptArrays = NOTHING_KEPT,
    progress: Callable[[int], None] = lambda done: None,
) -> LayeredPictures:
    """Render the background and the presses of photographs as layers, at their size.

    Contacts that are known already are pressed in again. `kept` stores the layers of each picture,
    and `progress` is called with the number of finished pictures. A contact that is not on the skin
    raises CalibrationError.
    """
    view = CoveredView.of(model, photographs.size)
    if contacts is None:
        contacts = [
            contact_of(press, place, model, view.rays)
            for press, place in zip(photographs.presses, seen, strict=True)
        ]
    pictures: list[Radiance] = []
    for number, pressed in enumerate([(), *((contact,) for contact in contacts)]):
        progress(number)
        layers = kept.arrays(
            [fingerprint(model.design), *pressed, photographs.size, photons, seed],
            partial(_rendered, model, pressed, photographs.size, photons, seed),
            list(model.design.lights),
        )
        pictures.append(with_smooth_outline(np.stack(list(layers.values())), view.coverage))
    return LayeredPictures(
        tuple(model.design.lights), tuple(pictures), model.picture_chain.without_noise(),
        tuple(contacts),
        view.coverage if photographs.scale < 1.0 else None,
    )  # fmt: skip


def _rendered(
    model: OpticalModel,
    pressed: Sequence[Contact],
    size: tuple[int, int],
    photons: int,
    seed: int,
) -> dict[str, Radiance]:
    image = model.render(pressed, resolution=size, photons=photons, seed=seed, skin=ELASTIC)
    return {name: np.asarray(layer, dtype=np.float32) for name, layer in image.layers.items()}


def averaged(
    one: LayeredPictures, other: LayeredPictures
) -> tuple[LayeredPictures, LayeredPictures]:
    """Return the mean of two renderings with independent noise, and half of their difference, which
    is a sample of the noise of the mean.
    """
    half = np.float32(0.5)
    pairs = list(zip(one.pictures, other.pictures, strict=True))
    mean = replace(one, pictures=tuple(half * (a + b) for a, b in pairs))
    return mean, replace(one, pictures=tuple(half * (a - b) for a, b in pairs))


def contact_slopes(layers: LayeredPictures, index: int, seen: SeenContact) -> Radiance:
    """Return the derivatives of a press by its column and row, in pixels, and by the logarithm of
    its radius, (3, groups, h, w, 3).
    """
    response = layers.pictures[index + 1] - layers.background
    down, across = np.gradient(response, axis=(1, 2))
    rows, columns = np.mgrid[: response.shape[1], : response.shape[2]] + 0.5
    x = (columns - seen.centre[0]).astype(np.float32)[..., None]
    y = (rows - seen.centre[1]).astype(np.float32)[..., None]
    wider = response - x * across - y * down
    return np.stack([-across, -down, wider]).astype(np.float32)


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

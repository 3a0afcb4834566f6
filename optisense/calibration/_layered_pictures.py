"""Pictures of photographed presses as layers, and their derivatives by the fitted numbers.

Light adds up: a layer for each light group is rendered once, and mixed for any powers. For small
changes of numbers that need a new rendering, the layers change linearly: by difference quotients
for numbers of the design, and in closed form for the position and radius of a contact. If a contact
of one ball is slightly wider, its response is the same, stretched and stronger in proportion: the
slope of a ball's surface grows with the distance from its middle.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from optisense.calibration._covered_view import CoveredView, with_smooth_outline
from optisense.calibration.photographs import Photographs
from optisense.calibration.seen_contacts import SeenContact, contact_of
from optisense.design.difference import fingerprint
from optisense.kept_arrays import NOTHING_KEPT, KeptArrays
from optisense.mechanics import ELASTIC

if TYPE_CHECKING:
    from optisense.design.responses import PictureChain
    from optisense.geometry import Contact
    from optisense.optics import OpticalModel

FloatArray = NDArray[np.float32]


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
    pictures: tuple[FloatArray, ...] = field(repr=False)
    chain: PictureChain
    contacts: tuple[Contact, ...]
    coverage: NDArray[np.float64] | None = field(default=None, repr=False)

    @property
    def background(self) -> FloatArray:
        """Radiance (groups, h, w, 3) with nothing pressed in."""
        return self.pictures[0]

    def plus(self, changes: Sequence[FloatArray]) -> LayeredPictures:
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

    layers: Sequence[FloatArray] = field(repr=False)
    coverage: NDArray[np.float64] | None = field(default=None, repr=False)
    noise: Sequence[FloatArray] = field(default=(), repr=False)

    @staticmethod
    def of_two(one: Sequence[FloatArray], other: Sequence[FloatArray]) -> PictureSlopes:
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
    pictures: list[FloatArray] = []
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
) -> dict[str, FloatArray]:
    image = model.render(
        pressed, resolution=size, photons=photons, seed=seed, partial=False, skin=ELASTIC
    )
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


def contact_slopes(layers: LayeredPictures, index: int, seen: SeenContact) -> FloatArray:
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

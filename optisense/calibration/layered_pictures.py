"""Pictures of photographed presses as layers, and how the layers change with what is fitted.

Light adds up: a layer for each light group is rendered once, and mixed for any powers. For small
changes of what needs a new rendering, the layers change in proportion: by difference quotients for
numbers of the design, and in closed form for the place and radius of a contact. If a contact of one
ball is a little wider, its response is the same, stretched and stronger in proportion: the slope of
a ball's surface grows with the distance from its middle.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from optisense.calibration.model_pictures import SeenContact, contact_of
from optisense.calibration.photographs import Photographs
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
        background: (groups, h, w, 3) radiance.
        presses: the same of each press.
        chain: of the model's camera, without noise.
        contacts: what was pressed in.
    """

    groups: tuple[str, ...]
    background: FloatArray = field(repr=False)
    presses: tuple[FloatArray, ...] = field(repr=False)
    chain: PictureChain
    contacts: tuple[Contact, ...]


def layered_pictures(
    model: OpticalModel,
    photographs: Photographs,
    seen: Sequence[SeenContact],
    photons: int,
    seed: int,
    contacts: Sequence[Contact] | None = None,
) -> LayeredPictures:
    """Render the background and the presses of photographs as layers.

    Args:
        model: of the sensor.
        photographs: whose size and presses are taken.
        seen: where each of them shows its contact.
        photons: of the light.
        seed: of the light.
        contacts: what presses, where that is known already.

    Raises:
        CalibrationError: a contact is not on the skin.
        OptiSenseError: the model can't be rendered.
    """
    if contacts is None:
        rays = model.chief_rays(photographs.size)
        contacts = [
            contact_of(press, place, model, rays)
            for press, place in zip(photographs.presses, seen, strict=True)
        ]
    pictures = []
    for pressed in [(), *((contact,) for contact in contacts)]:
        image = model.render(
            pressed,
            resolution=photographs.size,
            photons=photons,
            seed=seed,
            partial=False,
            skin=ELASTIC,
        )
        pictures.append(np.stack(list(image.layers.values())))
    return LayeredPictures(
        tuple(image.layers), pictures[0], tuple(pictures[1:]), image.chain.without_noise(),
        tuple(contacts),
    )  # fmt: skip


def contact_slopes(layers: LayeredPictures, index: int, seen: SeenContact) -> FloatArray:
    """(3, groups, h, w, 3): how a press changes by its column and row, pixels, and the logarithm of
    its radius."""
    response = layers.presses[index] - layers.background
    down, across = np.gradient(response, axis=(1, 2))
    rows, columns = np.mgrid[: response.shape[1], : response.shape[2]] + 0.5
    x = (columns - seen.centre[0]).astype(np.float32)[..., None]
    y = (rows - seen.centre[1]).astype(np.float32)[..., None]
    wider = response - x * across - y * down
    return np.stack([-across, -down, wider]).astype(np.float32)

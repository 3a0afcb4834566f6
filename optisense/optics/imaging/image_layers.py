"""The layers of an image, one for each light group, and what the next draft of them reuses."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from optisense.optics.transport.camera_paths import VisiblePoints

PointsKey = tuple[bool, bool, int | None]
"""Whether visible points lie in contacts, whether only some of the pixels were chosen, and the
channel of their light."""


@dataclass
class ImageLayers:
    """The layers of an image for lights of 1 mW in each channel.

    Attributes:
        radiance: (groups, h, w, 3) radiance by light group, mW/(mm^2 sr).
        photons: number of emitted photons.
        noise: relative RMS noise of the light; infinite if it is not known.
        worst_noise: relative RMS noise that the noisiest 5 % of the area have at least; None if it
            is not known.
        samples: numbers of camera samples per pixel far from, around and in contacts.
        interrupted: whether Ctrl-C ended the photon tracing early.
    """

    radiance: NDArray[np.float32]
    photons: int
    noise: float
    worst_noise: float | None
    samples: list[int]
    interrupted: bool


@dataclass
class KnownView:
    """Parts of an image that the next draft reuses.

    Attributes:
        points: main and reflected visible points.
        faint: (groups, h, w, 3) light that is reflected by interfaces or between contacts and skin,
            divided by the mean of the other light of its group; None if it is not known.
    """

    points: dict[PointsKey, tuple[VisiblePoints, VisiblePoints | None]] = field(
        default_factory=dict
    )
    faint: NDArray[np.float32] | None = None

    def with_faint(self, layers: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return layers (groups, h, w, 3) with the faint light, a fixed share of a group's."""
        assert self.faint is not None
        return layers + self.faint * _means(layers)

    def keep_faint(self, layers: NDArray[np.float32], faint: NDArray[np.float32]) -> None:
        """Keep the faint light of an image, given its other light; both (groups, h, w, 3)."""
        means = _means(layers)
        self.faint = np.divide(faint, means, out=np.zeros_like(faint), where=means > 0)


def _means(layers: NDArray[np.float32]) -> NDArray[np.float32]:
    return layers.mean(axis=(1, 2, 3), keepdims=True)

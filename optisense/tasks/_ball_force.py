"""The force on a ball that presses on the sensor, from the spread of colours in the picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from optisense.geometry import Contact
from optisense.tasks._ball_press import SPREAD_FEATURES, BallPress, spread_of_colours

if TYPE_CHECKING:
    from optisense.optics import OpticalModel, TactileImage


@dataclass(frozen=True)
class BallForce(BallPress):
    """A perception task: the force on a ball pressed near the middle of the sensor.

    The force is that of the elastic gel (see `optisense.mechanics`). The features are those of the
    whole picture, as the extent of the contact is unknown.
    """

    name: ClassVar[str] = "force"
    unit: ClassVar[str] = "N"
    targets: ClassVar[tuple[str, ...]] = ("force",)
    features: ClassVar[tuple[str, ...]] = SPREAD_FEATURES
    width: ClassVar[int] = 96
    contact_only: ClassVar[bool] = False

    def contact(
        self, model: OpticalModel, rng: np.random.Generator
    ) -> tuple[Contact, Sequence[float]]:
        """Return a ball at a random depth, and the force (N) of the gel on it."""
        contact = self.ball(rng)
        return contact, (model.pressed([contact]).contacts[0].force,)

    def measure(self, picture: NDArray[np.uint8], image: TactileImage) -> Sequence[float]:
        """Return the standard deviation of each channel of a picture (h, w, 3), levels of 255."""
        return spread_of_colours(picture)

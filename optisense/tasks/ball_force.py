"""The force on a ball that presses on the sensor, from the spread of colours in the picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from optisense.errors import TaskError
from optisense.geometry import Contact, Sphere

if TYPE_CHECKING:
    from optisense.optics import OpticalModel, TactileImage


@dataclass(frozen=True)
class BallForce:
    """A ball pressed near the middle of the sensor, whose force is to be read.

    The force is that of the elastic gel (see `optisense.mechanics`). The whole picture is read, as
    nothing in it tells where the contact ends.

    Attributes:
        radius: mm, of the ball.
        least, most: mm; the depth is drawn evenly in between.
        aside: mm; the place is drawn evenly from a square of half this side around the middle.
    """

    radius: float = 3.0
    least: float = 0.1
    most: float = 1.0
    aside: float = 1.0

    name: ClassVar[str] = "force"
    unit: ClassVar[str] = "N"
    targets: ClassVar[tuple[str, ...]] = ("force",)
    features: ClassVar[tuple[str, ...]] = ("spread_red", "spread_green", "spread_blue")
    width: ClassVar[int] = 96
    contact_only: ClassVar[bool] = False

    def __post_init__(self) -> None:
        if not (self.radius > 0 and 0 < self.least < self.most and self.aside >= 0):
            raise TaskError(
                f"a ball of {self.radius:g} mm and depths of {self.least:g} to {self.most:g} make "
                "no sense",
                hint="Give a radius above 0 mm, and depths above 0 mm, the smaller first",
            )

    def check(self, model: OpticalModel) -> None:
        """Try the deepest press at the corners of the square.

        Raises:
            ContactError: one is off the surface or deeper than the gel.
        """
        for u in (-self.aside, self.aside):
            for v in (-self.aside, self.aside):
                model.place(Contact(Sphere(self.radius), at=(u, v), depth=self.most))

    def contact(
        self, model: OpticalModel, rng: np.random.Generator
    ) -> tuple[Contact, Sequence[float]]:
        """A ball at a random depth, and the force of the gel on it."""
        depth = float(rng.uniform(self.least, self.most))
        u, v = rng.uniform(-self.aside, self.aside, 2).tolist()
        contact = Contact(Sphere(self.radius), at=(u, v), depth=depth)
        return contact, (model.pressed([contact]).contacts[0].force,)

    def measure(self, picture: NDArray[np.uint8], image: TactileImage) -> Sequence[float]:
        """The standard deviation of each channel over the picture, in levels of 255."""
        spread: list[float] = picture.reshape(-1, 3).std(axis=0, dtype=np.float64).tolist()
        return spread

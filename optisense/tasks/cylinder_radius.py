"""The radius of a touching cylinder, from the spread of colours in the contact."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from optisense.errors import TaskError
from optisense.geometry import Contact, Cylinder
from optisense.tasks.ball_press import (
    SPREAD_FEATURES,
    place_aside,
    spread_of_colours,
    try_corners,
)

if TYPE_CHECKING:
    from optisense.optics import OpticalModel, TactileImage

LEAST_PIXELS = 20
"""Fewer pixels in a contact give no useful spread."""


@dataclass(frozen=True)
class CylinderRadius:
    """A cylinder pressed on the middle of the sensor, whose radius is to be read.

    It lies along the picture's width, a little aside and turned, as no robot grasps exactly. The
    paper gives the features and the model; all numbers here are ours.

    Attributes:
        least, most: mm; the radius is drawn evenly in between.
        depth: mm, the same for all: a deeper press spreads colours as a thinner cylinder does.
        aside: mm; the place is drawn evenly from a square of half this side around the middle.
        turn: degrees; turned about the normal by -turn to turn.
    """

    least: float = 1.0
    most: float = 6.0
    depth: float = 0.5
    aside: float = 1.0
    turn: float = 10.0

    name: ClassVar[str] = "cylinder-radius"
    unit: ClassVar[str] = "mm"
    targets: ClassVar[tuple[str, ...]] = ("radius",)
    features: ClassVar[tuple[str, ...]] = SPREAD_FEATURES
    width: ClassVar[int] = 96
    contact_only: ClassVar[bool] = True

    def __post_init__(self) -> None:
        if not (0 < self.least < self.most and self.depth > 0 and self.aside >= 0):
            raise TaskError(
                f"radii {self.least:g} to {self.most:g} and depth {self.depth:g} make no sense",
                hint="Give radii above 0 mm, the smaller first, and a depth above 0 mm",
            )

    def check(self, model: OpticalModel) -> None:
        """Try the thinnest and the thickest cylinder at the corners of the square.

        Raises:
            ContactError: one is off the surface or deeper than the gel.
        """
        thinnest, thickest = Cylinder(self.least), Cylinder(self.most)
        try_corners(model, [thinnest, thickest], self.aside, self.depth)

    def contact(
        self, model: OpticalModel, rng: np.random.Generator
    ) -> tuple[Contact, Sequence[float]]:
        """A cylinder of random radius."""
        radius = float(rng.uniform(self.least, self.most))
        at = place_aside(rng, self.aside)
        turn = float(rng.uniform(-self.turn, self.turn))
        contact = Contact(Cylinder(radius), at=at, depth=self.depth, rotation=turn)
        return contact, (radius,)

    def measure(self, picture: NDArray[np.uint8], image: TactileImage) -> Sequence[float]:
        """The standard deviation of each channel over the contact, in levels of 255."""
        inside = image.contact_mask
        if inside.sum() < LEAST_PIXELS:
            raise TaskError(
                f"only {inside.sum()} pixels show the contact",
                hint="Use a higher resolution, or look at where the camera looks",
            )
        return spread_of_colours(picture[inside])

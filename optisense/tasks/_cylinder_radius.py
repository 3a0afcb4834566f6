"""The radius of a touching cylinder, from the spread of colours in the contact."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from optisense.errors import TaskError
from optisense.geometry import Contact, Cylinder
from optisense.tasks._ball_press import (
    SPREAD_FEATURES,
    place_aside,
    spread_of_colours,
    try_corners,
)

if TYPE_CHECKING:
    from optisense.optics import OpticalModel, TactileImage

LEAST_PIXELS = 20
"""Smallest number of pixels of a contact that gives features; fewer give no useful spread."""


@dataclass(frozen=True)
class CylinderRadius:
    """A perception task: the radius of a cylinder pressed on the middle of the sensor.

    The cylinder lies along the picture's width, slightly displaced and turned, as a robot's grasp
    is not exact. The features and the model are those of the OptiSense paper; the numbers are not.

    Attributes:
        least, most: bounds of the uniform distribution of the radius, mm.
        depth: depth (mm), the same for all samples, as a deeper press spreads colours like a
            thinner cylinder.
        aside: half side (mm) of the square around the middle from which the place is drawn.
        turn: largest angle (degrees) of the uniform rotation about the normal.
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
        if not (0 < self.depth <= self.least < self.most and self.aside >= 0):
            raise TaskError(
                f"radii of {self.least:g} to {self.most:g} mm, pressed {self.depth:g} mm deep, are "
                "impossible",
                hint="Give the smaller radius first, and a depth above 0 mm and not deeper than it",
            )

    def check(self, model: OpticalModel) -> None:
        """Check the thinnest and the thickest cylinder at the corners of the square.

        Raises:
            ContactError: a press is off the surface or deeper than the gel.
        """
        thinnest, thickest = Cylinder(self.least), Cylinder(self.most)
        try_corners(model, [thinnest, thickest], self.aside, self.depth)

    def contact(
        self, model: OpticalModel, rng: np.random.Generator
    ) -> tuple[Contact, Sequence[float]]:
        """Return a cylinder of random radius, and this radius (mm)."""
        radius = float(rng.uniform(self.least, self.most))
        at = place_aside(rng, self.aside)
        turn = float(rng.uniform(-self.turn, self.turn))
        contact = Contact(Cylinder(radius), at=at, depth=self.depth, rotation=turn)
        return contact, (radius,)

    def measure(self, picture: NDArray[np.uint8], image: TactileImage) -> Sequence[float]:
        """Return the standard deviation of each channel of a picture (h, w, 3) over the contact, in
        levels of 255.

        Raises:
            TaskError: fewer than LEAST_PIXELS show the contact.
        """
        inside = image.contact_mask
        if inside.sum() < LEAST_PIXELS:
            raise TaskError(
                f"only {inside.sum()} pixels show the contact",
                hint="Use a higher resolution, or check the camera's direction",
            )
        return spread_of_colours(picture[inside])

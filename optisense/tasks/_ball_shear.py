"""The shear force of a ball that was dragged over the skin, from the motion of printed dots."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from optisense.errors import TaskError
from optisense.geometry import Contact
from optisense.reading.dots import dots_in_picture
from optisense.tasks._ball_press import BallPress

if TYPE_CHECKING:
    from optisense.optics import OpticalModel, TactileImage

FEWEST_DOTS = 4
"""Smallest number of markers in a picture that gives features, two along each axis; the mean motion
of fewer is unreliable."""


@dataclass(frozen=True)
class BallShear(BallPress):
    """A perception task: the shear force of a ball that is pressed in near the middle and dragged.

    The shear force is that of the elastic gel with friction (see `optisense.mechanics`). The
    sensor's design needs markers; each is located in the picture near its position in the untouched
    picture.

    Attributes:
        radius: radius of the ball, mm.
        least, most: bounds of the uniform distribution of the depth, mm.
        aside: half side (mm) of the square around the middle from which the place is drawn.
        farthest: radius (mm) of the disc from which the drag is drawn.
    """

    least: float = 0.4
    farthest: float = 0.4

    name: ClassVar[str] = "shear"
    unit: ClassVar[str] = "N"
    targets: ClassVar[tuple[str, ...]] = ("shear_u", "shear_v")
    features: ClassVar[tuple[str, ...]] = ("across", "down", "spread_across", "spread_down")
    width: ClassVar[int] = 160
    contact_only: ClassVar[bool] = False

    def __post_init__(self) -> None:
        super().__post_init__()
        if not (math.isfinite(self.farthest) and self.farthest > 0):
            raise TaskError(
                f"a drag of up to {self.farthest:g} mm is impossible",
                hint="Give a distance above 0 mm",
            )

    def check(self, model: OpticalModel) -> None:
        """Check that the sensor has markers, and the deepest press at the corners of the square.

        Raises:
            TaskError: the design has no markers.
            ContactError: a press is off the surface or deeper than the gel.
        """
        if model.design.markers is None:
            raise TaskError(
                "shear is read from markers, and the design has none",
                where=model.design.name,
                hint="Add some to design.yaml, such as\n"
                "markers: {grid: [9, 7], pitch: 2.0, radius: 0.4}",
            )
        super().check(model)

    def contact(
        self, model: OpticalModel, rng: np.random.Generator
    ) -> tuple[Contact, Sequence[float]]:
        """Return a ball that was dragged, and the shear force (N) on the skin along u and v."""
        size, way = self.farthest * math.sqrt(rng.random()), 2.0 * math.pi * rng.random()
        shift = size * math.cos(way), size * math.sin(way)
        contact = replace(self.ball(rng), shift=shift)
        force = model.pressed([contact]).contacts[0].shear_force
        surface = model.surface
        return contact, (float(force @ surface.u_axis), float(force @ surface.v_axis))

    def measure(self, picture: NDArray[np.uint8], image: TactileImage) -> Sequence[float]:
        """Return the mean and standard deviation of the dots' motion across and down a picture
        (h, w, 3), pixels: four numbers.

        Raises:
            TaskError: too few dots are found.
        """
        assert image.markers is not None
        known = image.markers.before
        moved = dots_in_picture(picture, known) - known
        moved = moved[np.isfinite(moved).all(axis=1)]
        if len(moved) < FEWEST_DOTS:
            raise TaskError(
                f"only {len(moved)} markers are found in a picture",
                hint="Use a higher resolution, larger markers, or more of them",
            )
        return [*moved.mean(axis=0).tolist(), *moved.std(axis=0).tolist()]

"""Balls pressed near the middle of a sensor, shared by several tasks."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from optisense.errors import TaskError
from optisense.geometry import Contact, Indenter, Sphere

if TYPE_CHECKING:
    from optisense.optics import OpticalModel

SPREAD_FEATURES = ("spread_red", "spread_green", "spread_blue")
"""Names of the features that `spread_of_colours` returns."""


def spread_of_colours(pixels: NDArray[np.uint8]) -> Sequence[float]:
    """Return the standard deviation of each channel over pixels (..., 3), in levels of 255."""
    spread: list[float] = pixels.reshape(-1, 3).std(axis=0, dtype=np.float64).tolist()
    return spread


def place_aside(rng: np.random.Generator, aside: float) -> tuple[float, float]:
    """Draw a place (u, v), mm, from a square of half side ``aside`` (mm) around the middle."""
    u, v = rng.uniform(-aside, aside, 2).tolist()
    return u, v


def try_corners(
    model: OpticalModel, indenters: Iterable[Indenter], aside: float, depth: float
) -> None:
    """Raise ContactError if an indenter is off the surface, or deeper than the gel, at a corner of
    the square of `place_aside`.
    """
    for indenter in indenters:
        for u in (-aside, aside):
            for v in (-aside, aside):
                model.place(Contact(indenter, at=(u, v), depth=depth))


@dataclass(frozen=True)
class BallPress:
    """A ball pressed near the middle of a sensor.

    Attributes:
        radius: radius of the ball, mm.
        least, most: bounds of the uniform distribution of the depth, mm.
        aside: half side (mm) of the square around the middle from which the place is drawn.
    """

    radius: float = 3.0
    least: float = 0.1
    most: float = 1.0
    aside: float = 1.0

    def __post_init__(self) -> None:
        if not (0 < self.least < self.most <= self.radius and self.aside >= 0):
            raise TaskError(
                f"a ball of {self.radius:g} mm and depths of {self.least:g} to "
                f"{self.most:g} mm are impossible",
                hint="Give depths above 0 mm and not deeper than the radius, the smaller first",
            )

    def check(self, model: OpticalModel) -> None:
        """Raise ContactError if the deepest press is off the surface, or deeper than the gel, at a
        corner of the square.
        """
        try_corners(model, [Sphere(self.radius)], self.aside, self.most)

    def ball(self, rng: np.random.Generator) -> Contact:
        """Return a ball at a random place and depth."""
        depth = float(rng.uniform(self.least, self.most))
        return Contact(Sphere(self.radius), at=place_aside(rng, self.aside), depth=depth)

"""Perception tasks of balls and cylinders that are pressed near the middle of a sensor.

The force on a ball and the radius of a cylinder are read from the spread of colours; the shear
force of a ball that was dragged over the skin, from the motion of printed dots.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from optisense.errors import TaskError
from optisense.geometry import Contact, Cylinder, Indenter, Sphere
from optisense.reading.dots import dots_in_picture

if TYPE_CHECKING:
    from optisense.optics import OpticalModel, TactileImage

SPREAD_FEATURES = ("spread_red", "spread_green", "spread_blue")
"""Names of the features that `spread_of_colours` returns."""

FEWEST_DOTS = 4
"""Smallest number of markers in a picture that gives features, two along each axis; the mean motion
of fewer is unreliable."""

LEAST_PIXELS = 20
"""Smallest number of pixels of a contact that gives features; fewer give no useful spread."""


def _spread_of_colours(pixels: NDArray[np.uint8]) -> Sequence[float]:
    """Return the standard deviation of each channel over pixels (..., 3), in levels of 255."""
    spread: list[float] = pixels.reshape(-1, 3).std(axis=0, dtype=np.float64).tolist()
    return spread


def _place_aside(rng: np.random.Generator, aside: float) -> tuple[float, float]:
    """Draw a place (u, v), mm, from a square of half side ``aside`` (mm) around the middle."""
    u, v = rng.uniform(-aside, aside, 2).tolist()
    return u, v


def _try_corners(
    model: OpticalModel, indenters: Iterable[Indenter], aside: float, depth: float
) -> None:
    """Raise ContactError if an indenter is off the surface, or deeper than the gel, at a corner of
    the square of `_place_aside`.
    """
    for indenter in indenters:
        for u in (-aside, aside):
            for v in (-aside, aside):
                model.place(Contact(indenter, at=(u, v), depth=depth))


@dataclass(frozen=True)
class BallPress:
    """A ball pressed near the middle of a sensor; see `BallForce`."""

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
        _try_corners(model, [Sphere(self.radius)], self.aside, self.most)

    def ball(self, rng: np.random.Generator) -> Contact:
        """Return a ball at a random place and depth."""
        depth = float(rng.uniform(self.least, self.most))
        return Contact(Sphere(self.radius), at=_place_aside(rng, self.aside), depth=depth)


@dataclass(frozen=True)
class BallForce(BallPress):
    """A perception task: the force on a ball pressed near the middle of the sensor.

    The force is that of the elastic gel (see `optisense.mechanics`). The features are those of the
    whole picture, as the extent of the contact is unknown.

    Attributes:
        radius: radius of the ball, mm.
        least, most: bounds of the uniform distribution of the depth, mm.
        aside: half side (mm) of the square around the middle from which the place is drawn.
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
        return _spread_of_colours(picture)


@dataclass(frozen=True)
class BallShear(BallPress):
    """A perception task: the shear force of a ball that is pressed in near the middle and dragged.

    The shear force is that of the elastic gel with friction (see `optisense.mechanics`). The
    sensor's design needs markers; each is located in the picture near its position in the untouched
    picture.

    Attributes:
        radius, least, most, aside: see `BallForce`.
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
        _try_corners(model, [thinnest, thickest], self.aside, self.depth)

    def contact(
        self, model: OpticalModel, rng: np.random.Generator
    ) -> tuple[Contact, Sequence[float]]:
        """Return a cylinder of random radius, and this radius (mm)."""
        radius = float(rng.uniform(self.least, self.most))
        at = _place_aside(rng, self.aside)
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
        return _spread_of_colours(picture[inside])

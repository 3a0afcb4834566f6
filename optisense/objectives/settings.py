"""Settings that all objectives share: the images and rays that a sensor is rated by."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

from optisense.design.camera_checks import LEAST_PICTURE, LEAST_SKIN
from optisense.errors import ObjectiveError
from optisense.keyword_types import is_number, set_plain_numbers
from optisense.mechanics.skins import CONFORMING, SKINS
from optisense.quality import LEVELS, MOST_PHOTONS, photons_of

BALL_RADIUS = 1.5
"""Radius (mm) of the ball that presses (the OptiSense paper, "RGB2Normal")."""

PRESS_DEPTH = 0.3
"""Depth (mm) of presses; the paper does not state it. A ball of 1.5 mm is then touched up to 37
degrees; published presses of balls on real GelSight Minis reach 25 to 40."""

PLACES = 9
"""Number of contacts, which cover the visible sensing surface evenly (the paper)."""

ACROSS = 640
"""Width (pixels) of images and rays for every sensor. At 320, the usual width for many cameras, a
ball on the side of a fingertip has too few pixels for a score; images of 640 cost little more."""


VIEW_ACROSS = 160
"""Number of chief rays across the image from which the shares of skin and picture are computed, for
any resolution of the scores: on the built-in sensors the shares differ by less than 0.003 from
those of 640. With 320, a trial of a search by rays would take half as long again."""

MOST_PIXELS = 16_384
"""Largest number of pixels along a side of an image: the limit of the renderer's memory, and more
than any camera that fits into a sensor has."""

MOST_RADIUS = 1000.0
"""Largest radius (mm) of the ball that presses: larger than any sensor, for which it is flat."""


@dataclass(frozen=True)
class Settings:
    """Images and rays that objectives share. Lengths in mm.

    Attributes:
        resolution: (width, height) of images, pixels; if None, 640 wide as the camera's are.
        ray_resolution: (width, height) of the chief rays; the same default.
        photons: number of photons for the light, or a level of `optisense.quality`; fine if None.
        seed: seed of the photons and camera samples.
        radius: radius of the ball that presses, mm.
        depth: depth of the presses, mm.
        places: (u, v) on the sensing surface; nine that cover it evenly if None.
        together: whether all places are pressed in one image, if contacts do not overlap.
        exposure: factor on the radiance; "auto" is the automatic exposure of the untouched sensor,
            lowered if contacts would be overexposed (`exposure.exposure_for`).
        least_skin: smallest share, 0 to 1, of the sensing surface's area that the camera must see
            for a score.
        least_picture: smallest share, 0 to 1, of the pixels that must see the sensing surface.
        skin: "conforming", as in the OptiSense paper, or "elastic"; see docs/mechanics.md.
    """

    resolution: tuple[int, int] | None = None
    ray_resolution: tuple[int, int] | None = None
    photons: int | str | None = None
    seed: int = 0
    radius: float = BALL_RADIUS
    depth: float = PRESS_DEPTH
    places: tuple[tuple[float, float], ...] | None = None
    together: bool = False
    exposure: float | Literal["auto"] = "auto"
    least_skin: float = LEAST_SKIN
    least_picture: float = LEAST_PICTURE
    skin: str = CONFORMING

    def __post_init__(self) -> None:
        set_plain_numbers(self)
        for name in ("resolution", "ray_resolution"):
            size = getattr(self, name)
            if size is not None:
                object.__setattr__(self, name, _size(name, size))
        if self.photons is not None:
            object.__setattr__(self, "photons", _photons(self.photons))
        if not (_is_whole(self.seed) and 0 <= self.seed < 2**32):
            raise ObjectiveError(f"the seed is {self.seed!r}", hint="Give a whole number from 0")
        if self.exposure != "auto" and not (
            is_number(self.exposure) and 0.0 < self.exposure < float("inf")
        ):
            raise ObjectiveError(
                f"the exposure is {self.exposure!r}", hint='Give "auto" or a factor above 0'
            )
        if not (is_number(self.depth) and is_number(self.radius) and 0 < self.depth < self.radius):
            raise ObjectiveError(
                f"a ball of radius {self.radius!r} mm can't be pressed {self.depth!r} mm deep",
                hint="Press deeper than 0 and less deep than the radius",
            )
        if self.radius > MOST_RADIUS:
            raise ObjectiveError(
                f"a ball of radius {self.radius!r} mm is larger than any sensor",
                hint=f"Give a radius up to {MOST_RADIUS:g} mm",
            )
        for name in ("least_skin", "least_picture"):
            share = getattr(self, name)
            if not (is_number(share) and 0.0 <= share <= 1.0):
                raise ObjectiveError(
                    f"the setting '{name}' is {share!r}", hint="Give a share from 0 to 1"
                )
        if self.skin not in SKINS:
            raise ObjectiveError(
                f"there is no skin {self.skin!r}", hint="Use " + " or ".join(SKINS)
            )
        if self.places is not None:
            object.__setattr__(self, "places", _pairs(self.places))


def refuse_outside(
    name: str, value: float, low: float, high: float = math.inf, *, open_low: bool = False
) -> None:
    """Check a setting of an objective before anything is rendered for it.

    Args:
        low, high: smallest and largest allowed value.
        open_low: whether `low` itself is too small.

    Raises:
        ObjectiveError: the value is outside these bounds.
    """
    if low <= value <= high and not (open_low and value == low):
        return
    least = f"above {low:g}" if open_low else f"from {low:g}"
    raise ObjectiveError(
        f"the setting '{name}' is {value:g}",
        hint=f"Give a number {least}" + (f" to {high:g}" if math.isfinite(high) else ""),
    )


def _is_whole(value: Any) -> bool:
    return is_number(value) and value == int(value)


def _size(name: str, size: Any) -> tuple[int, int]:
    if (
        not isinstance(size, tuple | list)
        or len(size) != 2
        or not all(_is_whole(side) and 0 < side <= MOST_PIXELS for side in size)
    ):
        raise ObjectiveError(
            f"the {name.replace('_', ' ')} is {size!r}",
            hint=f"Give width and height in pixels, each from 1 to {MOST_PIXELS:,}",
        )
    return int(size[0]), int(size[1])


def _pairs(places: Any) -> tuple[tuple[float, float], ...]:
    if (
        not isinstance(places, tuple | list)
        or not places
        or not all(
            isinstance(place, tuple | list) and len(place) == 2 and all(map(is_number, place))
            for place in places
        )
    ):
        raise ObjectiveError(
            f"places are {places!r}", hint="Give one or more (u, v) in mm, such as ((0, 0), (2, 1))"
        )
    return tuple((float(u), float(v)) for u, v in places)


def _photons(given: int | str) -> int:
    try:
        number = photons_of(given)
    except ValueError:
        number = 0
    if not 0 < number <= MOST_PHOTONS:
        raise ObjectiveError(
            f"photons are {given!r}",
            hint=f"Give a whole number from 1 to {MOST_PHOTONS:,}, or {LEVELS}",
        )
    return number

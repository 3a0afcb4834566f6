"""Photographs of a real sensor: its background, and balls that are pressed into it.

A folder of photographs has one of three layouts, each of which `layouts` reads. The result is
always `Photographs`: pictures of one size, and the data of each press.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from PIL import Image

from optisense.array_types import ByteArray
from optisense.errors import CalibrationError

WORKING_WIDTH = 320
"""Width of the pictures that are compared, in pixels: contacts of millimetres are then some 50
pixels wide, and a picture renders in about half a second.
"""

LEAST_SIDE = 32
"""Smallest shorter side of a photograph, in pixels: in smaller ones, contacts have a few pixels."""

FULL_LEVEL, FULL_SHARE = 255, 0.005
"""Level of a saturated channel, and the share of such pixels in an overexposed picture."""

DARK_LEVEL = 16.0
"""Level that a twentieth of the pixels of the brightest channel should exceed; a picture whose
pixels stay below is underexposed, as eight bits hold few levels of it.
"""

GREY_LEVEL = 1.0
"""Largest mean difference between the channels of a photograph without colour, in levels of 255;
JPEG files of grey pictures differ by less, and those of coloured light by tens.
"""

BRIGHTEST = 95.0
"""Percentile of the brightest channel that is compared with `DARK_LEVEL`, so that hot
pixels and small reflections do not decide."""


@dataclass(frozen=True)
class PhotographedPress:
    """Photograph of a ball that is pressed into a sensor.

    Attributes:
        name: name of its file, to show.
        picture: picture (h, w, 3), uint8.
        diameter: diameter of the ball, mm.
        centre: column and row of the contact's middle, pixels from the picture's left and top edge;
            None if unknown.
        radius: radius of the contact, pixels; None if unknown.
        fingerprint: SHA-256 of the file, or of the array, of the picture.
    """

    name: str
    picture: ByteArray = field(repr=False)
    diameter: float
    centre: tuple[float, float] | None = None
    radius: float | None = None
    fingerprint: str = ""

    def __post_init__(self) -> None:
        if not (np.isfinite(self.diameter) and self.diameter > 0.0):
            raise CalibrationError(
                f"the ball's diameter is {self.diameter:g}",
                where=self.name,
                hint="Give it in mm, above 0",
            )


@dataclass(frozen=True)
class Photographs:
    """Photographs of one sensor, all of one size.

    Attributes:
        background: picture (h, w, 3), uint8, with nothing pressed in.
        presses: presses, at least one.
        layout: name of the layout that they were read from.
        fingerprint: fingerprint of the background, see `PhotographedPress`.
        scale: size of these pictures relative to the photographs that were read.
    """

    background: ByteArray = field(repr=False)
    presses: tuple[PhotographedPress, ...]
    layout: str = ""
    fingerprint: str = ""
    scale: float = 1.0

    def __post_init__(self) -> None:
        if not self.presses:
            raise CalibrationError(
                "there is no photograph of a press", hint="Add at least one, better six"
            )
        height, width = self.background.shape[:2]
        if min(height, width) < LEAST_SIDE:
            raise CalibrationError(
                f"the background has {width} x {height} pixels",
                hint=f"Give pictures of at least {LEAST_SIDE} pixels a side",
            )
        for press in self.presses:
            if press.picture.shape != self.background.shape:
                rows, columns = press.picture.shape[:2]
                raise CalibrationError(
                    f"a press has {columns} x {rows} pixels and the background {width} x {height}",
                    where=press.name,
                    hint="Take all photographs with the same settings of the camera",
                )
            if press.centre is not None:
                column, row = press.centre
                if not (0.0 <= column <= width and 0.0 <= row <= height):
                    raise CalibrationError(
                        f"the contact is labelled at column {column:g}, row {row:g}, outside the "
                        f"picture of {width} x {height} pixels",
                        where=press.name,
                        hint="Give the label in pixels of this photograph, or leave it empty to "
                        "have the contact found",
                    )

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels."""
        return self.background.shape[1], self.background.shape[0]

    def subset(self, indices: Sequence[int]) -> Photographs:
        """Return the same background with some of the presses."""
        return replace(self, presses=tuple(self.presses[index] for index in indices))

    def scaled(self, width: int = WORKING_WIDTH) -> Photographs:
        """Return the photographs at a smaller size, by averaging pixels.

        Smaller photographs are not changed.
        """
        if self.size[0] <= width:
            return self
        factor = width / self.size[0]
        size = width, max(1, round(factor * self.size[1]))
        presses = [
            replace(
                press,
                picture=_resized(press.picture, size),
                centre=None
                if press.centre is None
                else (factor * press.centre[0], factor * press.centre[1]),
                radius=None if press.radius is None else factor * press.radius,
            )
            for press in self.presses
        ]
        background = _resized(self.background, size)
        return replace(
            self, background=background, presses=tuple(presses), scale=factor * self.scale
        )

    def warnings(self) -> list[str]:
        """Return warnings about pictures that occur twice, and about their colour and exposure.

        Each one is a sentence.
        """
        pictures = [("the background", self.background)]
        pictures += [(press.name, press.picture) for press in self.presses]
        found = _repeated(pictures)
        if all(_is_grey(picture) for _, picture in pictures):
            found.append(
                "the photographs have no colour, so that the colours of the lights and the camera "
                "can't be fitted to them"
            )
        for name, picture in pictures:
            full = float((picture.max(axis=2) >= FULL_LEVEL).mean())
            if full > FULL_SHARE:
                found.append(
                    f"{name}: {100 * full:.1f} % of the pixels are overexposed, and do not show "
                    "how bright the light was there"
                )
            bright = float(np.percentile(picture.max(axis=2), BRIGHTEST))
            if bright < DARK_LEVEL:
                found.append(
                    f"{name}: it is underexposed, as hardly a pixel is brighter than level "
                    f"{bright:.0f} of 255"
                )
        return found


def _repeated(pictures: Sequence[tuple[str, ByteArray]]) -> list[str]:
    """Return a sentence for each picture that is the same as an earlier one."""
    found = []
    first: dict[bytes, str] = {}
    for name, picture in pictures:
        content = picture.tobytes()
        earlier = first.get(content)
        if earlier is None:
            first[content] = name
        else:
            same = "is listed twice" if earlier == name else f"is the same picture as {earlier}"
            found.append(f"{name}: it {same}; leave one of them out")
    return found


def _is_grey(picture: ByteArray) -> bool:
    spread = picture.max(axis=2).astype(np.float64) - picture.min(axis=2)
    return float(spread.mean()) < GREY_LEVEL


def _resized(picture: ByteArray, size: tuple[int, int]) -> ByteArray:
    return np.asarray(Image.fromarray(picture).resize(size, Image.Resampling.BOX), dtype=np.uint8)

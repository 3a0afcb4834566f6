"""One press of a ball: what is true about each pixel that sees it, and what a robot reads there."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from optisense.design.lenses.film import PictureWindow
from optisense.design.responses import PictureChain
from optisense.errors import ObjectiveError

FloatArray = NDArray[np.float64]
Value = TypeVar("Value")

MOST_CLIPPED = 0.25
"""A press with a larger part of its pixels overexposed can't be judged."""

CLIPPED = 254.5 / 255
"""Value from which on a channel is stored as 255 of 255 levels and counts as saturated."""

DARK = 1.5 / 255
"""A pixel whose brightest channel is no brighter is black."""


@dataclass(frozen=True)
class Press:
    """A ball pressed in at one place. Images are (h, w, ...), row 0 on top.

    Attributes:
        number: of the place, from 1.
        place: (3,) mm, on the undeformed sensing surface.
        inward: (3,) unit normal of the undeformed surface there, into the gel.
        east, north: (3,) unit vectors in the tangent plane; image right and image up in the
            middle of a flat sensor.
        centre: (3,) mm, the ball's centre.
        mask: (h, w), true where this ball is seen in its contact.
        response: (h, w, 3) the camera sensor's linear response, 0 to 1 (a full well).
        normals: (h, w, 3) unit, of the surface seen.
        points: (h, w, 3) mm, what is seen.
        before: (h, w, 3) unit normals of the untouched surface.
        camera: turns the response into what is stored.
        window: which part of the picture the images are; all of it if None.
        respond_untouched: makes `untouched`.
        geometry: what objectives have derived of all but the response (see `derived`).
    """

    number: int
    place: FloatArray
    inward: FloatArray
    east: FloatArray
    north: FloatArray
    centre: FloatArray
    mask: NDArray[np.bool_]
    response: NDArray[np.float32]
    normals: NDArray[np.float32]
    points: NDArray[np.float32]
    before: NDArray[np.float32]
    camera: PictureChain = field(default_factory=PictureChain)
    window: PictureWindow | None = None
    respond_untouched: Callable[[], NDArray[np.float32]] | None = field(
        default=None, repr=False, compare=False
    )
    geometry: dict[Hashable, Any] = field(default_factory=dict, repr=False, compare=False)

    def derived(self, key: Hashable, derive: Callable[[], Value]) -> Value:
        """What follows from all but the response: derived once for the press under any light.

        Args:
            key: names it, with the settings that it depends on.
            derive: works it out.
        """
        if key not in self.geometry:
            self.geometry[key] = derive()
        found: Value = self.geometry[key]
        return found

    def direction(self, angle: float) -> FloatArray:
        """(3,) unit: `angle` degrees from east towards north."""
        a = np.radians(angle)
        along: FloatArray = np.cos(a) * self.east + np.sin(a) * self.north
        return along

    @cached_property
    def untouched(self) -> NDArray[np.float32]:
        """(h, w, 3): the response, without noise, where nothing touches the sensor.

        Raises:
            ObjectiveError: nobody said how it is made.
        """
        if self.respond_untouched is None:
            raise ObjectiveError(f"nobody knows how {self.name} looks untouched")
        return self.respond_untouched()

    @cached_property
    def picture_places(self) -> FloatArray:
        """(h, w, 2): of each pixel in the picture, -1 to 1 across its width and its height."""
        window = self.window or PictureWindow.whole(*self.mask.shape)
        y = np.linspace(-1.0, 1.0, window.height)[window.rows]
        x = np.linspace(-1.0, 1.0, window.width)[window.columns]
        return np.stack(np.meshgrid(x, y), axis=-1)

    @cached_property
    def box(self) -> tuple[slice, slice]:
        """Rows and columns around the contact."""
        rows, columns = (np.flatnonzero(self.mask.any(axis=axis)) for axis in (1, 0))
        return slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)

    def colours(self, where: NDArray[np.bool_], kind: str = "picture") -> FloatArray:
        """(n, 3), 0 to 1: the colours of the pixels of a mask (h, w).

        Args:
            where: the mask.
            kind: "picture": sRGB-encoded, as a robot reads it from the camera, before rounding to
                8 bits; or "response": linear.

        Raises:
            ObjectiveError: another kind.
        """
        chosen = self.response[where].astype(np.float64)
        if kind == "picture":
            return self.camera.curve(chosen)
        if kind == "response":
            return chosen
        raise _no_such(kind)

    @property
    def name(self) -> str:
        """How messages call it."""
        x, y, z = self.place
        return f"place {self.number} at ({x:.2f}, {y:.2f}, {z:.2f}) mm"

    def check_seen(self) -> None:
        """Make sure that the camera sees the press.

        Raises:
            ObjectiveError: it does not.
        """
        if not self.mask.any():
            raise ObjectiveError(f"the camera does not see {self.name}")

    def check(self) -> None:
        """Make sure that the press can be judged.

        Raises:
            ObjectiveError: the camera does not see it, or it is overexposed or black.
        """
        self.check_seen()
        brightest = self.colours(self.mask).max(axis=1)
        clipped = float((brightest >= CLIPPED).mean())
        if clipped > MOST_CLIPPED:
            raise ObjectiveError(
                f"{100 * clipped:.0f} % of {self.name} is overexposed", hint="Lower the exposure"
            )
        if float(np.median(brightest)) < DARK:
            raise ObjectiveError(
                f"{self.name} is black", hint="Check the lights, or raise the exposure"
            )


def refuse_kind(kind: str) -> None:
    """Check the kind of colours, before anything is rendered for them.

    Raises:
        ObjectiveError: there is no such kind.
    """
    if kind not in ("picture", "response"):
        raise _no_such(kind)


def _no_such(kind: str) -> ObjectiveError:
    return ObjectiveError(f"there are no colours '{kind}'", hint="Use picture or response")


def azimuths(press: Press, normals: NDArray[np.floating]) -> tuple[FloatArray, FloatArray]:
    """(n,), (n,) degrees: polar angle from the undisturbed normal and azimuth from east, in
    0..180 and -180..180.
    """
    n = np.asarray(normals, dtype=np.float64)
    x, y, z = n @ press.east, n @ press.north, n @ press.inward
    return np.degrees(np.arctan2(np.hypot(x, y), z)), np.degrees(np.arctan2(y, x))

"""One press of a ball: its frame, and the truth and the camera's response in each pixel."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from optisense.array_types import FloatArray
from optisense.design.lenses.film import PictureWindow
from optisense.design.responses import PictureChain
from optisense.errors import ObjectiveError
from optisense.geometry import Contact, SensingSurface, Sphere, locate

Value = TypeVar("Value")

MOST_CLIPPED = 0.25
"""Largest share of overexposed pixels of a press that can be scored: where more are overexposed,
the others no longer represent the contact.
"""

CLIPPED = 254.5 / 255
"""Value from which on a channel is stored as 255 of 255 levels and counts as saturated."""

FEW_ACROSS = 96
"""Number of pixels across a picture below which its resolution may be the reason why no pixel sees
a press: the nine places are found with as many rays (`optisense.optics`)."""

DARK = 1.5 / 255
"""Value of the brightest channel up to which a pixel is black."""


@dataclass(frozen=True, eq=False)
class Press:
    """A ball pressed in at one place. Row 0 of images is the top.

    Attributes:
        number: number of the place, from 1.
        place: (3,) place on the undeformed sensing surface, mm.
        inward: (3,) unit normal of the undeformed surface there, into the gel.
        east, north: (3,) unit vectors in the tangent plane; image right and image up in the middle
            of a flat sensor.
        centre: (3,) the ball's centre, mm.
        mask: (h, w) mask of the pixels that see the contact of this ball.
        response: (h, w, 3) the camera sensor's linear response, 0 to 1 (a full well).
        normals: (h, w, 3) unit normals of the visible surface.
        points: (h, w, 3) visible points, mm.
        before: (h, w, 3) unit normals of the untouched surface.
        camera: picture chain that turns the response into the stored picture.
        window: the part of the picture that the images show; all of it if None.
        respond_untouched: function that computes `untouched`.
        geometry: values that objectives derived from everything but the response (see `derived`).
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
        """Return a value that depends on everything but the response, computed once for the press
        under any light.

        Args:
            key: identifies the value, with the settings that it depends on.
            derive: function that computes the value.
        """
        if key not in self.geometry:
            self.geometry[key] = derive()
        found: Value = self.geometry[key]
        return found

    def direction(self, angle: float) -> FloatArray:
        """Return the unit vector (3,) at `angle` degrees from east towards north."""
        a = np.radians(angle)
        along: FloatArray = np.cos(a) * self.east + np.sin(a) * self.north
        return along

    @cached_property
    def untouched(self) -> NDArray[np.float32]:
        """The response (h, w, 3), without noise, of the untouched sensor.

        Raises:
            ObjectiveError: the press was created without `respond_untouched`.
        """
        if self.respond_untouched is None:
            raise ObjectiveError(f"the untouched response of {self.name} is unknown")
        return self.respond_untouched()

    @property
    def shown(self) -> PictureWindow:
        """The part of the picture that the images show, which is all of it without a `window`."""
        return self.window or PictureWindow.whole(*self.mask.shape)

    @cached_property
    def picture_places(self) -> FloatArray:
        """Positions (h, w, 2) of the pixels in the picture, -1 to 1 across and down."""
        y = np.linspace(-1.0, 1.0, self.shown.height)[self.shown.rows]
        x = np.linspace(-1.0, 1.0, self.shown.width)[self.shown.columns]
        return np.stack(np.meshgrid(x, y), axis=-1)

    @cached_property
    def box(self) -> tuple[slice, slice]:
        """Rows and columns around the contact."""
        rows, columns = (np.flatnonzero(self.mask.any(axis=axis)) for axis in (1, 0))
        return slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)

    @property
    def middle(self) -> tuple[float, float]:
        """Row and column of the middle of the contact in the whole picture."""
        row, column = (
            part.start + (each.start + each.stop) / 2
            for part, each in zip(self.shown.box, self.box, strict=True)
        )
        return row, column

    def colours(self, where: NDArray[np.bool_], kind: str = "picture") -> FloatArray:
        """Return the colours (n, 3), 0 to 1, of the pixels of a mask (h, w).

        Args:
            kind: "picture": after the tone curve of the camera, as a robot reads them from the
                picture, before rounding to 8 bits; or "response": linear.

        Raises:
            ObjectiveError: there is no such kind.
        """
        chosen = self.response[where].astype(np.float64)
        if kind == "picture":
            return self.camera.curve(chosen)
        if kind == "response":
            return chosen
        raise _no_such(kind)

    @property
    def name(self) -> str:
        """The name of the press in messages."""
        x, y, z = self.place
        return f"place {self.number} at ({x:.2f}, {y:.2f}, {z:.2f}) mm"

    def check_seen(self) -> None:
        """Check that the camera sees the press.

        Raises:
            ObjectiveError: the camera does not see the press.
        """
        if not self.mask.any():
            where = f" in {self.shown.width} x {self.shown.height} pixels"
            few = self.shown.width < FEW_ACROSS
            raise ObjectiveError(
                f"the camera does not see {self.name}{where if few else ''}",
                hint="Use a higher resolution" if few else None,
            )

    def check(self) -> None:
        """Check that the press can be scored.

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
    """Raise ObjectiveError if there is no such kind of colours, before anything is rendered."""
    if kind not in ("picture", "response"):
        raise _no_such(kind)


def _no_such(kind: str) -> ObjectiveError:
    return ObjectiveError(f"there are no colours '{kind}'", hint="Use picture or response")


def azimuths(press: Press, normals: NDArray[np.floating]) -> tuple[FloatArray, FloatArray]:
    """Return the polar angle (n,) from the undisturbed normal, 0 to 180 degrees, and the azimuth
    (n,) from east, -180 to 180 degrees.
    """
    n = np.asarray(normals, dtype=np.float64)
    x, y, z = n @ press.east, n @ press.north, n @ press.inward
    return np.degrees(np.arctan2(np.hypot(x, y), z)), np.degrees(np.arctan2(y, x))


class PressFrame(NamedTuple):
    """Frame of a press: place (3,), mm, on the untouched surface, inward normal (3,), compass
    directions (3,), and the ball's centre (3,), mm.
    """

    place: NDArray[np.float64]
    inward: NDArray[np.float64]
    east: NDArray[np.float64]
    north: NDArray[np.float64]
    centre: NDArray[np.float64]


def press_frame(contact: Contact, surface: SensingSurface) -> PressFrame:
    """Return the frame of a press of a ball."""
    assert isinstance(contact.indenter, Sphere)
    spot = locate(contact, surface)
    east, _ = surface.tangents(spot.inward)
    return PressFrame(
        place=spot.point,
        inward=spot.inward,
        east=east,
        north=np.cross(spot.inward, east),
        centre=spot.point + (contact.depth - contact.indenter.radius) * spot.inward,
    )


def nearest_press(
    points: NDArray[np.float32], mask: NDArray[np.bool_], centres: ArrayLike
) -> NDArray[np.int64]:
    """Return the number (h, w) of the press whose centre (of n, (n, 3) mm) is nearest to the point
    that a pixel of the mask sees; -1 elsewhere.
    """
    owner = np.full(mask.shape, -1, dtype=np.int64)
    seen = points[mask].astype(np.float64)
    owner[mask] = np.linalg.norm(seen[:, None] - np.asarray(centres), axis=2).argmin(axis=1)
    return owner

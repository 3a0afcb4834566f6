"""Readings of one press by a calibrated sensor, and the errors of two sensors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from optisense.array_types import FloatArray
from optisense.errors import TaskError
from optisense.kept_arrays import NOTHING_KEPT, KeptArrays
from optisense.reading.tilts import angles_between
from optisense.tasks._calibration import CalibratedSensor

if TYPE_CHECKING:
    from optisense.geometry import Contact


@dataclass(frozen=True)
class PressPictures:
    """Pictures and normals of one press.

    Attributes:
        picture: (h, w, 3) uint8.
        true_normals, read_normals: (h, w, 3) unit normals in the design's frame.
        angles: (h, w) angles (degrees) between them, NaN where nothing touches.
    """

    picture: NDArray[np.uint8]
    true_normals: NDArray[np.float32]
    read_normals: NDArray[np.float32]
    angles: NDArray[np.float32]


@dataclass(frozen=True)
class PressReading:
    """The reading of one press by a sensor, where its camera sees the contact.

    Attributes:
        points: (n, 3) points (mm) of the untouched skin that the pixels of the contact see.
        areas: (n,) area (mm^2) of skin that each of these pixels sees.
        angles: (readers, n) angles (degrees) between read and true normals.
        depths: (readers, n) absolute differences (mm) of read and true depth.
        flat_angles: (n,) angles (degrees) between the untouched and the true normals, the error of
            a reader that always reads a flat surface.
        flat_depths: (n,) true depth (mm), the error in depth of such a reader.
        pictures: the pictures, if they are kept.
    """

    points: FloatArray
    areas: FloatArray
    angles: FloatArray
    depths: FloatArray
    flat_angles: FloatArray
    flat_depths: FloatArray
    pictures: PressPictures | None = None

    def as_arrays(self) -> dict[str, NDArray[Any]]:
        """Return all arrays by name."""
        arrays = {name: getattr(self, name) for name in READING_ARRAYS}
        if self.pictures is not None:
            arrays |= {name: getattr(self.pictures, own) for name, own in PICTURE_ARRAYS.items()}
        return arrays

    @classmethod
    def from_arrays(cls, arrays: dict[str, NDArray[Any]]) -> PressReading:
        """Return the reading of arrays by name, as from `as_arrays`."""
        pictures = None
        if arrays.keys() >= PICTURE_ARRAYS.keys():
            pictures = PressPictures(**{own: arrays[name] for name, own in PICTURE_ARRAYS.items()})
        return cls(**{name: arrays[name] for name in READING_ARRAYS}, pictures=pictures)


READING_ARRAYS = ("points", "areas", "angles", "depths", "flat_angles", "flat_depths")
"""Names of the arrays of a stored reading."""

PICTURE_ARRAYS = {
    "picture": "picture",
    "true_normals": "true_normals",
    "read_normals": "read_normals",
    "picture_angles": "angles",
}
"""Attributes of the pictures of a stored reading, by their names among its arrays."""


def read_press(
    sensor: CalibratedSensor,
    areas: FloatArray,
    contact: Contact,
    number: int,
    keeps: bool,
    kept: KeptArrays = NOTHING_KEPT,
) -> PressReading:
    """Press something into a calibrated sensor and read it by all of its readers. The areas (h, w)
    are those of skin, mm^2, that its pixels see, the number is that of the picture, for its noise,
    and `keeps` says whether pictures are kept.
    """
    return PressReading.from_arrays(
        kept.arrays(
            ["reading", *sensor.inputs, contact, number, sensor.readers],
            lambda: _read(sensor, areas, contact, number, keeps).as_arrays(),
            [*READING_ARRAYS, *(PICTURE_ARRAYS if keeps else ())],
        )
    )


def _read(
    sensor: CalibratedSensor, areas: FloatArray, contact: Contact, number: int, keeps: bool
) -> PressReading:
    image, picture = sensor.take_picture(contact, number)
    mask = image.contact_mask & (areas > 0.0)
    true = image.normals.astype(np.float64)
    true_depth = sensor.untouched.image_depth(image).astype(np.float64)
    read = [sensor.read(picture, reader) for reader in range(sensor.readers)]
    angles = [angles_between(normals, true) for normals, _ in read]
    pictures = None
    if keeps:
        off = np.where(image.contact_mask, angles[0], np.nan)
        narrow = (each.astype(np.float32) for each in (true, read[0][0], off))
        pictures = PressPictures(picture, *narrow)
    return PressReading(
        points=sensor.untouched.points[mask],
        areas=areas[mask],
        angles=np.array([each[mask] for each in angles]),
        depths=np.array([np.abs(depth - true_depth)[mask] for _, depth in read]),
        flat_angles=angles_between(sensor.untouched.normals, true)[mask],
        flat_depths=np.abs(true_depth)[mask],
        pictures=pictures,
    )


def check_seen(name: str, seen: bool) -> None:
    """Raise TaskError unless a camera sees the contact of an object."""
    if not seen:
        raise TaskError(
            f"no camera sees the {name} where it presses",
            hint="Use a higher --resolution, or another --seed",
        )


def whole_errors(
    pair: tuple[PressReading, ...], trees: Sequence[cKDTree], reach: float
) -> tuple[list[FloatArray], list[FloatArray]]:
    """Return the errors of normals (degrees) and of depth (mm) over the whole contact, (readers,)
    for each of two sensors, one of which sees the contact.

    Parts that only the other camera sees count as read flat: those farther than `reach` (mm) from
    the points of the skin that a camera sees, which are in its search tree.
    """
    normals: list[FloatArray] = []
    depths: list[FloatArray] = []
    for side, own in enumerate(pair):
        other = pair[1 - side]
        unseen = np.zeros(len(other.areas), dtype=bool)
        if len(other.points):
            unseen = trees[side].query(other.points)[0] > reach
        hidden = other.areas[unseen]
        whole = own.areas.sum() + hidden.sum()
        if whole == 0.0:  # no contact seen, though all of it is in view
            unseen[:], hidden, whole = True, other.areas, other.areas.sum()
        for kept, read, flat in (
            (normals, own.angles, other.flat_angles),
            (depths, own.depths, other.flat_depths),
        ):
            kept.append((read @ own.areas + flat[unseen] @ hidden) / whole)
    return normals, depths


def flat_errors(press: PressReading) -> tuple[float, float]:
    """Return the errors in normals (degrees) and depth (mm) of reading a flat surface."""
    shares = press.areas / press.areas.sum()
    return float(press.flat_angles @ shares), float(press.flat_depths @ shares)

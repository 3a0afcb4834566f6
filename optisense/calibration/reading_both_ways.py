"""Readers calibrated on a model and applied to photographs, and the reverse.

The reader is the one of the objective `reading` (`optisense.reading.lookup`). It learns the change
of colour at each tilt from the contacts of the presses, where the ball determines the tilt of the
skin, and reads the same contacts in the other's pictures. With a model that represents a sensor it
must read the sensor's balls in their true size.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from optisense.calibration.model_pictures import ModelPictures
from optisense.calibration.photographs import Photographs
from optisense.calibration.realism import ReadBothWays, Realism, distances, realism
from optisense.calibration.seen_contacts import SeenContact
from optisense.geometry import Sphere
from optisense.reading.lookup import (
    Pixels,
    PressTable,
    TiltLookup,
    tilt_grid,
    tilt_kernel,
    tilts_to_normals,
)
from optisense.reading.tilts import angles_between

if TYPE_CHECKING:
    from optisense.geometry import Contact
    from optisense.optics import ChiefRays, OpticalModel

FloatArray = NDArray[np.float64]

INSIDE = 0.9
"""Radius up to which pixels of a contact are read, in radii of the contact: at the edge, hand
labels and detected positions are off by a tenth.
"""

FLATTEST = 100.0
"""Largest ratio of a read radius to the true one; a reader that sees no curvature reads it."""

FEWEST = 3
"""Smallest number of presses from which a reader can be calibrated; fewer don't represent other
places.
"""


@dataclass(frozen=True)
class _Ball:
    """Pixels of a contact, and the tilt of the skin by the ball there.

    Attributes:
        where: mask (h, w) of the pixels.
        offsets: offsets (n, 2) from the contact's middle, along the picture's right and up, mm.
        radius: radius of the ball, mm.
        tilts: tilts (n, 2), degrees.
        places: positions (n, 2) in the picture, -1 to 1.
    """

    where: NDArray[np.bool_]
    offsets: FloatArray
    radius: float
    tilts: FloatArray
    places: FloatArray


def realism_and_readings(
    model: OpticalModel,
    photographs: Photographs,
    seen: Sequence[SeenContact],
    pictures: ModelPictures,
) -> Realism:
    """Return all figures of a model's pictures beside photographs.

    Args:
        model: model that made the pictures.
        photographs: photographs of the sensor.
        seen: contacts in the photographs.
        pictures: pictures of the model, of the same presses.
    """
    found = realism(photographs, seen, pictures)
    # Far from a contact, a response is the noise of two photographs.
    noise = found.median("far_real") / np.sqrt(2.0)
    rays, axes = model.chief_rays(photographs.size), model.design.camera.axes()
    readings = read_both_ways(photographs, seen, pictures, rays, axes, float(noise))
    return replace(found, readings=readings)


def read_both_ways(
    photographs: Photographs,
    seen: Sequence[SeenContact],
    pictures: ModelPictures,
    rays: ChiefRays,
    axes: FloatArray,
    noise: float,
) -> tuple[ReadBothWays, ...]:
    """Calibrate a reader on the model and one on the photographs, and read the other's contacts.

    Args:
        photographs: photographs of the sensor.
        seen: contacts in the photographs.
        pictures: pictures of the model, of the same presses.
        rays: the model's chief rays at the photographs' size.
        axes: axes (3, 3) of the camera: right, up and viewing direction.
        noise: standard deviation of the photographs' noise, levels.

    Returns:
        A reading for each press; none if there are fewer than three.
    """
    if len(seen) < FEWEST:
        return ()
    balls = [
        _ball(place, contact, rays, axes)
        for place, contact in zip(seen, pictures.contacts, strict=True)
    ]
    steepest = max(float(np.linalg.norm(ball.tilts, axis=1).max()) for ball in balls)
    grid = tilt_grid(steepest)
    real = [press.picture.astype(np.float64) for press in photographs.presses]
    ground = photographs.background.astype(np.float64)
    ones = [_pixels(picture, ground, ball) for picture, ball in zip(real, balls, strict=True)]
    others = [
        _pixels(picture, pictures.background, ball)
        for picture, ball in zip(pictures.presses, balls, strict=True)
    ]
    kernels = [tilt_kernel(ball.tilts, grid) for ball in balls]
    readers = [
        TiltLookup(
            [PressTable.of(each, kernel) for each, kernel in zip(known, kernels, strict=True)],
            grid,
            noise,
        )
        for known in (others, ones)
    ]
    found = []
    for press, ball, one, other in zip(photographs.presses, balls, ones, others, strict=True):
        forth, back = (
            _judged(reader.normals(pixels), ball)
            for reader, pixels in zip(readers, (one, other), strict=True)
        )
        found.append(ReadBothWays(press.name, *forth, *back))
    return tuple(found)


def _ball(place: SeenContact, contact: Contact, rays: ChiefRays, axes: FloatArray) -> _Ball:
    assert isinstance(contact.indenter, Sphere) and contact.point is not None
    radius = contact.indenter.radius
    height, width = rays.hit.shape
    away = distances((height, width), place)
    where = (away <= INSIDE) & rays.hit
    normal = rays.normals[where].mean(axis=0).astype(np.float64)
    normal /= np.linalg.norm(normal)
    right = axes[0] - (axes[0] @ normal) * normal
    right /= np.linalg.norm(right)
    up = np.cross(normal, right)
    up *= np.sign(up @ axes[1]) or 1.0
    from_middle = rays.points[where].astype(np.float64) - np.array(contact.point)
    offsets = np.stack([from_middle @ right, from_middle @ up], axis=1)
    length = np.linalg.norm(offsets, axis=1, keepdims=True)
    angle = np.degrees(np.arcsin(np.minimum(length / radius, 1.0)))
    rows, columns = np.nonzero(where)
    places = np.stack(
        [(columns + 0.5) / width * 2.0 - 1.0, (rows + 0.5) / height * 2.0 - 1.0], axis=1
    )
    return _Ball(where, offsets, radius, offsets / np.maximum(length, 1e-12) * angle, places)


def _pixels(picture: FloatArray, untouched: FloatArray, ball: _Ball) -> Pixels:
    return Pixels(picture[ball.where], untouched[ball.where], ball.places)


def _judged(normals: FloatArray, ball: _Ball) -> tuple[float, float]:
    """Return the ratio of the radius that is read to the ball's, at most `FLATTEST`, and the mean
    angle between normals, degrees.
    """
    off = angles_between(normals, tilts_to_normals(ball.tilts))
    along = float((ball.offsets * normals[:, :2]).sum())
    curved = float((ball.offsets**2).sum()) / (FLATTEST * ball.radius)
    return FLATTEST * curved / max(along, curved), float(np.mean(off))

"""Cross-readings: a reader that is calibrated on a model reads photographs, and the reverse.

The reader is a polynomial of degree two of the changes of R, G and B and of the place in the
picture, fitted by ridge regression (Hoerl and Kennard 1970) to the contacts of the presses, where
the ball determines the tilt of the skin. Readers of real sensors are also calibrated on presses of
a ball. With a model that represents a sensor, the model's reader reads the sensor's balls in their
true size, as precisely as a reader that is calibrated on other photographs.

The reader of the objective `reading` (`optisense.reading.lookup`) is made for presses all over the
picture. Photographs of a GelSight Mini, whose presses lie at one side, are read by it with an error
of 6.0 degrees, and by this one with 5.1, if each is calibrated on the other photographs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import FloatArray
from optisense.calibration._far_field import without_drift
from optisense.calibration.model_pictures import ModelPictures
from optisense.calibration.photographs import Photographs
from optisense.calibration.realism import (
    FLATTEST,
    CrossReading,
    Realism,
    distances,
    realism,
)
from optisense.calibration.seen_contacts import SeenContact
from optisense.geometry import Sphere
from optisense.reading.lookup import Pixels, tilts_to_normals
from optisense.reading.tilts import angles_between

if TYPE_CHECKING:
    from sklearn.pipeline import Pipeline

    from optisense.geometry import Contact
    from optisense.optics import ChiefRays, OpticalModel

INSIDE = 0.9
"""Radius up to which pixels of a contact are read, in radii of the contact: at the edge, hand
labels and detected positions are off by a tenth.
"""

FEWEST = 3
"""Smallest number of presses to calibrate a reader from; fewer do not represent other places."""

FEWEST_ALONE = 7
"""Smallest number of presses of which each is read by a reader that is calibrated on the others.
Six places determine the six terms of a polynomial of degree two of the place.
"""

DEGREE = 2
"""Degree of the reader's polynomial. If photographs of a GelSight Mini are read by readers that are
calibrated on the others, the largest error is 7 degrees with degree 2, and 30 with degree 3.
"""

RIDGE = 1.0
"""Weight of the squared coefficients, in units of one pixel's squared error. It only keeps the
coefficients of channels without light finite: with 0.1 and 100 errors are within 0.2 degrees.
"""

NOISE_SEED = 0
"""Seed of the noise that is added to the model's pictures, so that figures repeat."""


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
    """Return all figures of a model's pictures beside photographs of the same presses."""
    found = realism(photographs, seen, pictures)
    # Far from a contact, a response is the noise of two photographs.
    noise = found.median("far_real") / np.sqrt(2.0)
    rays, axes = model.chief_rays(photographs.size), model.design.camera.axes()
    readings = cross_readings(photographs, seen, pictures, rays, axes, float(noise))
    return replace(found, readings=readings)


def cross_readings(
    photographs: Photographs,
    seen: Sequence[SeenContact],
    pictures: ModelPictures,
    rays: ChiefRays,
    axes: FloatArray,
    noise: float,
) -> tuple[CrossReading, ...]:
    """Calibrate a reader on the model and one on the photographs of the same presses, and return a
    reading of the other's contact for each press; none if there are fewer than three.

    Noise of the photographs, of this standard deviation in levels, is added to the model's
    pictures, because a reader that knows no noise amplifies it. The rays are the model's chief rays
    at the photographs' size, and the axes (3, 3) the camera's right, up and viewing direction.
    """
    if len(seen) < FEWEST:
        return ()
    balls = [
        _ball(place, contact, rays, axes)
        for place, contact in zip(seen, pictures.contacts, strict=True)
    ]
    random = np.random.default_rng(NOISE_SEED)

    def noisy(picture: FloatArray) -> FloatArray:
        return picture + noise * random.standard_normal(picture.shape)

    ground = photographs.background.astype(np.float64)
    steady = [
        ground + without_drift(press.picture - ground, distances(ground.shape[:2], place))
        for press, place in zip(photographs.presses, seen, strict=True)
    ]
    real = _pixels_of(steady, ground, balls)
    shown = _pixels_of(
        [noisy(picture) for picture in pictures.presses], noisy(pictures.background), balls
    )
    of_model, of_photographs = _reader(shown, balls), _reader(real, balls)
    found = []
    for index, (press, ball) in enumerate(zip(photographs.presses, balls, strict=True)):
        forth = _judged(of_model, real[index], ball)
        back = _judged(of_photographs, shown[index], ball)
        alone: tuple[float | None, float | None] = None, None
        if len(balls) >= FEWEST_ALONE:
            others = _reader(real[:index] + real[index + 1 :], balls[:index] + balls[index + 1 :])
            alone = _judged(others, real[index], ball)
        found.append(CrossReading(press.name, *forth, *back, *alone))
    return tuple(found)


def _reader(known: Sequence[Pixels], balls: Sequence[_Ball]) -> Pipeline:
    """Return a polynomial that maps changes of colour and places to tilts, fitted by ridge
    regression; its variables and its terms are standardised.
    """
    from sklearn.linear_model import Ridge  # takes a second to load
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import PolynomialFeatures, StandardScaler

    terms = PolynomialFeatures(DEGREE, include_bias=False)
    polynomial = make_pipeline(StandardScaler(), terms, StandardScaler(), Ridge(RIDGE))
    return polynomial.fit(
        np.concatenate([_variables(each) for each in known]),
        np.concatenate([ball.tilts for ball in balls]),
    )


def _variables(pixels: Pixels) -> FloatArray:
    """Return the changes of R, G and B, and the places, (n, 5)."""
    return np.concatenate([pixels.picture - pixels.untouched, pixels.places], axis=1)


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


def _pixels_of(
    pictures: Sequence[FloatArray], untouched: FloatArray, balls: Sequence[_Ball]
) -> list[Pixels]:
    """Return the pixels of each picture in its contact."""
    return [
        Pixels(picture[ball.where], untouched[ball.where], ball.places)
        for picture, ball in zip(pictures, balls, strict=True)
    ]


def _judged(reader: Pipeline, pixels: Pixels, ball: _Ball) -> tuple[float, float]:
    """Return the ratio of the radius that a reader reads to the ball's, at most `FLATTEST`, and the
    mean angle between normals, degrees.
    """
    normals = tilts_to_normals(reader.predict(_variables(pixels)))
    off = angles_between(normals, tilts_to_normals(ball.tilts))
    along = float((ball.offsets * normals[:, :2]).sum())
    curved = float((ball.offsets**2).sum()) / (FLATTEST * ball.radius)
    return FLATTEST * curved / max(along, curved), float(np.mean(off))

"""Differences between a model's pictures and photographs of the real sensor.

A *response* is a picture with something pressed in minus the picture with nothing; that of
photographs is also without the drift between both (`optisense.calibration._far_field`). All figures
of presses compare responses, in two regions: the *contact*, a disc, and the *ring* around it, from
1.1 to 1.6 radii, where an elastic skin is pulled in. The similarity of whole pictures says little:
the bare background reaches 0.975 there.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from optisense.array_types import FloatArray
from optisense.calibration._far_field import FAR, drift, without_noise
from optisense.calibration.model_pictures import ModelPictures
from optisense.calibration.photographs import Photographs
from optisense.calibration.seen_contacts import SeenContact

RING = 1.1, 1.6
"""Inner and outer edge of the ring, in radii of the contact: the inner edge leaves out the
contact's own edge, which labels give to a tenth, and an elastic skin is steepest inside the outer
one."""

PATCH = 1.35
"""Radius of the patch over which the unexplained energy and the similarity are measured, in radii
of the contact: it contains the contact and the steepest part of the skin around it.
"""

SIMILARITY_WINDOW = 0.2
"""Standard deviation of the similarity's window, in radii of the contact: about six pixels. In that
of 1.5 pixels of Wang et al. (2004), noise outweighs the response of a smooth ball."""

LEVELS = 255.0
"""Range of a picture's levels, from which the constants of the similarity follow."""

SIMILARITY_CONSTANTS = (0.01 * LEVELS) ** 2, (0.03 * LEVELS) ** 2
"""Constants that keep the similarity finite in dark and uniform places (Wang et al. 2004)."""

NOISE_SEED = 0
"""Seed of the noise with which the similarity of a model without errors is computed, so that the
same photographs give the same figures."""

FLATTEST = 100.0
"""Largest ratio of a read radius to the true one, which stands for a flat contact: a reader that
sees no curvature reads it. Readers that see a ball are off by some tenths."""


@dataclass(frozen=True)
class NoiseFigures:
    """Figures that a model without any error would have, because photographs are noisy.

    Attributes:
        unexplained, contact, ring, similarity: see `PressRealism`.
    """

    unexplained: float
    contact: float
    ring: float
    similarity: float


@dataclass(frozen=True)
class PressRealism:
    """Differences between the model and one photograph of a press, in levels of 255.

    Attributes:
        name: name of the photograph.
        unexplained: ratio of the energy of the error to that of the real response, in the patch of
            1.35 radii.
        contact: ratio of the root mean square of the error to that of the response, in the contact.
        ring: the same ratio in the ring.
        strength: root mean square of the real response in the contact, levels.
        far: root mean square of the error beyond three radii, levels.
        far_real: root mean square of the real response beyond three radii, which is mostly noise,
            levels.
        far_smooth: root mean square of the part of the error beyond three radii that is not noise,
            levels; it contains the drift.
        drift: mean of the difference between photograph and background beyond three radii, for R, G
            and B, levels. It is subtracted before all other figures are computed.
        similarity: structural similarity (SSIM) of the responses, mean over the patch.
        turn: angles between the directions in which the model and the sensor brighten over the
            contact, for R, G and B, degrees.
        gain: ratio of the model's brightening along the sensor's way to the sensor's, R, G, B.
        noise: figures of a model without errors.
    """

    name: str
    unexplained: float
    contact: float
    ring: float
    strength: float
    far: float
    far_real: float
    far_smooth: float
    drift: tuple[float, float, float]
    similarity: float
    turn: tuple[float, float, float]
    gain: tuple[float, float, float]
    noise: NoiseFigures


@dataclass(frozen=True)
class CrossReading:
    """Readings of one contact by readers that were calibrated on the other's pictures.

    Attributes:
        name: name of the photograph.
        radius: ratio of the ball's radius that a reader calibrated on the model reads in the
            photograph to the true one; 100 (`FLATTEST`) if it sees no curvature.
        degrees: mean angle between the normals that it reads and the ball's, degrees.
        radius_back, degrees_back: the same of a reader that is calibrated on the photographs, in
            the model's picture.
        radius_alone, degrees_alone: the same of a reader that is calibrated on the other
            photographs, in this photograph: what the photographs permit without any model; None if
            they are too few.
    """

    name: str
    radius: float
    degrees: float
    radius_back: float
    degrees_back: float
    radius_alone: float | None
    degrees_alone: float | None


@dataclass(frozen=True)
class BackgroundRealism:
    """Differences between the model's untouched picture and the real one, for R, G and B.

    Attributes:
        correlation: correlation of the pixels.
        real, model: mean levels.
        error: root mean square of the difference, levels.
        ratio: peak signal-to-noise ratio over all three channels, dB.
    """

    correlation: tuple[float, float, float]
    real: tuple[float, float, float]
    model: tuple[float, float, float]
    error: tuple[float, float, float]
    ratio: float


@dataclass(frozen=True)
class Realism:
    """Differences between a model and photographs.

    Attributes:
        background: differences of the untouched sensor.
        presses: differences of each press.
        exposure: exposure of the model's pictures.
        readings: readings of each press; none if there are too few to calibrate a reader.
    """

    background: BackgroundRealism
    presses: tuple[PressRealism, ...]
    exposure: float
    readings: tuple[CrossReading, ...] = ()

    def median(self, name: str) -> float:
        """Return the median over the presses of one of their figures."""
        return float(np.median([getattr(press, name) for press in self.presses]))

    def median_of_noise(self, name: str) -> float:
        """Return the median over the presses of one of the figures of a model without errors."""
        return float(np.median([getattr(press.noise, name) for press in self.presses]))

    def median_reading(self, name: str) -> float:
        """Return the median over presses of one of the figures of readings; NaN without any."""
        values = [value for each in self.readings if (value := getattr(each, name)) is not None]
        return float(np.median(values)) if values else math.nan

    def as_data(self) -> dict[str, Any]:
        """Return all figures, ready for JSON."""
        return asdict(self)


def sees_no_curvature(radius: float) -> bool:
    """Return whether a ratio of radii, or the median of ratios, stands for a flat contact.

    The median of an even number, of which half stand for it, is half of `FLATTEST` or more.
    """
    return radius >= 0.5 * FLATTEST


def realism(
    photographs: Photographs, seen: Sequence[SeenContact], pictures: ModelPictures
) -> Realism:
    """Compare a model's pictures with photographs of the same presses."""
    real = photographs.background.astype(np.float64)
    presses = tuple(
        _press(
            press.name,
            press.picture.astype(np.float64) - real,
            shown - pictures.background,
            place,
        )
        for press, shown, place in zip(photographs.presses, pictures.presses, seen, strict=True)
    )
    return Realism(_background(real, pictures.background), presses, pictures.exposure)


def _press(name: str, real: FloatArray, model: FloatArray, seen: SeenContact) -> PressRealism:
    """Return the figures of one press, from differences (h, w, 3) from the untouched pictures."""
    distance = distances(real.shape[:2], seen)
    drifted = drift(real, distance)
    far_smooth = without_noise(model - real, distance > FAR)
    real = real - drifted
    regions = {
        "contact": distance <= 1.0,
        "ring": (distance >= RING[0]) & (distance <= RING[1]),
        "patch": distance <= PATCH,
    }
    contact, patch, far = regions["contact"], regions["patch"], distance > FAR
    error = model - real
    # Ratio of the energies of error and response in each region.
    shares = {
        name: _square(error[where]) / max(_square(real[where]), 1e-12)
        for name, where in regions.items()
    }
    window, noise = SIMILARITY_WINDOW * seen.radius, math.sqrt(_square(real[far]))
    turns, gains = zip(
        *(_brightening(real, model, c, seen, contact) for c in range(3)), strict=True
    )
    return PressRealism(
        name=name,
        unexplained=shares["patch"],
        contact=math.sqrt(shares["contact"]),
        ring=math.sqrt(shares["ring"]),
        strength=math.sqrt(_square(real[contact])),
        far=math.sqrt(_square(error[far])),
        far_real=noise,
        far_smooth=far_smooth,
        drift=_each(drifted.tolist()),
        similarity=float(similarity(real, model, window)[patch].mean()),
        turn=turns,
        gain=gains,
        noise=_noise_figures(real, regions, window, noise),
    )


def _noise_figures(
    real: FloatArray, regions: Mapping[str, NDArray[np.bool_]], window: float, noise: float
) -> NoiseFigures:
    """Return the figures of a model without errors, for noise of a standard deviation in levels."""
    shares = {name: noise**2 / max(_square(real[where]), 1e-12) for name, where in regions.items()}
    smooth = np.asarray(gaussian_filter(real, (0.5 * window, 0.5 * window, 0.0)))
    noisy = smooth + noise * np.random.default_rng(NOISE_SEED).standard_normal(real.shape)
    return NoiseFigures(
        unexplained=shares["patch"],
        contact=math.sqrt(shares["contact"]),
        ring=math.sqrt(shares["ring"]),
        similarity=float(similarity(noisy, smooth, window)[regions["patch"]].mean()),
    )


def distances(shape: tuple[int, ...], seen: SeenContact) -> FloatArray:
    """Return the distances (h, w) of pixels from the contact's middle, in its radii."""
    rows, columns = np.mgrid[: shape[0], : shape[1]] + 0.5
    found = np.hypot(columns - seen.centre[0], rows - seen.centre[1])
    return np.asarray(found / max(seen.radius, 1e-9))


def _brightening(
    real: FloatArray, model: FloatArray, channel: int, seen: SeenContact, where: NDArray[np.bool_]
) -> tuple[float, float]:
    """Return the angle, degrees, by which the model's brightening over a contact is turned, and its
    gain.

    The response of a channel over the contact is fitted by a plane; its slope points in the
    direction in which the channel brightens.
    """
    rows, columns = np.nonzero(where)
    x, y = columns + 0.5 - seen.centre[0], rows + 0.5 - seen.centre[1]
    plane = np.stack([x, y, np.ones_like(x)], axis=1)
    both = np.stack([real[where][:, channel], model[where][:, channel]], axis=1)
    one, other = np.linalg.lstsq(plane, both, rcond=None)[0][:2].T
    length = max(float(np.hypot(*one)), 1e-12)
    turn = math.degrees(math.atan2(one[0] * other[1] - one[1] * other[0], float(one @ other)))
    return turn, float(np.hypot(*other)) / length


def similarity(one: FloatArray, other: FloatArray, window: float) -> FloatArray:
    """Return the structural similarity (h, w) of two pictures (h, w, 3) in levels, mean over the
    channels, with a Gaussian window of a standard deviation in pixels (Wang, Bovik, Sheikh and
    Simoncelli 2004).
    """

    def blurred(values: FloatArray) -> FloatArray:
        return np.asarray(gaussian_filter(values, (window, window, 0.0)))

    c1, c2 = SIMILARITY_CONSTANTS
    a, b = blurred(one), blurred(other)
    aa, bb, ab = blurred(one * one) - a * a, blurred(other * other) - b * b, blurred(one * other)
    ab -= a * b
    found = (2.0 * a * b + c1) * (2.0 * ab + c2) / ((a * a + b * b + c1) * (aa + bb + c2))
    return np.asarray(found.mean(axis=2))


def _background(real: FloatArray, model: FloatArray) -> BackgroundRealism:
    error = _square(model - real)
    return BackgroundRealism(
        correlation=_each([correlation(real[..., c], model[..., c]) for c in range(3)]),
        real=_each([float(real[..., c].mean()) for c in range(3)]),
        model=_each([float(model[..., c].mean()) for c in range(3)]),
        error=_each([math.sqrt(_square(model[..., c] - real[..., c])) for c in range(3)]),
        ratio=10.0 * math.log10(LEVELS**2 / max(error, 1e-6)),
    )


def correlation(one: FloatArray, other: FloatArray) -> float:
    """Return the correlation of two pictures over all pixels; 0 if one of them is uniform."""
    spread = float(one.std() * other.std())
    if spread < 1e-9:
        return 0.0
    return float(((one - one.mean()) * (other - other.mean())).mean()) / spread


def _square(values: FloatArray) -> float:
    return float((values**2).mean()) if values.size else 0.0


def _each(values: list[float]) -> tuple[float, float, float]:
    return values[0], values[1], values[2]

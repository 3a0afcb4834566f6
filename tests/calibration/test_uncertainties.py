"""Stated uncertainties of fits, against the scatter of repeated fits and against hidden numbers."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

import optisense as ots
from optisense.calibration import Photographs
from optisense.calibration._gauss_newton import LayeredFit
from optisense.calibration._least_squares import jackknife_covariance
from optisense.calibration.model_pictures import (
    LayeredPictures,
    PictureSlopes,
    averaged,
    layered_pictures,
)
from optisense.calibration.quantities import quantities_of
from optisense.calibration.seen_contacts import ContactFinder, SeenContact

from .conftest import PHOTONS, with_pictures

if TYPE_CHECKING:
    from optisense.optics import OpticalModel

CLUSTERS, ROWS, UNKNOWNS = 12, 200, 5
"""Size of a linear fit: as many clusters as there are blocks in a picture of 4 to 3."""

LIGHT_NOISE = 0.02
"""Standard deviation of the noise of the light, as a share of it: that of some million photons."""


@pytest.fixture(scope="module")
def seen(photographs: Photographs) -> list[SeenContact]:
    """The contacts in photographs whose noise of the light has its usual extent in pixels."""
    return [place for place in ContactFinder(photographs).contacts() if place is not None]


@pytest.fixture(scope="module")
def layers(
    mini: OpticalModel, photographs: Photographs, seen: list[SeenContact]
) -> LayeredPictures:
    """The layers of these photographs; tests don't change them."""
    return layered_pictures(mini, photographs, seen, PHOTONS, 5)


def test_the_jackknife_states_the_scatter_of_fits_with_correlated_errors() -> None:
    rng = np.random.default_rng(2)
    slopes = 5.0 * rng.standard_normal((CLUSTERS, ROWS, UNKNOWNS))
    slopes += 10.0 * rng.standard_normal((CLUSTERS, 1, UNKNOWNS))  # smooth, as of pictures
    matrices = np.einsum("cri,crj->cij", slopes, slopes)
    total = matrices.sum(axis=0) + np.eye(UNKNOWNS)
    found, stated = [], []
    for _ in range(400):
        errors = rng.standard_normal((CLUSTERS, ROWS)) + rng.standard_normal((CLUSTERS, 1))
        unknowns = np.linalg.solve(total, np.einsum("cri,cr->i", slopes, errors))
        residuals = errors - slopes @ unknowns
        scores = np.einsum("cri,cr->ci", slopes, residuals)
        found.append(unknowns)
        stated.append(np.diag(jackknife_covariance(matrices, scores)))
    scatter = np.var(found, axis=0)
    independent = 2.0 * np.diag(np.linalg.inv(total))  # as if each error were independent
    assert (independent < 0.25 * scatter).all()
    ratio = np.mean(stated, axis=0) / scatter
    assert (ratio > 0.9).all(), ratio
    assert (ratio < 1.8).all(), ratio  # the jackknife overestimates for few clusters


def test_the_priors_are_the_uncertainty_without_information() -> None:
    found = jackknife_covariance(np.zeros((3, 2, 2)), np.zeros((3, 2)))
    assert found == pytest.approx(np.eye(2))


def test_dark_places_mislead_no_fit_that_knows_the_noise_of_the_light(
    photographs: Photographs, seen: list[SeenContact], layers: LayeredPictures
) -> None:
    """The tone curve is steep in the dark, and makes errors of the light large there."""

    def noisy(rng: np.random.Generator) -> LayeredPictures:
        shape = layers.background.shape
        white = rng.standard_normal(shape)
        smooth = gaussian_filter(white, (0.0, 4.0, 4.0, 0.0))
        factor = (1.0 + LIGHT_NOISE * smooth / smooth.std()).astype(np.float32)
        return replace(layers, pictures=tuple(factor * each for each in layers.pictures))

    chosen = quantities_of(ots.load("gelsight-mini-ideal"), ("colours", "tone", "black"))
    truth = np.array([-0.8, 0.3, 1.0, -0.2, -0.8, 0.9, 0.4, 0.6, 0.4, 0.9])
    still = np.zeros((len(seen), 3))
    made = LayeredFit(photographs, seen, layers, chosen, 250.0, truth, {})
    real = with_pictures(photographs, made.pictures(truth, still))
    assert (real.background < 60).mean() > 0.02  # some places are dark
    errors: list[list[np.ndarray]] = [[], []]  # without and with the noise
    for seed in (4, 5):
        rng = np.random.default_rng(seed)
        mean, noise = averaged(noisy(rng), noisy(rng))
        start = truth + 0.15 * rng.standard_normal(len(truth))
        for known, each in zip((None, noise), errors, strict=True):
            fit = LayeredFit(real, seen, mean, chosen, 250.0, start, {}, known)
            found = fit.solve(start, still)
            each.append(found.steps - truth)
        deviations = np.sqrt(np.diag(found.covariance))
        assert (np.abs(errors[1][-1]) < 3.0 * deviations).all(), errors[1][-1] / deviations
    # With six seeds, the ratio is 0.83; those of single seeds are 0.72 to 0.93.
    without, with_noise = (float(np.sqrt(np.mean(np.square(each)))) for each in errors)
    assert with_noise < 0.9 * without, (without, with_noise)


def test_noise_of_slopes_is_no_information(
    photographs: Photographs, seen: list[SeenContact], layers: LayeredPictures
) -> None:
    """Slopes from two renderings show a true change, or nothing but noise."""
    rng = np.random.default_rng(6)
    chosen = quantities_of(
        ots.load("gelsight-mini-ideal"), ("powers",), [("coating.specularity", 0.0, 0.4)]
    )
    still, start, off = np.zeros((len(seen), 3)), np.zeros(4), 1.5
    pictures = layers.pictures
    rows, columns = np.mgrid[: pictures[0].shape[1], : pictures[0].shape[2]] / 20.0
    pattern = 0.02 * (np.sin(rows) * np.cos(columns))[..., None]
    true = [(pattern * each).astype(np.float32) for each in pictures]

    def noisy(size: float) -> list[np.ndarray]:  # type: ignore[type-arg]
        return [
            (size * each * rng.standard_normal(each.shape)).astype(np.float32) for each in pictures
        ]

    moved = layers.plus([np.float32(off) * slope for slope in true])
    made = LayeredFit(photographs, seen, moved, chosen, 250.0, start, {})
    levels = made.pictures(start, still)
    real = with_pictures(photographs, [each + rng.standard_normal(each.shape) for each in levels])
    mean, noise = averaged(layers, layers)
    found = []
    for signal, size in ((1.0, 0.002), (0.0, 0.01)):
        two = [
            [
                np.float32(signal) * slope + error
                for slope, error in zip(true, noisy(size), strict=True)
            ]
            for _ in range(2)
        ]
        slopes = {3: PictureSlopes.of_two(*two)}
        fit = LayeredFit(real, seen, mean, chosen, 250.0, start, slopes, noise)
        solution = fit.solve(start, still)
        found.append((solution.steps[3], np.sqrt(solution.covariance[3, 3])))
    (step, deviation), (_, unknown) = found
    assert abs(step - off) < 1.5 * deviation < 0.1  # with all of the noise, 2.2 deviations less
    assert unknown > 0.9  # with all of the noise, 0.04

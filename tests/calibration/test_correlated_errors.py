"""The number of pixels for which there is one independent error, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from optisense.calibration._error_scales import UNCORRELATED, correlated_pixels

SIZE = (240, 320)


def noise(deviation: float) -> np.ndarray:  # type: ignore[type-arg]
    """Noise (h, w, 3) that a Gaussian filter of this standard deviation has smoothed."""
    white = np.random.default_rng(3).standard_normal((*SIZE, 3))
    return gaussian_filter(white, (deviation, deviation, 0.0)) if deviation else white


def test_each_pixel_of_white_noise_has_an_error_of_its_own() -> None:
    assert correlated_pixels([noise(0.0)], [np.ones(SIZE, bool)]) == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("deviation", [2.0, 5.0])
def test_smoothed_noise_is_correlated_over_the_area_of_its_filter(deviation: float) -> None:
    """Its correlation is exp(-d^2 / 4 s^2), whose integral is 4 pi s^2; 0.9 of it lies within the
    distance where it falls to 0.1."""
    expected = (1.0 - UNCORRELATED) * 4.0 * np.pi * deviation**2
    everywhere = np.ones(SIZE, bool)
    found = correlated_pixels([noise(deviation)], [everywhere])
    assert found == pytest.approx(expected, rel=0.15)
    assert correlated_pixels([noise(deviation)], [slice(None)]) == found
    rows, columns = np.mgrid[: SIZE[0], : SIZE[1]]
    disc = np.hypot(rows - 120, columns - 160) < 90  # as of the pixels around a contact
    assert correlated_pixels([noise(deviation)], [disc]) == pytest.approx(expected, rel=0.3)


def test_an_error_of_the_whole_picture_is_summed_over_a_limited_extent() -> None:
    found = correlated_pixels([np.ones((*SIZE, 3))], [np.ones(SIZE, bool)])
    assert found == pytest.approx(np.pi * (0.2 * SIZE[1]) ** 2, rel=0.05)
    assert correlated_pixels([np.zeros((*SIZE, 3))], [np.ones(SIZE, bool)]) == 1.0

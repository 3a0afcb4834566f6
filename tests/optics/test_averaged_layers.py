"""Averaging of light over the pixels of a film."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from optisense.optics.imaging._film import Film
from optisense.optics.transport.camera_paths import VisiblePoints


def film_of(values: np.ndarray) -> Film:
    """A film of one group with one sample of each pixel of (h, w)."""
    pixel = dr.arange(mi.UInt32, values.size)
    points = dr.zeros(VisiblePoints, values.size)
    points.valid, points.weight, points.pixel = mi.Bool(True), mi.Color3f(1), pixel
    film = Film(values.size, 1)
    film.count(pixel)
    film.add(points, [mi.Color3f(mi.Float(values.ravel().astype(np.float32)))])
    return film


def test_spreading_keeps_even_light_and_the_sum_of_a_bright_sample() -> None:
    where = np.ones((40, 40), dtype=bool)
    where[:, :5] = False
    even = film_of(np.full((40, 40), 3.0)).averaged_layers(40, 40, [(where, 5)])
    assert even == pytest.approx(3.0, rel=1e-5)
    spark = np.zeros((40, 40))
    spark[20, 20], spark[10, 2] = 1.0, 1.0
    spread = film_of(spark).averaged_layers(40, 40, [(where, 5)])[0, ..., 0]
    assert spread[where].sum() == pytest.approx(1.0, rel=1e-5)
    assert spread[20, 20] < 0.1 and (spread[where] > 0).sum() > 30
    assert spread[10, 2] == 1.0 and not spread[~where].sum() > 1.0


def test_averaging_without_blur_keeps_a_peak() -> None:
    across = np.arange(40) - 20.0
    peak = 500.0 - across[:, None] ** 2 - across[None, :] ** 2
    where = np.ones((40, 40), dtype=bool)
    region = [(where, 5)]
    blurred, kept = (film_of(peak).averaged_layers(40, 40, region, each) for each in (False, True))
    # Away from the border, the kernel lowers this peak by its variance: twice that of two squares.
    assert blurred[0, 20, 20, 0] == pytest.approx(500.0 - 8.0, rel=1e-5)
    assert kept[0, 20, 20, 0] == pytest.approx(500.0, rel=1e-5)

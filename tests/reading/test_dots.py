"""Dots that are drawn into a picture are found where they were drawn."""

import numpy as np
import pytest

from optisense.reading.dots import dots_in_picture


def drawn(places, radius=3.0, shade=0.0, noise=0.0):
    """A grey picture (90, 120, 3) with soft dark discs at places (n, 2) of column and row."""
    rows, columns = np.indices((90, 120)) + 0.5
    picture = 150.0 + shade * columns
    for column, row in places:
        away = np.hypot(columns - column, rows - row)
        picture = picture * (1.0 - 0.8 * np.clip(0.5 + radius - away, 0.0, 1.0))
    picture = picture + np.random.default_rng(0).normal(0.0, noise, picture.shape)
    return np.repeat(picture[..., None], 3, axis=2).clip(0, 255).astype(np.uint8)


GRID = np.array([(x, y) for y in (20.0, 45.0, 70.0) for x in (20.0, 45.0, 70.0, 95.0)])


@pytest.mark.parametrize(("shade", "noise"), [(0.0, 0.0), (0.5, 0.0), (0.0, 2.0)])
def test_dots_that_moved_are_found_to_a_tenth_of_a_pixel(shade, noise):
    moved = GRID + np.random.default_rng(1).uniform(-4.0, 4.0, GRID.shape)
    found = dots_in_picture(drawn(moved, shade=shade, noise=noise), GRID)
    assert found == pytest.approx(moved, abs=0.15)


def test_a_dot_that_is_not_there_is_not_found():
    known = GRID.copy()
    known[0] = np.nan
    found = dots_in_picture(drawn(GRID[2:]), known)
    assert np.isnan(found[:2]).all()
    assert np.isfinite(found[2:]).all()
    assert np.isnan(dots_in_picture(drawn([]), GRID)).all()

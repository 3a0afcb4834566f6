"""A view is moved until what it shows fills the part that the sidebar leaves free."""

from __future__ import annotations

import numpy as np
import pytest

from studio.core.fitting import ROOM, fitted, on_screen

SIZE, FREE, FOCAL = (800.0, 600.0), (0.0, 500.0), 555.0
"""Sizes (pixels) of a view and of the part of it beside a sidebar on the right, and its focal
length."""


@pytest.mark.parametrize("stretched", [(1, 1, 1), (20, 1, 1), (1, 1, 20)])
@pytest.mark.parametrize("middle", [(0, 0, 0), (40, -25, 10)])
def test_points_fill_the_free_part_of_a_view(stretched: tuple[int, ...], middle: tuple[int, ...]):
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    corners = np.stack(np.meshgrid(*[[-1.0, 1.0]] * 3), axis=-1).reshape(-1, 3)
    points = corners * stretched + middle
    found = fitted(points, turn, FOCAL, SIZE, FREE)
    seen = on_screen(points, turn, found, FOCAL, SIZE)
    low, high = seen.min(axis=0), seen.max(axis=0)
    assert (low + high) / 2 == pytest.approx((250.0, 300.0), abs=3.0)
    shares = (high - low) / ((FREE[1] - FREE[0]) * ROOM, SIZE[1] * ROOM)
    assert shares.max() == pytest.approx(1.0, abs=0.02), "it is as large as there is room for"

"""Ranges in colour boxes against all pairs, and what they cost."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from optisense.objectives import _colour_boxes
from optisense.objectives._colour_boxes import ranges_in_boxes

Points = tuple[np.ndarray, ...]


def all_pairs(
    colours: np.ndarray,
    low: np.ndarray,
    high: np.ndarray,
    theta: np.ndarray,
    phi: np.ndarray,
    counts: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """The same, point by point; the arc as the circle less its widest gap."""
    tilts, arcs = np.zeros(len(colours)), np.zeros(len(colours))
    for j in range(len(colours)):
        inside = ((colours >= low[j]) & (colours <= high[j])).all(axis=1)
        tilts[j] = np.ptp(theta[inside])
        around = np.sort(phi[inside & counts] % 360)
        if counts[j]:
            gaps = np.diff(np.append(around, around[0] + 360))
            arcs[j] = min(360 - gaps.max(), 180)
    return tilts, arcs


def random_points(count: int, seed: int) -> Points:
    rng = np.random.default_rng(seed)
    theta, phi = 40 * np.sqrt(rng.random(count)), 360 * rng.random(count) - 180
    colours = 0.1 + 0.9 * rng.random((count, 3))
    return colours, 0.7 * colours, 1.3 * colours, theta, phi, theta > 2


def ball_points(count: int, seed: int) -> Points:
    """As a sensor with three coloured lights sees a ball."""
    rng = np.random.default_rng(seed)
    theta, phi = 40 * np.sqrt(rng.random(count)), 360 * rng.random(count)
    t, p = np.radians(theta), np.radians(phi)
    normals = np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], axis=1)
    azimuths = np.radians([0.0, 120.0, 240.0])
    ways = np.stack([0.8 * np.cos(azimuths), 0.8 * np.sin(azimuths), np.full(3, 0.6)], axis=1)
    colours = np.maximum(normals @ ways.T, 0)
    width = np.maximum(0.1 * colours, 1 / 255)
    return colours, colours - width, colours + width, theta, phi, theta > 2


@pytest.mark.parametrize("block", [1, 7, 64, 5000])
@pytest.mark.parametrize("points", [random_points, ball_points])
def test_ranges_are_those_of_all_pairs(
    points: object, block: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert callable(points)
    monkeypatch.setattr(_colour_boxes, "BLOCK", block)
    monkeypatch.setattr(_colour_boxes, "ONE_BLOCK", block)
    given = points(1500, seed=block)
    tilts, arcs = ranges_in_boxes(*given)
    right_tilts, right_arcs = all_pairs(*given)
    assert np.allclose(tilts, right_tilts, atol=1e-9)
    assert np.allclose(arcs, right_arcs, atol=1e-9)
    assert 0 < np.mean(arcs) < 180


def test_azimuths_on_both_sides_of_180_are_near_each_other() -> None:
    colours = np.full((3, 3), 0.5)
    phi = np.array([179.0, -178.0, 175.0])
    every = np.ones(3, dtype=bool)
    _, arcs = ranges_in_boxes(colours, colours, colours, np.full(3, 20.0), phi, every)
    assert arcs == pytest.approx([7.0] * 3)


def test_equal_colours_are_all_confused() -> None:
    theta, phi = np.linspace(0, 30, 400), np.linspace(0, 359, 400)
    colours = np.full((400, 3), 0.5)
    tilts, arcs = ranges_in_boxes(colours, colours, colours, theta, phi, theta > 2)
    assert np.all(tilts == 30)
    assert np.all(arcs[theta > 2] == 180)


def test_twenty_thousand_points_need_no_table_of_pairs() -> None:
    given = ball_points(20_000, seed=0)
    tracemalloc.start()
    tilts, _ = ranges_in_boxes(*given)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 40e6  # all pairs, one byte each: 400e6
    few = np.arange(0, 20_000, 2000)
    colours, low, high, theta = given[:4]
    for j in few:
        inside = ((colours >= low[j]) & (colours <= high[j])).all(axis=1)
        assert tilts[j] == pytest.approx(np.ptp(theta[inside]))

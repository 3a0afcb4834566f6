"""Smoothed scores: equal to the true ones without fading, and their derivatives by differences."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from optisense.objectives.projection_warping import triangle_areas
from optisense.objectives.smooth import SMOOTH

STEP = 1e-6


@dataclass(frozen=True)
class Rays:
    hit: np.ndarray
    cosine: np.ndarray
    weight: np.ndarray
    points: np.ndarray


def some_rays(seed: int = 0) -> Rays:
    random = np.random.default_rng(seed)
    hit = random.random((9, 12)) > 0.1
    y, x = np.nonzero(hit)
    points = np.stack([x, y, 0.02 * x**2], axis=1) + 0.1 * random.random((len(x), 3))
    return Rays(hit, random.random(len(x)), random.random(len(x)), points)


@pytest.mark.parametrize("name", SMOOTH)
@pytest.mark.parametrize("field", ["cosine", "weight", "points"])
def test_derivatives_are_those_of_central_differences(name: str, field: str) -> None:
    rays = some_rays()
    slopes = getattr(SMOOTH[name](rays), field)
    way = np.random.default_rng(1).normal(size=getattr(rays, field).shape)

    def value(step: float) -> float:
        return SMOOTH[name](replace(rays, **{field: getattr(rays, field) + step * way})).value

    differences = (value(STEP) - value(-STEP)) / (2 * STEP)
    expected = 0.0 if slopes is None else float((slopes * way).sum())
    assert expected == pytest.approx(differences, rel=1e-6, abs=1e-9)


def test_with_full_weights_aoap_is_the_mean_cosine_over_all_pixels() -> None:
    rays = some_rays()
    full = replace(rays, weight=np.ones_like(rays.weight))
    assert SMOOTH["aoap"](full).value == pytest.approx(rays.cosine.sum() / rays.hit.size)


def test_with_full_weights_2to3pw_is_that_of_the_pixels_triangles() -> None:
    rays = some_rays()
    full = replace(rays, weight=np.ones_like(rays.weight))
    grid = np.zeros((*rays.hit.shape, 3), dtype=np.float32)
    grid[rays.hit] = rays.points
    areas = triangle_areas(grid, rays.hit, jump=1e9).areas
    areas = areas[np.isfinite(areas)].astype(np.float64)
    assert SMOOTH["2to3pw"](full).value == pytest.approx(areas.mean() / areas.std(), rel=1e-4)


def test_too_few_rays_have_no_slope() -> None:
    hit = np.zeros((3, 3), dtype=bool)
    hit[1, 1] = True
    lonely = Rays(hit, np.ones(1), np.ones(1), np.zeros((1, 3)))
    found = SMOOTH["2to3pw"](lonely)
    assert found.value == 0.0
    assert not found.weight.any()

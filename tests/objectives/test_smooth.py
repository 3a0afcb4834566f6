"""Smoothed scores: equal to the true ones without fading, and their derivatives by differences."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from optisense.objectives._projection_warping import triangle_areas
from optisense.objectives.smooth import SMOOTH

STEP = 1e-6


@dataclass(frozen=True)
class Rays:
    codes: np.ndarray
    cosine: np.ndarray
    weight: np.ndarray
    points: np.ndarray
    density: np.ndarray
    surface_area: float = 2.5


def some_rays(seed: int = 0) -> Rays:
    random = np.random.default_rng(seed)
    hit = random.random((9, 12)) > 0.1
    y, x = np.nonzero(hit)
    points = np.stack([x, y, 0.02 * x**2], axis=1) + 0.1 * random.random((len(x), 3))
    codes = np.where(hit, 7, 0).astype(np.uint32)
    some = [random.random(len(x)) for _ in range(3)]
    return Rays(codes, some[0], some[1], points, some[2])


@pytest.mark.parametrize("name", SMOOTH)
@pytest.mark.parametrize("field", ["cosine", "weight", "points"])
def test_derivatives_are_those_of_central_differences(name: str, field: str) -> None:
    rays = some_rays()
    if field == "points":
        # The derivative of AOAP's coverage by points is exact for points that stay on the surface,
        # or where the surface has equally many triangles for each mm² everywhere.
        rays = replace(rays, density=np.full_like(rays.density, 0.6))
    slopes = getattr(SMOOTH[name](rays), field)
    way = np.random.default_rng(1).normal(size=getattr(rays, field).shape)

    def value(step: float) -> float:
        moved = replace(rays, **{field: getattr(rays, field) + step * way})
        return SMOOTH[name](moved).value

    differences = (value(STEP) - value(-STEP)) / (2 * STEP)
    expected = 0.0 if slopes is None else float((slopes * way).sum())
    assert expected == pytest.approx(differences, rel=1e-6, abs=1e-9)


def test_with_full_weights_aoap_is_the_mean_cosine_over_all_pixels() -> None:
    rays = some_rays()
    full = replace(rays, weight=np.ones_like(rays.weight))
    found = SMOOTH["aoap"](full, coverage_weight=0.0)
    assert found.value == pytest.approx(rays.cosine.sum() / rays.codes.size)


def test_with_full_weights_2to3pw_is_that_of_the_pixels_triangles() -> None:
    rays = some_rays()
    full = replace(rays, weight=np.ones_like(rays.weight))
    hit = rays.codes > 0
    grid = np.zeros((*hit.shape, 3), dtype=np.float32)
    grid[hit] = rays.points
    areas = triangle_areas(grid, hit, jump=1e9).areas
    areas = areas[np.isfinite(areas)].astype(np.float64)
    assert SMOOTH["2to3pw"](full).value == pytest.approx(areas.mean() / areas.std(), rel=1e-4)


def plane_view(left: float, width: float) -> Rays:
    """Rays on a plane of 0.01 triangles (as parts of all) a mm², through a picture of 8 x 6 pixels
    whose middles are `width` / 7 mm apart.
    """
    x, y = np.meshgrid(left + np.linspace(0.0, width, 8), np.linspace(0.0, 5.0, 6))
    points = np.stack([x.ravel(), y.ravel(), np.zeros(48)], axis=1)
    one = np.ones(48)
    return Rays(np.full((6, 8), 3, dtype=np.uint32), one, one, points, 0.01 * one)


def test_coverage_is_the_number_of_triangles_in_view_and_changes_at_its_border() -> None:
    rays = plane_view(0.0, 7.0)
    found = SMOOTH["aoap"](rays, coverage_weight=1.0)
    assert found.value == pytest.approx(1.0 + 0.01 * 7.0 * 5.0)
    assert found.points is not None
    wider = (plane_view(0.0, 7.0 + STEP).points - rays.points) / STEP
    assert float((found.points * wider).sum()) == pytest.approx(0.01 * 5.0, rel=1e-6)
    aside = (plane_view(STEP, 7.0).points - rays.points) / STEP
    assert float((found.points * aside).sum()) == pytest.approx(0.0, abs=1e-9)


def test_pixels_that_arrive_another_way_share_no_triangle() -> None:
    rays = some_rays()
    full = replace(rays, weight=np.ones_like(rays.weight), codes=np.full((9, 12), 7, np.uint32))
    y, x = np.mgrid[:9, :12]
    points = np.stack([x, y, 0.02 * x**2], axis=2).reshape(-1, 3).astype(float)
    full = replace(full, cosine=np.ones(108), weight=np.ones(108), density=np.ones(108))
    smooth = SMOOTH["2to3pw"](replace(full, points=points)).value
    torn = points + 100.0 * (x.reshape(-1, 1) >= 6)
    codes = np.where(x >= 6, 9, 7).astype(np.uint32)
    assert SMOOTH["2to3pw"](replace(full, points=torn)).value < 0.5 * smooth
    apart = SMOOTH["2to3pw"](replace(full, points=torn, codes=codes)).value
    assert apart == pytest.approx(smooth, rel=0.05)


def test_too_few_rays_have_no_slope() -> None:
    codes = np.zeros((3, 3), dtype=np.uint32)
    codes[1, 1] = 1
    lonely = Rays(codes, np.ones(1), np.ones(1), np.zeros((1, 3)), np.ones(1))
    found = SMOOTH["2to3pw"](lonely)
    assert found.value == 0.0
    assert not found.weight.any()

"""Blur of the radiance cache's kernel, compared with the exact light without photons."""

from __future__ import annotations

import drjit as dr
import numpy as np
import pytest

from optisense.optics.radiance_cache import smoothing
from optisense.optics.radiance_cache.smoothing import (
    MAX_RADIUS_RATIO,
    MIN_RADIUS_CELLS,
    REFERENCE_DENSITY,
    REFERENCE_LENGTH,
    REFERENCE_RADIUS,
    Kernels,
    varies_over,
)
from optisense.optics.scene.surface_cells import build_cells

SIZE = 0.3
"""Side (mm) of a cell."""
HEIGHT = 4.0
"""Height (mm) of a point light over a plane."""
DENSITY = 5e-4
"""1/mm^2: photons that land on a mm^2, of one that is sent."""
AT_DEFAULT = 0.0015
"""Relative error that remains of the blur under the light with five million photons."""


@pytest.fixture(scope="module")
def kernels() -> Kernels:
    corners = np.array([(-8.0, -8, 0), (8, -8, 0), (8, 8, 0), (-8, 8, 0)])
    cells = build_cells(corners, np.array([(0, 1, 2), (0, 2, 3)]), SIZE)
    return Kernels(cells, np.hypot(HEIGHT, np.hypot(*cells.centres[:, :2].T)), DENSITY)


def light(points: np.ndarray) -> np.ndarray:
    """(n, 1) mW/mm^2 of a point light of 4 pi mW/sr in all."""
    return (HEIGHT / (HEIGHT**2 + points[:, 0] ** 2 + points[:, 1] ** 2) ** 1.5)[:, None]


def within_cells(points: np.ndarray, size: float) -> np.ndarray:
    """(n, 1) the mean of the light over square cells around points."""
    steps = (np.arange(5) - 2) * size / 5
    moves = [(x, y, 0.0) for x in steps for y in steps]
    return np.mean([light(points + move) for move in moves], axis=0)


def as_read(values: np.ndarray, centres: np.ndarray, size: float) -> np.ndarray:
    """(n, 1) what points read in the mean, which look into a cell up to half a side away: over the
    points of a cell, three quarters of them in its own and one eighth in that on each side."""
    place = np.round((centres[:, :2] - centres[:, :2].min(axis=0)) / size).astype(int)
    grid = np.full(place.max(axis=0) + 1, np.nan)
    grid[tuple(place.T)] = values[:, 0]
    for axis in (0, 1):
        beside = np.roll(grid, 1, axis) + np.roll(grid, -1, axis)
        grid = 0.75 * grid + 0.125 * beside
    return grid[tuple(place.T)][:, None]


def errors(kernels: Kernels, photons: int) -> tuple[float, float]:
    """Relative error right under the light, without and with sharpening."""
    cells = kernels.cells
    truth = within_cells(cells.centres, SIZE)
    landed = truth * cells.areas[:, None]
    blurred = kernels.smoothing(photons).kernel @ landed
    sharp = blurred * kernels.sharpening(landed, photons)
    middle = np.hypot(*cells.centres[:, :2].T) < 1.0
    found = (as_read(each, cells.centres, SIZE) for each in (blurred, sharp))
    plain, sharpened = (float((x / truth - 1)[middle].mean()) for x in found)
    return plain, sharpened


def test_a_kernel_takes_from_a_peak_what_theory_says(kernels: Kernels) -> None:
    # The kernel's variance along an axis is r^2 / 6, the Laplacian of (h^2 + x^2 + y^2)^-3/2 on the
    # axis -6 / h^2 of it: half of one times the other.
    radius = kernels.radii(1)[np.hypot(*kernels.cells.centres[:, :2].T).argmin()]
    cells = kernels.cells
    truth = light(cells.centres)
    blurred = kernels.smoothing(1).kernel @ (truth * cells.areas[:, None])
    nearest = np.hypot(*cells.centres[:, :2].T).argmin()
    expected = -(radius**2) / (2 * HEIGHT**2)
    assert (blurred / truth - 1)[nearest, 0] == pytest.approx(expected, rel=0.15)


def test_sharpening_undoes_most_of_the_blur(kernels: Kernels) -> None:
    plain, sharp = errors(kernels, 5_000_000)
    assert plain < -0.01
    assert abs(sharp) < AT_DEFAULT


def test_sharpening_adds_no_power_at_the_edge_of_a_pool_of_light(kernels: Kernels) -> None:
    cells = kernels.cells
    pool = np.hypot(*cells.centres[:, :2].T) < 1.5
    landed = (pool * cells.areas)[:, None]
    smooth = kernels.smoothing(1_000_000).kernel @ landed
    sharp = smooth * kernels.sharpening(landed, 1_000_000)
    assert np.all(sharp >= 0)
    # The ratio of the smoothed and the twice smoothed light would add 8 %, the difference without
    # what is taken for negative light 4 %.
    assert cells.areas @ sharp == pytest.approx(cells.areas @ smooth, rel=0.01)


def test_twicing_undoes_most_of_the_blur_and_leaves_even_light_even(kernels: Kernels) -> None:
    cells = kernels.cells
    both = kernels.smoothing(5_000_000, corrected=True)
    truth = within_cells(cells.centres, SIZE)
    once = both.kernel @ (truth * cells.areas[:, None])
    twice = both.correction @ once
    middle = np.hypot(*cells.centres[:, :2].T) < 1.0
    plain, sharp = (
        float((as_read(each, cells.centres, SIZE) / truth - 1)[middle].mean())
        for each in (once, twice)
    )
    assert plain < -0.01
    assert abs(sharp) < AT_DEFAULT
    even = both.correction @ (both.kernel @ cells.areas[:, None])
    assert even == pytest.approx(np.ones_like(even), rel=1e-6)


def test_twicing_of_many_cells_increases_the_noise_as_theory_says(kernels: Kernels) -> None:
    """2 K - K * K has 1.335 times the norm of K, for Epanechnikov's kernel in the plane."""
    both = kernels.smoothing(1, corrected=True)
    middle = np.hypot(*kernels.cells.centres[:, :2].T) < 1.0
    once, twice = (
        np.sqrt(each.multiply(each) @ kernels.cells.areas)[middle].mean()
        for each in (both.kernel, (both.correction @ both.kernel).tocsr())
    )
    assert twice / once == pytest.approx(1.335, rel=0.03)


@pytest.mark.parametrize("photons", [1_000_000, 10_000_000, 40_000_000])
def test_twicing_undoes_the_blur_of_quadratic_light(kernels: Kernels, photons: int) -> None:
    """Its blur is the same everywhere and has a closed form. A kernel of few cells and that which
    undoes it may have other second moments than kernels of many cells."""
    across = kernels.cells.centres[:, 0]
    both = kernels.smoothing(photons, corrected=True)
    # A cell's mean of x^2 exceeds that at its centre by SIZE^2 / 12, and linear interpolation
    # between centres exceeds x^2 by SIZE^2 / 6 in the mean.
    once = both.kernel @ ((across**2 + SIZE**2 / 12) * kernels.cells.areas)
    middle = np.hypot(*kernels.cells.centres[:, :2].T) < 1.0
    plain, left = (
        (each - across**2)[middle].mean() + SIZE**2 / 6 for each in (once, both.correction @ once)
    )
    assert plain > 0.05
    assert abs(left) < 0.03 * plain


def test_the_blur_goes_as_photons_grow(kernels: Kernels) -> None:
    many = (5_000_000, 40_000_000, 320_000_000)
    truth = light(kernels.cells.centres)
    landed = truth * kernels.cells.areas[:, None]
    middle = np.hypot(*kernels.cells.centres[:, :2].T) < 1.0
    plain = [
        abs((kernels.smoothing(photons).kernel @ landed / truth - 1)[middle].mean())
        for photons in many
    ]
    # Eight times the photons halve the square of the radius, and so the blur.
    assert plain[1] / plain[0] == pytest.approx(0.5, abs=0.1)
    assert plain[2] / plain[0] == pytest.approx(0.25, abs=0.1)
    # With what the cells blur, which does not go away, and is undone, too.
    blurred, sharp = np.abs([errors(kernels, photons) for photons in many]).T
    assert blurred[2] > 0.008
    assert np.all(np.diff(sharp) < 0)
    assert sharp[2] < 0.0015


def test_even_light_stays_even_up_to_the_edge(kernels: Kernels) -> None:
    cells = kernels.cells
    landed = cells.areas[:, None]
    assert kernels.smoothing(1).kernel @ landed == pytest.approx(np.ones_like(landed), rel=1e-6)
    assert kernels.sharpening(landed, 1) == pytest.approx(np.ones_like(landed), rel=1e-6)


def test_a_kernel_is_narrower_near_a_lamp_and_no_wider_than_a_cell_allows(kernels: Kernels) -> None:
    distance = np.linspace(0.0, REFERENCE_LENGTH, kernels.cells.cells)
    cell = 1 / float(kernels.cells.inverse_size[0])
    radii = Kernels(kernels.cells, distance, DENSITY).radii(round(REFERENCE_DENSITY / DENSITY))
    assert np.all(np.diff(radii) >= 0)
    assert radii[0] == pytest.approx(MIN_RADIUS_CELLS * cell)
    assert radii[-1] == pytest.approx(REFERENCE_RADIUS)
    # Blur of a light as far away as light varies over, and noise, are in the same relation
    # everywhere: the radius goes as the power 2/3 of the distance.
    assert radii[len(radii) // 2] == pytest.approx(REFERENCE_RADIUS * 0.5 ** (2 / 3), rel=1e-3)


def test_a_kernel_widens_as_photons_grow_few_up_to_a_limit(kernels: Kernels) -> None:
    usual = kernels.radii(5_000_000)
    assert kernels.radii(2_500_000) == pytest.approx(usual * 2 ** (1 / 6))
    distance = np.hypot(HEIGHT, np.hypot(*kernels.cells.centres[:, :2].T))
    assert kernels.radii(1) == pytest.approx(MAX_RADIUS_RATIO * distance)
    assert np.all(kernels.radii(40_000_000) < usual)


def test_as_wide_a_kernel_where_half_the_photons_sent_land_as_with_half_of_them(
    kernels: Kernels,
) -> None:
    distance = np.full(kernels.cells.cells, 5.0)
    one, other = (Kernels(kernels.cells, distance, d) for d in (DENSITY, DENSITY / 2))
    assert one.radii(1_000_000) == pytest.approx(other.radii(2_000_000))


def test_cells_far_from_what_the_camera_sees_keep_their_own_light(kernels: Kernels) -> None:
    cells = kernels.cells
    near = cells.centres[:, 0] < 0.0
    some = Kernels(cells, np.full(cells.cells, 8.0), DENSITY, near)
    whole = Kernels(cells, np.full(cells.cells, 8.0), DENSITY)
    landed = np.random.default_rng(3).exponential(size=(cells.cells, 1)) * cells.areas[:, None]
    smooth, as_whole = (each.smoothing(1).kernel @ landed for each in (some, whole))
    assert smooth[near] == pytest.approx(as_whole[near])
    # Nothing but the cells that they touch counts, so most of the grain stays.
    assert smooth[~near].std() > 0.5
    assert as_whole[~near].std() < 0.2
    assert np.all(some.sharpening(landed, 1)[~near] == 1.0)


def test_light_of_a_lamp_varies_over_its_distance(kernels: Kernels) -> None:
    cells = kernels.cells
    halves = np.array([light(cells.centres) * cells.areas[:, None]] * 2)
    found = varies_over(cells, halves, np.full(cells.cells, 1.0))
    nearest = np.hypot(*cells.centres[:, :2].T).argmin()
    # Somewhat more: the blur falls off to the sides, and the kernel looks at its own result.
    assert found[nearest] == pytest.approx(HEIGHT, rel=0.2)


def test_noise_is_not_taken_for_light_that_varies(kernels: Kernels) -> None:
    cells = kernels.cells
    inside = np.abs(cells.centres[:, :2]).max(axis=1) < 4.0
    random = np.random.default_rng(5)
    noisy = random.poisson(3.0, (2, cells.cells, 1)) * cells.areas[:, None]
    radii = np.full(cells.cells, 1.2)
    assert (varies_over(cells, noisy, radii)[inside] > 1000.0).mean() > 0.9
    # The same noise in both halves can't be told from light that varies.
    assert (varies_over(cells, noisy[[0, 0]], radii)[inside] < 6.0).mean() > 0.9


def test_kernels_are_narrower_along_the_edge_of_a_shadow(kernels: Kernels) -> None:
    cells = kernels.cells
    lit = np.where(cells.centres[:, :1] > 0.0, 1.0, 0.3) * cells.areas[:, None]
    distance = np.full(cells.cells, 10.0)
    found = Kernels(cells, distance, DENSITY, None, np.array([lit, lit]), 200.0).radii(1_000_000)
    even = Kernels(cells, distance, DENSITY).radii(1_000_000)
    aside = np.abs(cells.centres[:, 0])
    clear = np.abs(cells.centres[:, :2]).max(axis=1) < 5.0
    assert np.median((found / even)[clear & (aside < 0.5)]) < 0.8
    assert np.median((found / even)[clear & (aside > 4.0)]) == pytest.approx(1.0)


@pytest.mark.parametrize("cached", [0.0, 1e9])
def test_products_do_not_depend_on_the_number_of_threads(
    kernels: Kernels,
    monkeypatch: pytest.MonkeyPatch,
    cached: float,
) -> None:
    """By blocks of columns, of which the last is shorter, and by rows."""
    monkeypatch.setattr(smoothing, "LEAST_SHARED_PRODUCT", 0)
    monkeypatch.setattr(smoothing, "CACHED_BYTES", cached)
    monkeypatch.setattr(smoothing, "BLOCK_COLUMNS", 5)
    matrix = kernels.smoothing(1_000_000).kernel.astype(np.float32)
    table = np.random.default_rng(3).random((matrix.shape[1], 12), dtype=np.float32)
    before, found = dr.thread_count(), []
    try:
        for threads in (1, 3):
            dr.set_thread_count(threads)
            found.append(smoothing.product(matrix, table))
    finally:
        dr.set_thread_count(before)
    np.testing.assert_array_equal(*found)
    np.testing.assert_allclose(found[0], matrix.toarray() @ table, rtol=1e-5)

"""What the kernel of a light field blurs: without any photons, against the light itself."""

from __future__ import annotations

import numpy as np
import pytest

from optisense.optics.variant import use_variant

SIZE = 0.3
"""mm, of a cell."""
HEIGHT = 4.0
"""mm of a point light over a plane."""
AT_DEFAULT = 0.004
"""Relative: what is left of the blur under the light, at the photons from which on it shrinks."""


@pytest.fixture(scope="module")
def kernels():  # type: ignore[no-untyped-def]
    use_variant("llvm")
    from optisense.optics.cells import build_cells
    from optisense.optics.smoothing import Kernels

    corners = np.array([(-8.0, -8, 0), (8, -8, 0), (8, 8, 0), (-8, 8, 0)])
    cells = build_cells(corners, np.array([(0, 1, 2), (0, 2, 3)]), SIZE)
    return Kernels(cells, np.hypot(HEIGHT, np.hypot(*cells.centres[:, :2].T)))


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


def errors(kernels, photons: int) -> tuple[float, float]:  # type: ignore[no-untyped-def]
    """Relative error right under the light, without and with sharpening."""
    cells = kernels.cells
    truth = within_cells(cells.centres, SIZE)
    landed = truth * cells.areas[:, None]
    blurred = kernels.smoothing(photons).matrix @ landed
    sharp = blurred * kernels.sharpening(landed, photons)
    middle = np.hypot(*cells.centres[:, :2].T) < 1.0
    found = (as_read(each, cells.centres, SIZE) for each in (blurred, sharp))
    return tuple(float((x / truth - 1)[middle].mean()) for x in found)  # type: ignore[return-value]


def test_a_kernel_takes_from_a_peak_what_theory_says(kernels) -> None:  # type: ignore[no-untyped-def]
    # The kernel's variance along an axis is r^2 / 6, the Laplacian of (h^2 + x^2 + y^2)^-3/2 on the
    # axis -6 / h^2 of it: half of one times the other.
    radius = kernels.radii(1)[np.hypot(*kernels.cells.centres[:, :2].T).argmin()]
    cells = kernels.cells
    truth = light(cells.centres)
    blurred = kernels.smoothing(1).matrix @ (truth * cells.areas[:, None])
    nearest = np.hypot(*cells.centres[:, :2].T).argmin()
    expected = -(radius**2) / (2 * HEIGHT**2)
    assert (blurred / truth - 1)[nearest, 0] == pytest.approx(expected, rel=0.15)


def test_sharpening_undoes_most_of_the_blur(kernels) -> None:  # type: ignore[no-untyped-def]
    plain, sharp = errors(kernels, 5_000_000)
    assert plain < -0.01
    assert abs(sharp) < AT_DEFAULT


def test_the_blur_goes_as_photons_grow(kernels) -> None:  # type: ignore[no-untyped-def]
    many = (5_000_000, 40_000_000, 320_000_000)
    truth = light(kernels.cells.centres)
    landed = truth * kernels.cells.areas[:, None]
    middle = np.hypot(*kernels.cells.centres[:, :2].T) < 1.0
    plain = [
        abs((kernels.smoothing(photons).matrix @ landed / truth - 1)[middle].mean())
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


def test_even_light_stays_even_up_to_the_edge(kernels) -> None:  # type: ignore[no-untyped-def]
    cells = kernels.cells
    landed = cells.areas[:, None]
    assert kernels.smoothing(1).matrix @ landed == pytest.approx(np.ones_like(landed), rel=1e-6)
    assert kernels.sharpening(landed, 1) == pytest.approx(np.ones_like(landed), rel=1e-6)


def test_a_kernel_is_narrower_near_a_lamp_and_no_wider_than_a_cell_allows(kernels) -> None:  # type: ignore[no-untyped-def]
    from optisense.optics.smoothing import LEAST_RADIUS, RADIUS, USUAL_PHOTONS, Kernels

    distance = np.linspace(0.0, 20.0, kernels.cells.cells)
    cell = 1 / float(kernels.cells.inverse_size[0])
    radii = Kernels(kernels.cells, distance).radii(USUAL_PHOTONS)
    assert np.all(np.diff(radii) >= 0)
    assert radii[0] == pytest.approx(LEAST_RADIUS * cell)
    assert radii[-1] == pytest.approx(RADIUS)


def test_a_kernel_widens_as_photons_grow_few_up_to_a_limit(kernels) -> None:  # type: ignore[no-untyped-def]
    from optisense.optics.smoothing import RADIUS_BENT, USUAL_PHOTONS, WIDEST, WIDEST_OF_METAL

    usual = kernels.radii(USUAL_PHOTONS)
    assert kernels.radii(USUAL_PHOTONS // 4) == pytest.approx(usual * 4 ** (1 / 6))
    assert kernels.radii(1) == pytest.approx(usual * WIDEST)
    assert kernels.radii(1, metallic=True) == pytest.approx(
        WIDEST_OF_METAL * np.minimum(usual, RADIUS_BENT)
    )
    assert np.all(kernels.radii(8 * USUAL_PHOTONS) < usual)


def test_cells_far_from_what_the_camera_sees_keep_their_own_light(kernels) -> None:  # type: ignore[no-untyped-def]
    from optisense.optics.smoothing import Kernels

    cells = kernels.cells
    near = cells.centres[:, 0] < 0.0
    some = Kernels(cells, np.full(cells.cells, 20.0), near)
    whole = Kernels(cells, np.full(cells.cells, 20.0))
    landed = np.random.default_rng(3).exponential(size=(cells.cells, 1)) * cells.areas[:, None]
    smooth, as_whole = (each.smoothing(1).matrix @ landed for each in (some, whole))
    assert smooth[near] == pytest.approx(as_whole[near])
    # Nothing but the cells that they touch counts, so most of the grain stays.
    assert smooth[~near].std() > 0.5
    assert as_whole[~near].std() < 0.2
    assert np.all(some.sharpening(landed, 1)[~near] == 1.0)


def test_bent_surfaces_have_narrower_kernels() -> None:
    use_variant("llvm")
    from optisense.geometry import TriangleMesh
    from optisense.optics.cells import build_cells
    from optisense.optics.smoothing import RADIUS, RADIUS_BENT, USUAL_PHOTONS, Kernels, bend

    def over_cylinder(radius: float) -> Kernels:
        turn = np.radians(np.linspace(-20, 20, 101)) * 30 / radius
        rim = np.column_stack([radius * np.sin(turn), 0 * turn, radius * np.cos(turn)])
        points = np.concatenate([rim - [0, 8, 0], rim + [0, 8, 0]])
        i = np.arange(100)
        faces = np.concatenate(
            [np.column_stack([i, i + 1, i + 101]), np.column_stack([i + 1, i + 102, i + 101])]
        )
        mesh = TriangleMesh(points, faces)
        cells = build_cells(mesh.vertices, mesh.faces, 0.5)
        return Kernels(cells, np.full(cells.cells, 20.0))

    for radius, expected in ((20.0, RADIUS_BENT), (300.0, RADIUS)):
        kernels = over_cylinder(radius)
        turned = bend(kernels.cells, RADIUS)
        assert np.median(turned) == pytest.approx(1 / radius, rel=0.15)
        assert np.median(kernels.radii(USUAL_PHOTONS)) == pytest.approx(expected)

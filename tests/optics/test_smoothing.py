"""What the kernel of a light field blurs: without any photons, against the light itself."""

from __future__ import annotations

import numpy as np
import pytest

from optisense.optics.variant import use_variant

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
    cells = build_cells(corners, np.array([(0, 1, 2), (0, 2, 3)]), 0.3)
    return Kernels(cells, np.hypot(HEIGHT, np.hypot(*cells.centres[:, :2].T)))


def light(points: np.ndarray) -> np.ndarray:
    """(n, 1) mW/mm^2 of a point light of 4 pi mW/sr in all."""
    return (HEIGHT / (HEIGHT**2 + points[:, 0] ** 2 + points[:, 1] ** 2) ** 1.5)[:, None]


def errors(kernels, photons: int) -> tuple[float, float]:  # type: ignore[no-untyped-def]
    """Relative error right under the light, without and with sharpening."""
    cells = kernels.cells
    truth = light(cells.centres)
    landed = truth * cells.areas[:, None]
    blurred = kernels.smoothing(photons).matrix @ landed
    sharp = blurred * kernels.sharpening(landed, photons)
    middle = np.hypot(*cells.centres[:, :2].T) < 1.0
    return tuple(float((x / truth - 1)[middle].mean()) for x in (blurred, sharp))  # type: ignore[return-value]


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
    found = [errors(kernels, photons) for photons in (5_000_000, 40_000_000, 320_000_000)]
    plain = np.abs([each[0] for each in found])
    # Eight times the photons halve the square of the radius, and so the blur.
    assert plain[1] / plain[0] == pytest.approx(0.5, abs=0.1)
    assert plain[2] / plain[0] == pytest.approx(0.25, abs=0.1)
    sharp = np.abs([each[1] for each in found])
    assert sharp[2] < 0.001


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
    from optisense.optics.smoothing import USUAL_PHOTONS, WIDEST, WIDEST_OF_METAL

    usual = kernels.radii(USUAL_PHOTONS)
    assert kernels.radii(USUAL_PHOTONS // 4) == pytest.approx(usual * 4 ** (1 / 6))
    assert kernels.radii(1) == pytest.approx(usual * WIDEST)
    assert kernels.radii(1, WIDEST_OF_METAL) == pytest.approx(usual)
    assert np.all(kernels.radii(8 * USUAL_PHOTONS) < usual)

"""Photon mapping converges, at the rate that theory gives, to a mean that does not drift."""

from __future__ import annotations

import numpy as np
import pytest
from reference_scenes import ReferenceScene, diffuse_coating, floor, isotropic

from optisense.optics.camera.projection import RayCamera
from optisense.optics.imaging.sppm import render_sppm
from optisense.optics.scene.emitters import Emitter, EmitterShape
from optisense.optics.transport.emission_guide import uniform_guide
from optisense.optics.transport.photons import Emission

SLOPE = (-0.85, -0.42)
"""Range of the slope of log error over log photons at a fixed radius: -1/2 for random points,
steeper for points of low discrepancy."""

DRIFT = 0.01
"""Relative, of the mean for radii from 0.4 to 0.1 mm. Under a lamp at height h, flux across the
light falls as 1/d^2; the kernel (mean square radius r^2 / 3) takes r^2 / (3 h^2) off its peak, 0.3
% for 0.4 mm and 4 mm. Noise is 0.2 %."""

FACTOR = 1.4
"""Largest ratio between the noise estimated from two halves and the true error, both over 768
pixels."""

HEIGHT = 4.0


def scene(shape: EmitterShape = EmitterShape.POINT) -> ReferenceScene:
    profile = isotropic() if shape is EmitterShape.POINT else None
    lamp = Emitter(0, (0.5, 0, HEIGHT), (0, 0, -1), (0, 1, 0), shape, (1.0, 1.0), 1.0, profile)
    camera = RayCamera((0, 0, 20), (0, 0, -1), (0, 1, 0), 20.0, 32, 24)
    return ReferenceScene([floor(diffuse_coating(0.5), 9.0)], [lamp], [(1.0, 1.0, 1.0)], camera)


def closed_form(where: ReferenceScene) -> np.ndarray:
    """Radiance (h, w) under the point light."""
    points = where.chief_rays().points.astype(float)
    distance2 = HEIGHT**2 + (points[..., 0] - 0.5) ** 2 + points[..., 1] ** 2
    return 0.5 / np.pi * HEIGHT / (4 * np.pi * distance2**1.5)


def single_pass(
    where: ReferenceScene, photons: int, radius: float, seed: int, samples: int = 1
) -> np.ndarray:
    result = render_sppm(
        where.ray_scene(),
        Emission(where.table(), uniform_guide(1), photons, seed),
        where.camera,
        1,
        coloured=False,
        radius=radius,
        samples=samples,
    )
    return result.layers[0, ..., 0].astype(float)


def test_the_error_falls_as_photons_grow() -> None:
    where = scene()
    truth = closed_form(where)
    counts = np.array([10_000, 40_000, 160_000, 640_000])
    errors = [
        np.sqrt(np.mean([(single_pass(where, int(n), 0.3, seed) / truth - 1) ** 2
                         for seed in range(4)]))
        for n in counts
    ]  # fmt: skip
    slope = np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert SLOPE[0] < slope < SLOPE[1]


@pytest.mark.parametrize("shape", [EmitterShape.POINT, EmitterShape.RECTANGLE])
def test_the_mean_does_not_drift_with_the_radius(shape: EmitterShape) -> None:
    where = scene(shape)
    means = [single_pass(where, 1_000_000, radius, 5).mean() for radius in (0.4, 0.2, 0.1)]
    assert means == pytest.approx([means[-1]] * 3, rel=DRIFT)
    if shape is EmitterShape.POINT:
        assert means[-1] == pytest.approx(closed_form(where).mean(), rel=DRIFT)


def test_more_camera_samples_find_more_of_a_pass_s_photons() -> None:
    """Pixels are 0.22 mm wide; a disc of 0.05 mm covers a sixth of one."""
    where = scene()
    truth = closed_form(where)
    one, twelve = (single_pass(where, 1_000_000, 0.05, 7, samples) for samples in (1, 12))
    assert twelve.mean() == pytest.approx(truth.mean(), rel=DRIFT)
    assert (twelve / truth).std() < 0.6 * (one / truth).std()


def test_two_halves_tell_the_noise() -> None:
    where = scene()
    truth = closed_form(where)
    layers, halves = where.pairwise(8, 20_000, seed=3, radius=0.3)
    error = np.sqrt(((layers[0, ..., 0] - truth) ** 2).mean())
    told = np.sqrt(((halves[0] - halves[1])[0, ..., 0] ** 2).mean()) / 2
    assert error / FACTOR < told < error * FACTOR


def test_more_passes_lower_the_error() -> None:
    where = scene()
    truth = closed_form(where)
    few, many = (where.pairwise(n, 20_000, seed=4, radius=0.3)[0][0, ..., 0] for n in (2, 32))
    gain = np.sqrt(((few - truth) ** 2).mean() / ((many - truth) ** 2).mean())
    # Radii shrink as passes^(-1/6): 16 times the photons leave 16^-(1/2 - 1/6) = 0.4 of it.
    assert gain > 2.0

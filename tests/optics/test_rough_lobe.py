"""The lobe of a rough interface: its samples follow its density, it makes no light, and it loses
only what meets several facets."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
import pytest
from numpy.typing import NDArray
from reference_scenes import side_lit_block
from scipy.stats import chi2

from optisense.design.reflectance import fresnel_dielectric, ggx_density, smith_shadowing
from optisense.optics.scene.interfaces import sample_rough_interface
from optisense.optics.scene.surfaces import Surface, SurfaceKind

INDEX = 1.49
SAMPLES = 400_000
CELLS = (24, 48)
"""Numbers of cells in the cosine (both hemispheres) and in the azimuth."""
FINE = 12
"""Number of points along each side of a cell, over which the density is averaged."""
LEAST_EXPECTED = 10
"""Number of expected samples below which cells are merged, as is usual for chi-square tests."""
SIGNIFICANCE = 1e-3

Array = NDArray[np.float64]


def density(way: Array, towards: Array, eta: float, alpha: float) -> Array:
    """Of directions (n, 3), by Walter et al. 2007: facets seen from `towards` (z above 0), which
    reflect and refract by Fresnel's shares."""
    up = way[:, 2] > 0
    half = np.where(up[:, None], towards + way, -(towards + eta * way))
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    half *= np.sign(half[:, 2:])
    seen, left = half @ towards, np.einsum("ij,ij->i", half, way)
    facets = ggx_density(half[:, 2], alpha) * smith_shadowing(towards[2], alpha)
    facets *= np.maximum(seen, 0) / towards[2]
    reflected = fresnel_dielectric(np.clip(seen, 1e-6, 1), eta)
    bounced = reflected * facets / (4 * np.maximum(seen, 1e-12))
    jacobian = eta**2 * np.abs(left) / np.maximum((seen + eta * left) ** 2, 1e-12)
    passed = (1 - reflected) * facets * jacobian
    proper = np.where(up, True, left < 0)
    return np.where(proper & (seen > 0), np.where(up, bounced, passed), 0.0)


def drawn(towards: Array, eta: float, alpha: float) -> tuple[Array, Array]:
    """(n, 3) directions and (n,) weights of samples for light that comes from `towards`."""
    rng = np.random.default_rng(3)
    place = rng.random((2, SAMPLES)).astype(np.float32)
    way, weight, _ = sample_rough_interface(
        mi.Vector3f(*(float(-value) for value in towards)),
        mi.Vector3f(0, 0, 1),
        mi.Float(eta),
        mi.Float(alpha),
        mi.Float(rng.random(SAMPLES).astype(np.float32)),
        mi.Point2f(mi.Float(place[0]), mi.Float(place[1])),
    )
    return np.asarray(way, dtype=np.float64).T, np.asarray(weight, dtype=np.float64)


@pytest.mark.parametrize("eta", [INDEX, 1 / INDEX], ids=["into glass", "out of glass"])
@pytest.mark.parametrize(("alpha", "cosine"), [(0.2, 0.8), (0.4, 0.5), (0.6, 0.95)])
def test_sampled_directions_follow_their_density(eta: float, alpha: float, cosine: float) -> None:
    towards = np.array([np.sqrt(1 - cosine**2), 0.0, cosine])
    way, weight = drawn(towards, eta, alpha)
    kept = way[weight > 0]  # the others would go through the surface the wrong way
    turn = np.arctan2(kept[:, 1], kept[:, 0])
    box = [(-1.0, 1.0), (-np.pi, np.pi)]
    found = np.histogram2d(kept[:, 2], turn, bins=CELLS, range=box)[0]
    z = (np.arange(CELLS[0] * FINE) + 0.5) * 2 / (CELLS[0] * FINE) - 1
    phi = ((np.arange(CELLS[1] * FINE) + 0.5) / (CELLS[1] * FINE) * 2 - 1) * np.pi
    zz, pp = np.meshgrid(z, phi, indexing="ij")
    flat = np.sqrt(1 - zz**2)
    ways = np.stack([flat * np.cos(pp), flat * np.sin(pp), zz], axis=-1).reshape(-1, 3)
    fine = density(ways, towards, eta, alpha).reshape(zz.shape)
    mean = fine.reshape(CELLS[0], FINE, CELLS[1], FINE).mean(axis=(1, 3))
    expected = SAMPLES * mean * 4 * np.pi / (CELLS[0] * CELLS[1])
    assert expected.sum() == pytest.approx(len(kept), rel=0.01)
    enough = expected >= LEAST_EXPECTED
    counts = np.append(found[enough], found[~enough].sum())
    means = np.append(expected[enough], max(expected[~enough].sum(), 1.0))
    statistic = float(((counts - means) ** 2 / means).sum())
    assert chi2.sf(statistic, len(counts) - 1) > SIGNIFICANCE


@pytest.mark.parametrize(
    ("eta", "alpha", "lost"),
    [
        (INDEX, 0.1, 0.02),
        (INDEX, 0.3, 0.08),
        (INDEX, 0.6, 0.2),
        (1 / INDEX, 0.1, 0.05),
        (1 / INDEX, 0.3, 0.25),
    ],
)
def test_a_rough_face_makes_no_light_and_loses_what_meets_several_facets(
    eta: float, alpha: float, lost: float
) -> None:
    """The model leaves out light that meets more than one facet. From within glass, facets steeper
    than the critical angle send much of it there."""
    for cosine in (0.4, 0.7, 1.0):
        _, weight = drawn(np.array([np.sqrt(1 - cosine**2), 0.0, cosine]), eta, alpha)
        assert weight.max() <= 1 + 1e-5
        assert 1 - lost <= weight.mean() <= 1 + 1e-5


PATH_MEAN = 0.034288
"""Mean of images by Mitsuba 3.9.1's path of this scene: 24 images of 2048 samples a pixel, with a
standard error of 0.08 %."""


def test_both_estimators_agree_with_mitsuba_behind_a_frosted_side() -> None:
    """The block is of acrylic."""
    clear = Surface(SurfaceKind.DIELECTRIC, eta=INDEX)
    scene = side_lit_block(clear, Surface(SurfaceKind.DIELECTRIC, eta=INDEX, alpha=0.3))
    for image in (scene.pairwise(3, 600_000)[0], scene.pooled(800_000)):
        assert image.sum(axis=0).mean() == pytest.approx(PATH_MEAN, rel=0.01)

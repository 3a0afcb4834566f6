"""Scattering laws against Mitsuba's, against quadrature, and against the conservation of energy."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from scipy import stats

from benchmarks.mitsuba_export import surface_bsdf
from optisense.optics.scene.coating_bsdf import (
    CoatingBsdf,
    coating_density,
    evaluate_coating,
    peak_share,
    sample_coating,
)
from optisense.optics.scene.interfaces import refract, sample_ggx, sample_rough_interface
from optisense.optics.scene.surfaces import Surface, SurfaceKind

SIGNIFICANCE = 0.001
SAMPLES = 200_000
ROUNDING = 2e-4
"""Relative error of a dozen operations in single precision, the steepest near grazing angles."""

ETA, K = (1.43, 0.92, 0.69), (7.5, 6.4, 5.6)


def surface(specularity: float, alpha: float) -> Surface:
    return Surface(SurfaceKind.OPAQUE, 1.0, alpha, specularity, (0.7, 0.5, 0.2), ETA, K)


def coating(specularity: float, alpha: float) -> CoatingBsdf:
    return CoatingBsdf(
        mi.Color3f(0.7, 0.5, 0.2), mi.Color3f(*ETA), mi.Color3f(*K), mi.Float(specularity),
        mi.Float(alpha),
    )  # fmt: skip


def ways(count: int, seed: int) -> mi.Vector3f:
    """Directions spread evenly over the upper hemisphere, none within 2 degrees of grazing."""
    rng = np.random.default_rng(seed)
    z = 0.035 + 0.965 * rng.random(count)
    turn = 2 * np.pi * rng.random(count)
    flat = np.sqrt(1 - z * z)
    return mi.Vector3f(mi.Float(flat * np.cos(turn)), mi.Float(flat * np.sin(turn)), mi.Float(z))


def pairs(count: int, seed: int) -> mi.Point2f:
    rng = np.random.default_rng(seed)
    return mi.Point2f(mi.Float(rng.random(count)), mi.Float(rng.random(count)))


@pytest.mark.parametrize("specularity", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("alpha", [0.05, 0.3, 1.0])
def test_the_coating_is_mitsubas_blend_of_diffuse_and_rough_conductor(
    specularity: float, alpha: float
) -> None:
    light, eye = ways(4000, 1), ways(4000, 2)
    bsdf = mi.load_dict(surface_bsdf(surface(specularity, alpha)))
    hit = dr.zeros(mi.SurfaceInteraction3f, 4000)
    hit.wi = eye
    theirs = np.asarray(bsdf.eval(mi.BSDFContext(), hit, light))
    ours = np.asarray(
        evaluate_coating(coating(specularity, alpha), mi.Vector3f(0, 0, 1), light, eye)
    )
    assert np.abs(ours - theirs).max() < ROUNDING * np.abs(theirs).max()
    assert ours == pytest.approx(theirs, rel=0.01, abs=1e-6)


DISC_ERROR = 0.03
"""Largest error relative to the peak: the disc becomes an ellipse among half vectors, which is
approximated by a disc."""
TAIL_ERROR = 0.02
"""Far from the mirror direction, where a disc of light is as good as its middle."""

TAIL_ERROR_OF_PEAK = 0.07
"""Largest error, relative to its maximum, of a tail that is averaged over light of standard
deviations of 5 degrees or less, of which four directions stand for the light."""
TAIL_INTEGRAL_ERROR = 0.002
"""Largest error of the integral of this tail over the angle of the light."""


def averaged_over_disc(
    lobe: CoatingBsdf, light: mi.Vector3f, eye: mi.Vector3f, radius: float
) -> np.ndarray:
    """(n,) the mean of a lobe over a disc of light of this angular radius, by quadrature."""
    return averaged_over_ellipse(lobe, light, eye, radius / 2, radius / 2)


def averaged_over_ellipse(
    lobe: CoatingBsdf, light: mi.Vector3f, eye: mi.Vector3f, along: float, across: float
) -> np.ndarray:
    """(n,) the mean of a lobe over a uniform ellipse of light, by quadrature.

    ``along`` and ``across`` are standard deviations (radians) in the plane of x and z, in which the
    light is, and perpendicular to it."""
    rings, spokes, count = 40, 24, dr.width(light)
    reach = 2 * np.sqrt((np.arange(rings) + 0.5) / rings)
    turn = 2 * np.pi * (np.arange(spokes) + 0.5) / spokes
    reach, turn = (mi.Float(np.tile(each.ravel(), count)) for each in np.meshgrid(reach, turn))
    again = dr.arange(mi.UInt32, count * rings * spokes) // (rings * spokes)
    light, eye = (dr.gather(mi.Vector3f, dr.ravel(each), again) for each in (light, eye))
    side = mi.Vector3f(0, 1, 0)
    aside = dr.cross(side, light) * (along * reach * dr.cos(turn))
    aside += side * (across * reach * dr.sin(turn))
    angle = dr.norm(aside)
    way = light * dr.cos(angle) + aside * (dr.sin(angle) / angle)
    values = np.asarray(evaluate_coating(lobe, mi.Vector3f(0, 0, 1), way, eye))[0]
    return np.asarray(values.reshape(count, -1).mean(axis=1))


def tilted_light(most: float) -> tuple[np.ndarray, mi.Vector3f, mi.Vector3f]:
    """Angles of light on both sides of the normal, its directions, and an eye above."""
    tilt = np.linspace(-most, most, 201)
    light = mi.Vector3f(mi.Float(np.sin(tilt)), dr.zeros(mi.Float, 201), mi.Float(np.cos(tilt)))
    return tilt, light, mi.Vector3f(0, 0, 1) + dr.zeros(mi.Vector3f, 201)


@pytest.mark.parametrize("alpha", [0.05, 0.2, 0.5])
@pytest.mark.parametrize("radius", [0.1, 0.3])
def test_a_lobe_averaged_over_a_disc_of_light(alpha: float, radius: float) -> None:
    tilt, light, eye = tilted_light(1.0)
    lobe = coating(1.0, alpha)
    truth = averaged_over_disc(lobe, light, eye, radius)
    lobe.light_radius2 = mi.Float(radius**2)
    found = np.asarray(evaluate_coating(lobe, mi.Vector3f(0, 0, 1), light, eye))[0]
    assert np.abs(found - truth).max() < DISC_ERROR * truth.max()
    assert found.sum() == pytest.approx(truth.sum(), rel=DISC_ERROR)
    far = np.abs(tilt) > 3 * radius
    assert found[far] == pytest.approx(truth[far], rel=TAIL_ERROR + (radius / 0.9) ** 2)


def test_a_disc_of_no_size_is_one_direction() -> None:
    light, eye = ways(4000, 1), ways(4000, 2)
    lobe = coating(1.0, 0.1)
    sharp = np.asarray(evaluate_coating(lobe, mi.Vector3f(0, 0, 1), light, eye))
    lobe.light_radius2 = mi.Float(0)
    found = np.asarray(evaluate_coating(lobe, mi.Vector3f(0, 0, 1), light, eye))
    assert found == pytest.approx(sharp, rel=1e-3, abs=1e-5)


def test_peak_and_tail_of_a_lobe_are_the_whole() -> None:
    light, eye, up = ways(4000, 1), ways(4000, 2), mi.Vector3f(0, 0, 1)
    whole, tail = coating(1.0, 0.08), coating(1.0, 0.08)
    tail.only_tail = True
    half = dr.normalize(light + eye)
    all_of_it = evaluate_coating(whole, up, light, eye)
    both = all_of_it * peak_share(half.z) + evaluate_coating(tail, up, light, eye)
    assert np.asarray(both) == pytest.approx(np.asarray(all_of_it), rel=ROUNDING, abs=1e-6)


@pytest.mark.parametrize("alpha", [0.05, 0.12])
@pytest.mark.parametrize("deviations", [(0.05, 0.05), (0.02, 0.08), (0.08, 0.02)])
def test_a_tail_averaged_over_elongated_light(
    alpha: float, deviations: tuple[float, float]
) -> None:
    """Deviations are those along the tilt of the light and across it. A disc of the same mean
    variance is far off."""
    _, light, eye = tilted_light(1.3)
    lobe = coating(1.0, alpha)
    lobe.only_tail = True
    truth = averaged_over_ellipse(lobe, light, eye, *deviations)

    def with_axes(one: float, other: float) -> np.ndarray:
        across = mi.Vector3f(0, 1, 0)
        up = dr.cross(across, light)
        lobe.light_axes = (up * (one * 2**0.5), across * (other * 2**0.5))
        return np.asarray(evaluate_coating(lobe, mi.Vector3f(0, 0, 1), light, eye))[0]

    found = with_axes(*deviations)
    assert np.abs(found - truth).max() < TAIL_ERROR_OF_PEAK * truth.max()
    assert found.sum() == pytest.approx(truth.sum(), rel=TAIL_INTEGRAL_ERROR)
    if deviations[0] != deviations[1]:
        mean = float(np.hypot(*deviations) / 2**0.5)
        as_disc = with_axes(mean, mean)
        assert np.abs(as_disc - truth).max() > 2 * np.abs(found - truth).max()


@pytest.mark.parametrize("specularity", [0.0, 0.4, 1.0])
def test_samples_are_drawn_with_the_stated_density(specularity: float) -> None:
    """The weight of a sample is the law over the density of its lobe; over both lobes, the mean of
    the inverse density is the solid angle of the hemisphere, as far as the lobes reach."""
    up, incoming = mi.Vector3f(0, 0, 1), dr.normalize(mi.Vector3f(0.3, 0.1, -0.9))
    here = coating(specularity, 0.5)
    pick = mi.Float(np.random.default_rng(7).random(SAMPLES))
    way, _ = sample_coating(here, up, incoming, pick, pairs(SAMPLES, 8))
    density = np.asarray(coating_density(here, up, way, -incoming))
    height = np.asarray(way.z)
    for low, high in ((0.1, 0.4), (0.4, 0.7), (0.7, 1.0)):
        part = (height > low) & (height <= high)
        inverse = np.where(part, 1 / np.where(part, density, 1), 0)
        noise = inverse.std() / np.sqrt(SAMPLES)
        assert abs(inverse.mean() - 2 * np.pi * (high - low)) < 4.5 * noise + 1e-3


@pytest.mark.parametrize("cosine", [0.1, 0.6, 1.0])
@pytest.mark.parametrize("alpha", [0.1, 0.5])
def test_ggx_normals_follow_the_visible_distribution(cosine: float, alpha: float) -> None:
    view = np.array([np.sqrt(1 - cosine**2), 0, cosine])
    theirs = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, alpha, True)

    seen = mi.Vector3f(*view.tolist()) + dr.zeros(mi.Vector3f, SAMPLES)
    x, y, z = np.asarray(sample_ggx(seen, mi.Float(alpha), pairs(SAMPLES, 4)))
    # Cells of t = tan(theta)^2 / alpha^2 (GGX spreads u = t / (1 + t) evenly) and of azimuth; the
    # square takes away a singularity at the horizon.
    cells, fine = (20, 12), (120, 40)
    t = (x**2 + y**2) / z**2 / alpha**2
    turn = np.arctan2(y, x) / (2 * np.pi) + 0.5
    found, _, _ = np.histogram2d(1 - np.sqrt(1 / (1 + t)), turn, cells, [[0, 1], [0, 1]])
    w, v = ((np.arange(c * f) + 0.5) / (c * f) for c, f in zip(cells, fine, strict=True))
    w, v = (g.ravel() for g in np.meshgrid(w, v, indexing="ij"))
    u = 1 - (1 - w) ** 2
    cos2 = 1 / (1 + alpha**2 * u / (1 - u))
    flat, angle = np.sqrt(1 - cos2), 2 * np.pi * (v - 0.5)
    half = mi.Vector3f(
        mi.Float(flat * np.cos(angle)), mi.Float(flat * np.sin(angle)), mi.Float(np.sqrt(cos2))
    )
    wide = mi.Vector3f(*view.tolist()) + dr.zeros(mi.Vector3f, len(u))
    # d(solid angle) = d(cos) d(azimuth); d(cos) = alpha^2 cos^3 / 2 dt; dt = 2 dw / (1 - w)^3.
    solid = alpha**2 * cos2**1.5 / (1 - w) ** 3 * 2 * np.pi / len(u)
    mass = (np.asarray(theirs.pdf(wide, half)) * solid).reshape(
        cells[0], fine[0], cells[1], fine[1]
    )
    expected = SAMPLES * mass.sum(axis=(1, 3))
    assert expected.sum() == pytest.approx(SAMPLES, rel=2e-3)
    thick = expected >= 5
    statistic = ((found - expected)[thick] ** 2 / expected[thick]).sum()
    assert stats.chi2.sf(statistic, thick.sum()) > SIGNIFICANCE


@pytest.mark.parametrize("specularity", [0.0, 0.4, 1.0])
@pytest.mark.parametrize("alpha", [0.1, 0.6])
def test_coating_samples_carry_the_light_that_the_law_reflects(
    specularity: float, alpha: float
) -> None:
    """Over eight parts of the hemisphere, samples' weights add up to the integral of the law."""
    incoming = dr.normalize(mi.Vector3f(0.5, 0.2, -0.8))
    up = mi.Vector3f(0, 0, 1)
    here = coating(specularity, alpha)
    pick = mi.Float(np.random.default_rng(5).random(SAMPLES))
    way, weight = sample_coating(here, up, incoming, pick, pairs(SAMPLES, 6))
    x, y, z = np.asarray(way)
    weights = np.asarray(weight)
    # Midpoints of a fine grid in (azimuth, cosine): equal solid angles.
    n = 512
    turn = (np.arange(2 * n) + 0.5) * np.pi / n
    cosine = (np.arange(n) + 0.5) / n
    turns, cosines = (g.ravel() for g in np.meshgrid(turn, cosine))
    flat = np.sqrt(1 - cosines**2)
    light = mi.Vector3f(
        mi.Float(flat * np.cos(turns)), mi.Float(flat * np.sin(turns)), mi.Float(cosines)
    )
    # Reciprocity: the law for light going out along the sample, seen from where it came.
    law = np.asarray(evaluate_coating(here, up, light, -incoming)) * (2 * np.pi / turns.size)
    tilt = flat * (np.cos(turns) + 0.4 * np.sin(turns))
    for low, high in ((0.0, 0.4), (0.4, 0.7), (0.7, 0.9), (0.9, 1.0)):
        for side in (-1, 1):
            inside = (z > low) & (z <= high) & (np.sign(x + 0.4 * y) == side)
            there = (cosines > low) & (cosines <= high) & (np.sign(tilt) == side)
            true = law[:, there].sum(axis=1)
            got = (weights * inside).mean(axis=1)
            noise = (weights * inside).std(axis=1) / np.sqrt(SAMPLES)
            assert np.all(np.abs(got - true) < 4.5 * noise + 2e-4)


def test_fresnel_and_snell_at_an_interface() -> None:
    degrees = np.array([0.0, 20, 40, 60, 80])
    angle = np.radians(degrees)
    incoming = mi.Vector3f(mi.Float(np.sin(angle)), mi.Float(0 * angle), mi.Float(-np.cos(angle)))
    up = mi.Vector3f(0, 0, 1)
    reflectance, back, through, relative = refract(incoming, up, mi.Float(1.5))
    inside = np.arcsin(np.sin(angle) / 1.5)
    with np.errstate(invalid="ignore", divide="ignore"):
        s = (np.sin(angle - inside) / np.sin(angle + inside)) ** 2
        p = (np.tan(angle - inside) / np.tan(angle + inside)) ** 2
    expected = np.where(angle > 0, (s + p) / 2, 0.04)
    assert np.asarray(reflectance) == pytest.approx(expected, abs=1e-6)
    assert np.asarray(through)[0] == pytest.approx(np.sin(inside), abs=1e-6)
    assert np.asarray(through)[2] == pytest.approx(-np.cos(inside), abs=1e-6)
    assert np.asarray(back)[2] == pytest.approx(np.cos(angle), abs=1e-6)
    assert np.asarray(relative) == pytest.approx(1.5)
    # From inside, beyond the critical angle of 41.8 degrees, everything comes back.
    from_inside, _, _, relative = refract(-incoming, up, mi.Float(1.5))
    assert np.all(np.asarray(from_inside)[degrees > 41.8] == 1.0)
    assert np.all(np.asarray(from_inside)[degrees < 41.8] < 1.0)
    assert np.asarray(relative) == pytest.approx(1 / 1.5)


@pytest.mark.parametrize("alpha", [0.05, 0.3])
@pytest.mark.parametrize("side", [1.0, -1.0], ids=["from outside", "from inside"])
def test_a_rough_interface_passes_as_much_as_mitsubas_and_makes_no_light(
    alpha: float, side: float
) -> None:
    bsdf = mi.load_dict(surface_bsdf(Surface(SurfaceKind.DIELECTRIC, eta=1.41, alpha=alpha)))
    for cosine in (0.3, 0.7, 1.0):
        towards = mi.Vector3f(float(np.sqrt(1 - cosine**2)), 0, cosine * side)
        rng = np.random.default_rng(7)
        pick = mi.Float(rng.random(SAMPLES))
        way, weight, ratio = sample_rough_interface(
            -towards, mi.Vector3f(0, 0, 1), mi.Float(1.41), mi.Float(alpha), pick,
            pairs(SAMPLES, 8),
        )  # fmt: skip
        hit = dr.zeros(mi.SurfaceInteraction3f, SAMPLES)
        hit.wi = towards + dr.zeros(mi.Vector3f, SAMPLES)
        drawn, theirs = bsdf.sample(
            mi.BSDFContext(mi.TransportMode.Importance), hit, pick, pairs(SAMPLES, 9)
        )
        weights, passed = np.asarray(weight), np.asarray(ratio) != 1
        their_weights = np.asarray(theirs)[0]
        their_passed = np.asarray(drawn.wo)[2] * side < 0
        assert weights.max() <= 1.0001
        for ours, other in ((weights * passed, their_weights * their_passed),
                            (weights * ~passed, their_weights * ~their_passed)):  # fmt: skip
            noise = np.hypot(ours.std(), other.std()) / np.sqrt(SAMPLES)
            assert abs(ours.mean() - other.mean()) < 4.5 * noise + 1e-4
        alive = weights > 0
        assert np.array_equal((np.asarray(way)[2] * side < 0)[alive], passed[alive])

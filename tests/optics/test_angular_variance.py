"""How light of a beam is spread: moments of drawn directions, and means over what is above a
horizon."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from optisense.optics.radiance_cache.angular_variance import (
    AngularVariance,
    angular_variance,
    broadened_coating,
    cosine_half_width,
    mirrored_above,
    reflected_from_discs,
    sample_direction,
    two_discs,
)
from optisense.optics.scene.coating_bsdf import CoatingBsdf, evaluate_coating

COUNT = 200_000
TOWARDS = np.array([0.6, 0.0, 0.8])
ALONG = np.array([0.0, 1.0, 0.0])
UP = np.array([-0.8, 0.0, 0.6])
VARIANCES = 0.012, 0.002
"""Angular variances (radians squared) along and up, those of discs of 13 and 5 degrees."""


def light() -> AngularVariance:
    return AngularVariance(
        mi.Vector3f(TOWARDS), mi.Vector3f(ALONG), mi.Vector3f(UP),
        mi.Float(VARIANCES[0]), mi.Float(VARIANCES[1]),
    )  # fmt: skip


def drawn() -> np.ndarray:
    """(COUNT, 3) directions of this light."""
    state = mi.sample_tea_32(dr.arange(mi.UInt32, COUNT), 7)[0]
    return np.asarray(sample_direction(light(), state)).T


def test_drawn_directions_have_the_variances_of_the_light() -> None:
    ways = drawn()
    # `within` goes aside in the plane across, and the angle's tangent has a little more variance.
    assert np.var(ways @ ALONG) == pytest.approx(VARIANCES[0], rel=0.03)
    assert np.var(ways @ UP) == pytest.approx(VARIANCES[1], rel=0.03)


def test_the_moments_of_a_field_tell_the_variances() -> None:
    ways = drawn()
    mean = ways.mean(axis=0)
    cosine = np.linalg.norm(mean)
    height = (ways[:, 2] ** 2).mean()
    found = angular_variance(
        mi.Vector3f(0, 0, 1), mi.Vector3f(mean / cosine), mi.Float(cosine), mi.Float(height)
    )
    assert found.variance_along[0] == pytest.approx(VARIANCES[0], rel=0.05)
    assert found.variance_up[0] == pytest.approx(VARIANCES[1], rel=0.05)
    assert abs(np.asarray(found.along)[:, 0] @ ALONG) == pytest.approx(1, abs=1e-3)
    assert abs(np.asarray(found.up)[:, 0] @ UP) == pytest.approx(1, abs=1e-3)


@pytest.mark.parametrize("lean", np.radians([-8.0, -3.0, 0.0, 3.0, 8.0, 40.0]))
@pytest.mark.parametrize("side", [ALONG, UP], ids=["along", "up"])
def test_light_about_the_horizon_counts_with_what_is_above_it(
    side: np.ndarray, lean: float
) -> None:
    normal = np.cos(lean) * side + np.sin(lean) * TOWARDS
    truth = np.maximum(drawn() @ normal, 0).mean()
    everywhere = mi.Vector3f(TOWARDS)
    half_width = cosine_half_width(light(), mi.Vector3f(normal), everywhere)
    coating = CoatingBsdf(
        reflectance=mi.Color3f(np.pi),
        metal_eta=mi.Color3f(1),
        metal_k=mi.Color3f(0),
        specularity=mi.Float(0),
        alpha=mi.Float(0.1),
        metallic=False,
    )
    got = evaluate_coating(
        coating, mi.Vector3f(normal), mi.Vector3f(TOWARDS), mi.Vector3f(normal), half_width
    )
    # A slab stands for an ellipse: their halves' means are 0.433 and 0.424 deviations.
    deviation = np.sqrt(VARIANCES[0 if side is ALONG else 1])
    assert got.x[0] == pytest.approx(truth, rel=0.015, abs=0.03 * deviation)


def test_light_of_the_undeformed_surface_is_above_it_whole() -> None:
    upright = mi.Vector3f(np.cos(0.02) * UP + np.sin(0.02) * TOWARDS)
    half_width = cosine_half_width(light(), upright, upright)
    assert half_width[0] <= np.sin(0.02) + 1e-6


def test_directions_below_a_plane_are_mirrored_up() -> None:
    normal = mi.Vector3f(0, 0, 1)
    assert np.asarray(mirrored_above(mi.Vector3f(0.6, 0, -0.8), normal)).ravel() == pytest.approx(
        [0.6, 0, 0.8]
    )
    assert np.asarray(mirrored_above(mi.Vector3f(0.6, 0, 0.8), normal)).ravel() == pytest.approx(
        [0.6, 0, 0.8]
    )


def test_two_discs_have_the_variances_of_the_light() -> None:
    one, other, cosine = two_discs(light())
    apart = np.asarray(one).ravel() - np.asarray(other).ravel()
    within = 1 - cosine[0]
    assert within + (apart @ ALONG / 2) ** 2 == pytest.approx(VARIANCES[0], rel=0.02)
    assert within + (apart @ UP / 2) ** 2 == pytest.approx(VARIANCES[1], rel=0.02)


def coating(alpha: float, specularity: float = 1.0) -> CoatingBsdf:
    return CoatingBsdf(
        reflectance=mi.Color3f(0.6),
        metal_eta=mi.Color3f(1.5),
        metal_k=mi.Color3f(7.0),
        specularity=mi.Float(specularity),
        alpha=mi.Float(alpha),
    )


NORMAL = mi.Vector3f(0, 0, 1)


def three_ways(bsdf: CoatingBsdf, eye: np.ndarray) -> tuple[float, float, float]:
    """Radiance of this light by drawn directions, as two discs, and as one round disc."""
    towards_eye = mi.Vector3f(eye / np.linalg.norm(eye))
    ways = drawn()[:20_000]
    cosine = mi.Float(np.linalg.norm(ways.mean(axis=0)))
    each = evaluate_coating(bsdf, NORMAL, mi.Vector3f(ways.T), towards_eye)
    split = reflected_from_discs(bsdf, light(), cosine, NORMAL, towards_eye)
    disc = broadened_coating(bsdf, cosine)
    round_ = evaluate_coating(disc, NORMAL, mi.Vector3f(TOWARDS), towards_eye)
    return float(np.asarray(each)[0].mean()), float(split[0][0]), float(round_[0][0])


def test_a_narrow_lobe_mirrors_long_light_as_two_discs() -> None:
    """For eyes about the mirror direction; one round disc is nearly twice as far off."""
    mirrored = np.array([-0.6, 0.0, 0.8])
    eyes = [
        mirrored + along * ALONG + up * np.array([0.8, 0.0, 0.6])
        for along in np.linspace(-0.3, 0.3, 7)
        for up in np.linspace(-0.2, 0.2, 5)
    ]
    truth, split, round_ = np.array([three_ways(coating(0.05), eye) for eye in eyes]).T
    errors = [np.sqrt(np.mean((each - truth) ** 2)) / truth.max() for each in (split, round_)]
    assert errors[0] < 0.09
    assert errors[1] > 1.5 * errors[0]


@pytest.mark.parametrize("specularity", [0.6, 0.8, 1.0])
def test_long_light_at_the_side_of_a_lobe_is_not_round(specularity: float) -> None:
    """For eyes near the normal, as a camera is above skin that lamps light from its sides."""
    bsdf = coating(1.0 - 0.8 * specularity, specularity)
    for eye in ([0.0, 0.0, 1.0], [0.2, 0.1, 1.0], [0.1, -0.2, 1.0]):
        truth, split, round_ = three_ways(bsdf, np.array(eye))
        assert split == pytest.approx(truth, rel=0.01)
        assert abs(round_ / truth - 1) > 2 * abs(split / truth - 1)

"""Rays of lobes from one coating to the next, with branches at interfaces."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from numpy.typing import NDArray

import optisense as ots
from optisense.optics.backend.sequences import unit_float
from optisense.optics.radiance_cache import _lobe_branches
from optisense.optics.scene.ray_scene import Ray, RayScene
from optisense.optics.transport.interact import RayKind

RAYS = 40_000
"""Number of rays that start from the skin."""
REPEATS = 6
"""Number of times that each ray is followed, with other random numbers."""
WAYS = {
    "all branches": (RayKind.CAMERA, False),
    "roulette": (RayKind.CAMERA, True),
    "drawn ways": (RayKind.REFLECTION, False),
}
"""The ways to follow rays: their kind, and whether reflections are chosen by roulette."""


@pytest.fixture(scope="module")
def scene() -> RayScene:
    scene = ots.OpticalModel(ots.load("gelsight-mini")).scenes.full
    assert scene.rough
    return scene


def followed(scene: RayScene, way: str) -> tuple[NDArray[np.float64], float]:
    """Return the light (REPEATS, n) of lamps that rays from a place on the skin meet, and the mean
    weight of their ends on coatings.

    Args:
        way: a key of `WAYS`.
    """
    random = np.random.default_rng(0)
    # The rays leave the skin flatly, towards the edges of the light guide.
    azimuth, height = random.uniform(0, 2 * np.pi, RAYS), random.uniform(0.05, 0.7, RAYS)
    away = np.sqrt(1 - height**2)
    direction = mi.Vector3f(*np.float32([away * np.cos(azimuth), away * np.sin(azimuth), -height]))
    origin = mi.Point3f(dr.full(mi.Float, 0.5, RAYS), 0.3, -0.01)
    kind, roulette = WAYS[way]
    lamps, coatings = [], []
    for _ in range(REPEATS):
        bits = mi.UInt32(random.integers(0, 2**32, RAYS, dtype=np.uint32))
        ray = Ray(mi.Point3f(origin), mi.Vector3f(direction), dr.full(mi.Bool, True, RAYS))
        weight = dr.full(mi.Color3f, 1, RAYS)
        end, number = _lobe_branches.follow_to_coating(scene, ray, weight, bits, kind, roulette)
        green, number = np.asarray(end.weight.y), np.asarray(number)
        lit = np.asarray(end.light) > 0
        lamps.append(np.bincount(number[lit], green[lit], RAYS))
        coatings.append(green[np.asarray(end.valid)].sum() / RAYS)
    return np.array(lamps), float(np.mean(coatings))


@pytest.mark.parametrize("way", WAYS)
def test_splitting_at_rough_faces_changes_no_mean_and_reduces_noise(
    monkeypatch: pytest.MonkeyPatch, scene: RayScene, way: str
) -> None:
    split, coated = followed(scene, way)
    monkeypatch.setattr(_lobe_branches, "MOST_SCATTERED", 1)
    single, coated_singly = followed(scene, way)
    # More than three standard errors of the ratio.
    assert split.mean() == pytest.approx(single.mean(), rel=0.03)
    assert coated == pytest.approx(coated_singly, rel=0.02)
    # The rest of the variance is that of reflections at smooth interfaces.
    assert split.var(axis=0).mean() < 0.7 * single.var(axis=0).mean()


def test_the_directions_of_split_rays_are_spread_evenly(
    monkeypatch: pytest.MonkeyPatch, scene: RayScene
) -> None:
    evenly, _ = followed(scene, "all branches")

    def at_random(series: mi.UInt32, number: mi.UInt32, dimension: int) -> mi.Float:
        return unit_float(mi.sample_tea_32(series + number * 77, mi.UInt32(dimension), 8)[0])

    monkeypatch.setattr(_lobe_branches, "richtmyer", at_random)
    randomly, _ = followed(scene, "all branches")
    assert evenly.mean() == pytest.approx(randomly.mean(), rel=0.03)
    # Most of the variance is that of reflections at smooth interfaces and of rays that miss a lamp.
    assert evenly.var(axis=0).mean() < 0.98 * randomly.var(axis=0).mean()


def test_all_ways_to_follow_rays_have_the_same_mean(scene: RayScene) -> None:
    light, coated = followed(scene, "all branches")
    for way in ("roulette", "drawn ways"):
        other, coated_otherwise = followed(scene, way)
        # More than three standard errors of the ratio.
        assert other.mean() == pytest.approx(light.mean(), rel=0.02)
        assert coated_otherwise == pytest.approx(coated, rel=0.02)
        assert other.var(axis=0).mean() > light.var(axis=0).mean()

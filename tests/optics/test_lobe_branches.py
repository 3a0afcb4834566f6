"""Rays of lobes from one coating to the next, with branches at interfaces."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import optisense as ots
from optisense.optics.radiance_cache import _lobe_branches
from optisense.optics.scene.ray_scene import Ray
from optisense.optics.transport.interact import RayKind

RAYS = 40_000
"""Number of rays that start from the skin."""
REPEATS = 6
"""Number of times that each ray is followed, with other random numbers."""


@pytest.mark.parametrize("ray_kind", [RayKind.CAMERA, RayKind.REFLECTION])
def test_splitting_at_rough_faces_changes_no_mean_and_reduces_noise(
    monkeypatch: pytest.MonkeyPatch, ray_kind: RayKind
) -> None:
    scene = ots.OpticalModel(ots.load("gelsight-mini")).scenes.full
    assert scene.rough
    random = np.random.default_rng(0)
    # Rays that leave a place on the skin flatly, towards the edges of the light guide.
    azimuth, height = random.uniform(0, 2 * np.pi, RAYS), random.uniform(0.05, 0.7, RAYS)
    away = np.sqrt(1 - height**2)
    way = mi.Vector3f(*np.float32([away * np.cos(azimuth), away * np.sin(azimuth), -height]))
    origin = mi.Point3f(dr.full(mi.Float, 0.5, RAYS), 0.3, -0.01)

    def followed() -> tuple[np.ndarray, float]:
        """Return the light (REPEATS, n) of lamps, and the mean weight of the ends on coatings."""
        lamps, coatings = [], []
        for _ in range(REPEATS):
            bits = mi.UInt32(random.integers(0, 2**32, RAYS, dtype=np.uint32))
            ray = Ray(mi.Point3f(origin), mi.Vector3f(way), dr.full(mi.Bool, True, RAYS))
            weight = dr.full(mi.Color3f, 1, RAYS)
            end, number = _lobe_branches.follow_to_coating(scene, ray, weight, bits, ray_kind)
            green, number = np.asarray(end.weight.y), np.asarray(number)
            lit = np.asarray(end.light) > 0
            lamps.append(np.bincount(number[lit], green[lit], RAYS))
            coatings.append(green[np.asarray(end.valid)].sum() / RAYS)
        return np.array(lamps), float(np.mean(coatings))

    split, coated = followed()
    monkeypatch.setattr(_lobe_branches, "MOST_SCATTERED", 1)
    single, coated_singly = followed()
    # More than three standard errors of the ratio.
    assert split.mean() == pytest.approx(single.mean(), rel=0.03)
    assert coated == pytest.approx(coated_singly, rel=0.02)
    # The rest of the variance is that of reflections at smooth interfaces.
    assert split.var(axis=0).mean() < 0.7 * single.var(axis=0).mean()

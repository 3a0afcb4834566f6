"""The referee scene: a coated, bumped slab of gel lit from three sides, on which renderers agree.

Image means of Mitsuba 3.9, pbrt-v3, Cycles and LuxCore: no slab .2427 to .2429; slab, area lights
.2651 to .2666; slab, point lights .528 (LuxCore's vertex merging) and .5345 (pbrt's SPPM).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from reference_scenes import (
    REFEREE_RADIANCE,
    Colour,
    ReferenceScene,
    box,
    diffuse_coating,
    metal_coating,
    referee_scene,
)

from optisense.optics.camera.projection import RayCamera
from optisense.optics.scene.emitters import Emitter, EmitterShape
from optisense.optics.scene.surfaces import Surface, SurfaceKind

NO_SLAB, SLAB, SLAB_POINT = 0.24287, 0.26653, 0.531
"""Agreed means: the first two Mitsuba's, the last halfway between pbrt's and LuxCore's."""

TOLERANCES = {NO_SLAB: 0.005, SLAB: 0.01, SLAB_POINT: 0.02}

PATH = {"metal": 0.18067, "blend": 0.18023, "embedded": 0.18072}
"""Means of Mitsuba 3.9.1's path on the very scenes, as ``ReferenceScene.path`` exports them: six
images of 512 samples a pixel, seeds 0 to 5; standard errors .00015, .00012 and .00005."""

AGAINST_PATH = 0.01

SHORT_PATH = 0.02
"""Relative error of the path tracer's mean at 32 samples a pixel, which finds lamps behind smooth
glass only by chance."""

ALUMINIUM: tuple[Colour, Colour] = ((1.43, 0.92, 0.69), (7.5, 6.4, 5.6))
METAL = metal_coating(0.3, *ALUMINIUM)
BLEND = metal_coating(0.3, *ALUMINIUM, specularity=0.5)

# Gather radius (mm) of photon mapping. Its kernel loses light over the open edges of the coating,
# measured as 0.05 % of the mean for each 0.01 mm.
RADIUS = 0.05
PASSES, PER_LIGHT = 3, 250_000
POOLED_PHOTONS = 400_000


def pairwise_mean(coating: Surface, slab: bool = True, lights: str = "area") -> float:
    layers, _ = referee_scene(coating, slab, lights).pairwise(PASSES, PER_LIGHT, radius=RADIUS)
    return float(layers.sum(axis=0).mean())


def pooled_mean(coating: Surface, slab: bool = True, lights: str = "area") -> float:
    # The radiance cache is sampled in the middle of each pixel: smaller ones cut the coating's rim
    # more truly (at 160x120 it is 0.9 % short), and show more of what metal mirrors.
    size = (480, 360) if coating.specularity > 0 else (320, 240)
    fine = referee_scene(coating, slab, lights, resolution=size)
    return float(fine.pooled(POOLED_PHOTONS).sum(axis=0).mean())


estimators = pytest.mark.parametrize("mean", [pairwise_mean, pooled_mean])


@estimators
def test_bare_coating(mean: Callable[..., float]) -> None:
    assert mean(diffuse_coating(0.7), slab=False) == pytest.approx(NO_SLAB, rel=TOLERANCES[NO_SLAB])


@estimators
def test_slab_under_area_lights(mean: Callable[..., float]) -> None:
    assert mean(diffuse_coating(0.7)) == pytest.approx(SLAB, rel=TOLERANCES[SLAB])


@estimators
def test_slab_under_point_lights_that_no_path_tracer_sees(mean: Callable[..., float]) -> None:
    got = mean(diffuse_coating(0.7), lights="point")
    assert got == pytest.approx(SLAB_POINT, rel=TOLERANCES[SLAB_POINT])


@pytest.mark.parametrize(("mean", "name"), [(pairwise_mean, "blend"), (pooled_mean, "metal")])
def test_metal_coating_agrees_with_path(mean: Callable[..., float], name: str) -> None:
    """Of the radiance cache, patches of contacts have more blends (test_metal_patches.py)."""
    got = mean({"metal": METAL, "blend": BLEND}[name])
    assert got == pytest.approx(PATH[name], rel=AGAINST_PATH)


@estimators
def test_light_embedded_in_the_gel_is_counted_once(mean: Callable[..., float]) -> None:
    got = mean(diffuse_coating(0.7), lights="embedded")
    assert got == pytest.approx(PATH["embedded"], rel=AGAINST_PATH)


@pytest.mark.parametrize("name", PATH)
def test_exported_scenes_still_render_as_recorded(name: str) -> None:
    coating = {"metal": METAL, "blend": BLEND}.get(name, diffuse_coating(0.7))
    lights = "embedded" if name == "embedded" else "area"
    got = float(referee_scene(coating, True, lights).path(32).mean())
    assert got == pytest.approx(PATH[name], rel=SHORT_PATH)


def test_path_sees_no_point_light_through_smooth_glass() -> None:
    assert np.all(referee_scene(diffuse_coating(0.7), lights="point").path(4) == 0.0)


def test_path_follows_light_over_a_hundred_reflections() -> None:
    mirror = Surface(SurfaceKind.MIRROR, metal_eta=(0.0, 0.0, 0.0), metal_k=(1.0, 1.0, 1.0))
    shaft = box("shaft", (-1, -5, 0), (1, 5, 200), mirror, without=["-z", "+z", "-y", "+y"])
    lamp = Emitter(0, (0, 0, 0), (0, 0, 1), (0, 1, 0), EmitterShape.RECTANGLE, (10.0, 10.0))
    camera = RayCamera((0, 0, 199), (1, 0, -1), (0, 1, 0), 0.1, 16, 12)
    flux = (np.pi * 100.0 * REFEREE_RADIANCE,) * 3
    got = ReferenceScene([shaft], [lamp], [flux], camera).path(512).mean()
    # Mitsuba's roulette ends a twentieth of the paths at each of the last 85 reflections.
    assert got == pytest.approx(REFEREE_RADIANCE, rel=0.1)

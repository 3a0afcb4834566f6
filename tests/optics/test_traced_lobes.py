"""Narrow metallic lobes, whose peaks are traced to the lamps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import optisense as ots
from optisense.mechanics import CONFORMING
from optisense.optics.imaging import _traced_light
from optisense.optics.imaging.lamp_images import without_specks
from optisense.optics.radiance_cache.lit_scene import TAIL_ROUGHNESS, LitScene
from optisense.optics.scene.sensor_scenes import SensorScenes

METAL = ots.set_value(ots.load("gelsight-mini-ideal"), "coating.specularity", 1.0)
NOISE = 0.03
"""Relative error of the mean of a contact: three times its noise with 300,000 photons."""


def test_peaks_of_narrow_lobes_are_traced_to_windows() -> None:
    scenes = ots.OpticalModel(METAL).scenes
    lit = LitScene.of(scenes)
    assert lit.traced_lobes and lit.roughness == TAIL_ROUGHNESS
    assert not LitScene.of(scenes, may_trace_lobes=False).traced_lobes
    broader = ots.OpticalModel(ots.set_value(METAL, "coating.specularity", 0.8)).scenes
    assert not LitScene.of(broader).traced_lobes
    lamp, *others = scenes.assembly.emitters
    for change, traced in (({"exponent": 3.0}, True), ({"size": (0.0, 0.0)}, False)):
        changed = replace(scenes.assembly, emitters=[replace(lamp, **change), *others])
        assert LitScene.of(SensorScenes(changed, METAL.coating)).traced_lobes == traced


def test_shared_rays_change_no_mean(monkeypatch: pytest.MonkeyPatch) -> None:
    model = ots.OpticalModel(METAL)
    ball = [ots.Contact(ots.Sphere(3.0), at=(0.5, 0.3), depth=0.8)]
    means = []
    for reach in (0, 1):
        monkeypatch.setattr(_traced_light, "CONTACT_REACH", reach)
        image = model.render(ball, resolution=(64, 48), photons=300_000, skin=CONFORMING)
        means.append(image.radiance[image.contact_mask].mean(axis=0))
    assert means[1] == pytest.approx(means[0], rel=NOISE)


def test_specks_are_spread_within_their_region() -> None:
    layers = np.zeros((1, 40, 40, 3), dtype=np.float32)
    layers[0, 20, 10], layers[0, 20, 30] = 1.0, 1.0
    region = np.zeros((40, 40), dtype=bool)
    region[:, :20] = True
    found = without_specks(layers, np.zeros_like(region), region)[0, ..., 0]
    assert found[:, :20].sum() == pytest.approx(1.0, rel=1e-5)
    assert found[20, 10] < 0.1
    assert found[20, 30] == 1.0 and found[:, 20:].sum() == 1.0

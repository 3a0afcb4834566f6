"""Narrow metallic lobes, whose peaks are traced to the lamps."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import optisense as ots
from optisense.mechanics import CONFORMING
from optisense.optics import TactileImage
from optisense.optics.imaging import _traced_light
from optisense.optics.imaging.lamp_images import without_specks
from optisense.optics.radiance_cache import _lobe_branches, traced_lobes
from optisense.optics.radiance_cache._lobe_guide import LobeGuide
from optisense.optics.radiance_cache.lit_scene import TAIL_ROUGHNESS, LitScene
from optisense.optics.scene.sensor_scenes import SensorScenes

pytestmark = pytest.mark.usefixtures("few_contact_rays")

METAL = ots.set_value(ots.load("gelsight-mini-ideal"), "coating.specularity", 1.0)
SKIN_NOISE = 0.03
"""Relative error of the mean of the skin over two seeds and the three channels. One channel of one
seed differs by 3 % (standard deviation) between two ways to trace the rays."""
SKIN_ONLY = 0.02
"""Number of rays from contacts for each photon where only the skin around them is compared."""


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


def test_many_rays_of_a_contact_are_traced_in_several_passes() -> None:
    """They give the light of the path tracer (test_metal_patches.py)."""
    pixels = np.ones((10, 20), dtype=bool)
    samples = _traced_light.LobeSamples.of_contacts(pixels, 4, 5_000_000)
    assert samples.passes == 3
    assert samples.passes * samples.directions * 4 * 200 == pytest.approx(5e6, rel=0.01)


def test_rays_that_end_on_the_skin_and_guided_rays_change_no_mean(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(_traced_light, "CONTACT_RAYS", SKIN_ONLY)
    model = ots.OpticalModel(METAL)
    ball = [ots.Contact(ots.Sphere(3.0), at=(0.5, 0.3), depth=0.8)]

    def skin() -> np.ndarray:
        means = []
        for seed in range(2):
            image = model.render(
                ball, resolution=(64, 48), photons=300_000, seed=seed, skin=CONFORMING
            )
            inside = np.zeros_like(image.contact_mask)
            inside[8:-8, 8:-8] = True
            means.append(image.radiance[inside & ~image.contact_mask].mean(axis=0))
        return np.asarray(np.mean(means, axis=0))

    usual = skin()
    monkeypatch.setattr(traced_lobes, "GUIDED_SHARE", 0.7)
    guided = skin()
    of_skin = _traced_light.LobeSamples.of_skin
    monkeypatch.setattr(
        _traced_light.LobeSamples,
        "of_skin",
        lambda *arguments: replace(of_skin(*arguments), gathers=False),
    )
    followed = skin()

    for other in (guided, followed):
        assert other == pytest.approx(usual, rel=2 * SKIN_NOISE)
        assert np.mean(other / usual) == pytest.approx(1, rel=SKIN_NOISE)


def test_a_flush_plate_changes_no_light_of_the_skin_around_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The interfaces mirror the plate in place of the same skin behind it."""
    monkeypatch.setattr(_traced_light, "CONTACT_RAYS", SKIN_ONLY)
    model = ots.OpticalModel(ots.set_value(METAL, "coating.roughness", 0.14))
    plate = ots.Contact(ots.Cylinder(radius=3.0), depth=0.02)

    def render(contacts: list[ots.Contact], seed: int) -> TactileImage:
        return model.render(
            contacts, resolution=(64, 48), photons=600_000, seed=seed, skin=CONFORMING
        )

    ratios = []
    for seed in (0, 1):
        pressed, free = render([plate], seed), render([], seed)
        around = ~pressed.contact_mask
        around[:8], around[-8:], around[:, :8], around[:, -8:] = (False,) * 4
        ratios += list(pressed.radiance[around].mean(axis=0) / free.radiance[around].mean(axis=0))
    # With the light of the plate, but without the loss of that of the skin behind it, the mean is
    # 1.02.
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.012)


def test_directions_of_the_guide_have_its_density(monkeypatch: pytest.MonkeyPatch) -> None:
    found: list[LobeGuide] = []

    def kept(*arguments: Any) -> LobeGuide:
        found.append(of(*arguments))
        return found[-1]

    of = LobeGuide.of
    monkeypatch.setattr(LobeGuide, "of", kept)
    model = ots.OpticalModel(METAL)
    model.render(
        [ots.Contact(ots.Sphere(3.0))], resolution=(32, 24), photons=100_000, skin=CONFORMING
    )
    guide = max(found, key=lambda each: dr.width(each.found))
    points = np.flatnonzero(np.asarray(guide.found))
    assert len(points) > 30
    random = np.random.default_rng(0)
    count = 1_000_000
    for point in points[:: len(points) // 3]:
        number = dr.full(mi.UInt32, int(point), count)
        u, v, w = (mi.Float(random.random(count, dtype=np.float32)) for _ in range(3))
        anywhere = mi.warp.square_to_uniform_sphere(mi.Point2f(u, v))
        density = np.asarray(guide.density(number, anywhere))
        assert 4 * np.pi * density.mean() == pytest.approx(1.0, rel=0.06)
        # The mean inverse density of directions is the solid angle in which they are drawn.
        drawn = guide.sample(number, w, mi.Point2f(u, v))
        found_again = np.asarray(guide.density(number, drawn))
        inside = found_again > 0  # rounding puts a few at the edge of an ellipse outside of it
        assert inside.mean() > 0.999
        assert (1 / found_again[inside]).mean() == pytest.approx(
            4 * np.pi * (density > 0).mean(), rel=0.06
        )


def test_places_are_drawn_in_proportion_to_their_light() -> None:
    random = np.random.default_rng(0)
    wanted, weight = random.random(5000) < 0.8, random.random(5000).astype(np.float32)
    bits = mi.UInt32(random.integers(0, 2**32, 5000, dtype=np.uint32))
    kept, times = _lobe_branches.drawn(mi.Bool(wanted), mi.Float(weight), bits, 1000)
    kept, times = np.asarray(kept), np.asarray(times)
    assert len(kept) == 1000 and wanted[kept].all()
    assert (1 / times).sum() == pytest.approx(wanted.sum(), rel=0.1)
    assert weight[kept] / times == pytest.approx(weight[wanted].sum() / 1000, rel=1e-3)


def test_specks_are_spread_within_their_region() -> None:
    layers = np.zeros((1, 40, 40, 3), dtype=np.float32)
    layers[0, 20, 10], layers[0, 20, 30] = 1.0, 1.0
    region = np.zeros((40, 40), dtype=bool)
    region[:, :20] = True
    found = without_specks(layers, np.zeros_like(region), region)[0, ..., 0]
    assert found[:, :20].sum() == pytest.approx(1.0, rel=1e-5)
    assert found[20, 10] < 0.1
    assert found[20, 30] == 1.0 and found[:, 20:].sum() == 1.0
    # Light that is subtracted is spread likewise.
    less = without_specks(-layers, np.zeros_like(region), region)[0, ..., 0]
    assert less == pytest.approx(-found, abs=1e-7)


def test_even_light_of_specks_stays_even_at_the_edge_of_a_region() -> None:
    layers = np.zeros((1, 40, 80, 3), dtype=np.float32)
    layers[0, 2::5, 2::5] = 1.0
    region = np.zeros((40, 80), dtype=bool)
    region[:, :40] = True
    found = without_specks(layers, np.zeros_like(region), region, 1 / 4)[0, ..., 0]
    assert found[:, :40].sum() == pytest.approx(64.0, rel=1e-3)
    # Squares of five pixels with one speck each.
    squares = found[:, :40].reshape(8, 5, 8, 5).sum(axis=(1, 3))
    assert squares == pytest.approx(1.0, abs=0.03)

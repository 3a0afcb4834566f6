"""Sharpness, uniformity, shadow and power, where algebra or another way says what they are."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import optisense as ots
from optisense.design import set_value
from optisense.errors import ObjectiveError
from optisense.objectives import Evaluation, Settings, evaluate
from optisense.objectives._footprints import LEAST_CONTRAST, LINE_OF_BLUR, sharpness
from optisense.objectives._lighting import uniformity
from optisense.objectives.relighting import Relighting
from optisense.optics import OpticalModel

QUICK: dict[str, Any] = {
    "resolution": (80, 60),
    "ray_resolution": (80, 60),
    "photons": 200_000,
    "places": ((0.0, 0.0), (4.0, 3.0)),
}


@pytest.fixture(scope="module")
def mini() -> Evaluation:
    return Evaluation(OpticalModel(ots.load("gelsight-mini-ideal")), Settings(**QUICK))


def flat(pitch: float, stretch: float, blur: float | None, across: int = 400) -> Any:
    """A plane behind 40 x 30 rays, `pitch` mm apart; a camera `across` pixels wide."""
    column, row = np.meshgrid(np.arange(40.0), np.arange(30.0))
    points = np.stack([column * pitch, row * pitch * stretch, 0 * row], -1).astype(np.float32)
    seen, codes = np.ones((30, 40), dtype=bool), np.zeros((30, 40), dtype=np.uint32)
    rays = SimpleNamespace(points=points, hit=seen, reflections=codes)
    focus = None
    if blur is not None:
        focus = SimpleNamespace(in_pixels=lambda window: np.full((30, 40), blur))
    return SimpleNamespace(
        checked_rays=rays,
        design=SimpleNamespace(camera=SimpleNamespace(resolution=(across, 300))),
        model=SimpleNamespace(picture_chain=SimpleNamespace(focus=focus)),
    )


def test_without_blur_a_line_is_as_wide_as_the_cameras_own_pixel() -> None:
    """Rays are ten times as coarse as the pixels of the camera."""
    value, parts, _ = sharpness(flat(0.5, 1.0, None))
    assert value == pytest.approx(0.05, rel=1e-5)
    assert parts["pixel"] == pytest.approx(0.05, rel=1e-5)
    assert parts["blur"] == 0.0


def test_the_longer_side_of_a_footprint_counts() -> None:
    assert sharpness(flat(0.5, 3.0, None))[0] == pytest.approx(0.15, rel=1e-5)


def test_a_blur_leaves_a_tenth_of_the_contrast_of_the_finest_lines() -> None:
    """Measured on lines that are blurred: what is left of their first harmonic."""
    sigma = 2.0 * 0.5  # two pixels of half a mm
    value, parts, _ = sharpness(flat(0.5, 1.0, 2.0, across=40_000))
    assert parts["blur"] == pytest.approx(sigma, rel=1e-5)
    assert value == pytest.approx(LINE_OF_BLUR * sigma, rel=1e-3)
    x = np.linspace(-8 * sigma, 8 * sigma, 4001)
    weights = np.exp(-0.5 * (x / sigma) ** 2)
    left = float((weights * np.cos(math.pi * x / value)).sum() / weights.sum())
    assert left == pytest.approx(LEAST_CONTRAST, rel=0.01)


def test_a_lens_with_depth_of_field_is_less_sharp_than_a_pinhole(mini: Evaluation) -> None:
    from optisense import library

    blurred = library.with_imaging(ots.load("gelsight-mini-ideal"), "pi-v2", focus_distance=24.0)
    found = evaluate(Evaluation(OpticalModel(blurred), Settings(**QUICK)), "sharpness")
    assert found.failure is None
    assert found.parts["blur"] > 0.0
    assert found.value > found.parts["pixel"]
    assert evaluate(mini, "sharpness").parts["blur"] == 0.0


def lit(radiance: np.ndarray) -> Any:
    """An evaluation whose untouched image is given."""
    normals = np.zeros_like(radiance)
    normals[..., 2] = 1.0
    image = SimpleNamespace(radiance=radiance, normals=normals)
    view = SimpleNamespace(refuse_less=lambda settings: None)
    return SimpleNamespace(untouched=image, view=view, settings=Settings())


def test_uniformity_is_the_ratio_of_percentiles_of_the_least_even_colour() -> None:
    """A colour that falls off evenly from 1 to a share has its 5th percentile near the share."""
    ramp = np.linspace(0.0, 1.0, 2001)
    planes = [1.0 - 0.2 * ramp, 1.0 - 0.8 * ramp, 0.0 * ramp]
    value, parts, _ = uniformity(lit(np.stack(planes, -1)[:, None]))
    assert value == pytest.approx((1 - 0.8 * 0.95) / (1 - 0.8 * 0.05), rel=1e-6)
    assert parts["red"] == pytest.approx((1 - 0.2 * 0.95) / (1 - 0.2 * 0.05), rel=1e-6)
    assert parts["least_even"] == "green"
    assert "blue" not in parts  # it is not lit


def test_darkness_has_no_uniformity() -> None:
    with pytest.raises(ObjectiveError, match="no light"):
        uniformity(lit(np.zeros((20, 20, 3))))


def test_power_is_the_flux_of_all_lights(mini: Evaluation) -> None:
    design = ots.load("gelsight-mini-ideal")
    score = evaluate(mini, "power")
    each = {name: len(group.lights) * group.flux for name, group in design.lights.items()}
    assert score.value == pytest.approx(sum(each.values()))
    assert score.parts["groups"] == pytest.approx(each)
    name = next(iter(design.lights))
    brighter = set_value(design, f"lights.{name}.flux", 3.0 * design.lights[name].flux)
    more = evaluate(OpticalModel(brighter), "power", **QUICK).value
    assert more == pytest.approx(score.value + 2.0 * each[name])


def test_a_deeper_ball_throws_a_larger_shadow(mini: Evaluation) -> None:
    usual = evaluate(mini, "shadow")
    assert usual.failure is None
    assert 0.0 < usual.value < 0.5
    deeper = Evaluation(mini.model, replace(mini.settings, depth=0.9))
    assert evaluate(deeper, "shadow").value > 1.3 * usual.value


def test_the_shadow_is_that_of_the_lights_that_shine(mini: Evaluation) -> None:
    """Without red light no skin loses red, whether rendered so or relit."""
    design = ots.load("gelsight-mini-ideal")
    red = [name for name, group in design.lights.items() if group.channel_flux()[0] > 0.0]
    dark = design
    for name in red:
        dark = set_value(dark, f"lights.{name}.flux", 0.0)
    relit = Relighting(Evaluation(mini.model, mini.settings)).relit(dark)
    parts = evaluate(relit, "shadow").parts
    assert parts["red"] == 0.0
    assert parts["blue"] == pytest.approx(evaluate(mini, "shadow").parts["blue"], abs=0.01)

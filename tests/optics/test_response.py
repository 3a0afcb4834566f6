"""From radiance to pictures: the transfer curve, overexposure, other lights."""

from __future__ import annotations

import numpy as np
import pytest

from optisense.design.colour import encode, srgb_curve
from optisense.optics.camera.response import picture, saturate
from optisense.optics.imaging.tactile_image import TactileImage


def test_eight_bits_are_the_transfer_curve_rounded() -> None:
    linear = np.linspace(-0.1, 1.2, 200_001)
    exact = 255 * srgb_curve(linear)
    assert np.abs(encode(linear) - exact).max() < 0.5 + 1e-3
    assert encode(np.array([0.0, 1.0, 1.7])).tolist() == [0, 255, 255]


def test_a_channel_that_overflows_whitens_the_others_around_it() -> None:
    image = np.full((60, 80, 3), 0.2, dtype=np.float32)
    image[30, 40, 0] = 3.0
    shown = saturate(image)
    assert shown[30, 40, 1] > 0.2 and shown[31, 41, 2] > 0.2
    assert np.array_equal(shown[0], image[0])
    assert shown.dtype == np.float32 and shown.max() <= 1.0


def test_other_lights_scale_the_layers_of_unit_lights() -> None:
    generator = np.random.default_rng(1)
    units = {name: generator.random((5, 7, 3)).astype(np.float32) for name in ("a", "b")}
    blank = np.zeros((5, 7, 3), dtype=np.float32)
    image = TactileImage(dict(units), blank, blank[..., 0] > 0, blank, unit_layers=units)
    relit = image.relight({"a": (1.0, 0.0, 2.0), "b": 0.5})
    expected = units["a"] * [1.0, 0.0, 2.0] + 0.5 * units["b"]
    assert relit.radiance == pytest.approx(expected, rel=1e-6)
    assert image.radiance == pytest.approx(units["a"] + units["b"], rel=1e-6)
    assert np.array_equal(relit.picture(0.3), picture(expected, 0.3))

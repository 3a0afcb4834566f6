"""From radiance to pictures: the transfer curve, overexposure, other lights."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import pytest

from optisense import sensors
from optisense.design.colour import encode, srgb_curve
from optisense.design.responses import (
    USUAL_RESPONSE,
    CameraResponse,
    FullWellResponse,
    PictureChain,
)
from optisense.optics.imaging.tactile_image import TactileImage, picture


def test_eight_bits_are_the_transfer_curve_rounded() -> None:
    linear = np.linspace(-0.1, 1.2, 200_001)
    exact = 255 * srgb_curve(linear)
    assert np.abs(encode(linear) - exact).max() < 0.5 + 1e-3
    assert encode(np.array([0.0, 1.0, 1.7])).tolist() == [0, 255, 255]


def test_a_channel_that_overflows_whitens_the_others_around_it() -> None:
    image = np.full((60, 80, 3), 0.2, dtype=np.float32)
    image[30, 40, 0] = 3.0
    shown = USUAL_RESPONSE.respond(image)
    assert shown[30, 40, 1] > 0.2 and shown[31, 41, 2] > 0.2
    assert np.array_equal(shown[0], image[0])
    assert shown.dtype == np.float32 and shown.max() <= 1.0


def test_light_far_from_a_pixel_that_overflows_stays_as_it_is() -> None:
    response = FullWellResponse(blur=0.02)
    image = np.full((80, 200, 3), 0.2, dtype=np.float32)
    image[40, 100, 0] = 3.0
    shown, reach = response.respond(image), response.reach(200)
    assert np.array_equal(shown[:, 101 + reach :], image[:, 101 + reach :])
    assert shown[40, 103, 1] > 0.2
    part = response.respond(image[:, 80:120], 200)
    np.testing.assert_allclose(part[:, 19:22], shown[:, 99:102], atol=1e-6)


def test_a_lower_full_well_overflows_sooner() -> None:
    image = np.full((40, 40, 3), 0.2, dtype=np.float32)
    image[20, 20, 0] = 0.8
    assert not USUAL_RESPONSE.spreads(image) and FullWellResponse(full_well=0.5).spreads(image)
    assert FullWellResponse(full_well=0.5).respond(image)[20, 21, 1] > 0.2


class SquareRoot(CameraResponse):
    """A camera without blooming that stores the square root."""

    kind: Literal["test-square-root"] = "test-square-root"

    def respond(self, exposed: Any, width: int | None = None) -> Any:
        return np.clip(exposed, 0.0, 1.0).astype(np.float32)

    def curve(self, linear: Any) -> Any:
        return np.sqrt(linear)


class Halved(FullWellResponse):
    """A sensor that reads half of the light."""

    kind: Literal["test-halved"] = "test-halved"  # type: ignore[assignment]

    def respond(self, exposed: Any, width: int | None = None) -> Any:
        return 0.5 * super().respond(exposed, width)


class FilledByHalf(FullWellResponse):
    """A sensor whose pixels take half of the light."""

    kind: Literal["test-filled-by-half"] = "test-filled-by-half"  # type: ignore[assignment]

    def filled(self, exposed: Any, width: int | None = None) -> Any:
        return super().filled(0.5 * exposed, width)


@pytest.mark.parametrize("response", [Halved(), FilledByHalf()])
def test_whatever_a_kind_overrides_counts_with_stray_light(response: CameraResponse) -> None:
    light = np.full((4, 4, 3), 0.6, dtype=np.float32)
    assert PictureChain(response).respond(light) == pytest.approx(0.3)
    stray = PictureChain(response, stray_light=(0.1, 0.1, 0.1))
    assert stray.respond(light) == pytest.approx(0.4)


def test_an_image_is_stored_as_its_camera_does() -> None:
    light = np.random.default_rng(2).random((5, 7, 3)).astype(np.float32)
    chain = PictureChain(SquareRoot())
    image = TactileImage({"all": light}, light, light[..., 0] > 2, light, chain=chain)
    stored = image.picture(0.25).astype(float) / 255
    assert np.abs(stored**2 - 0.25 * light).max() < 2 / 255
    assert image.auto_exposure() == pytest.approx(0.55 / np.percentile(light.max(axis=2), 95))


def test_a_design_of_the_usual_response_is_written_as_ever() -> None:
    camera = sensors.load("builtin:gelsight-mini-ideal").camera
    assert "response" not in camera.model_dump(mode="json")
    camera.response = SquareRoot()
    written = camera.model_dump(mode="json")
    assert written["response"] == {"kind": "test-square-root"}
    assert type(camera).model_validate(written).any_response == SquareRoot()


def test_other_lights_scale_the_layers_of_unit_lights() -> None:
    generator = np.random.default_rng(1)
    units = {name: generator.random((5, 7, 3)).astype(np.float32) for name in ("a", "b")}
    blank = np.zeros((5, 7, 3), dtype=np.float32)
    image = TactileImage(dict(units), blank, blank[..., 0] > 0, blank, unit_layers=units)
    relit = image.relight({"a": (1.0, 0.0, 2.0), "b": (0.5, 0.5, 0.5)})
    expected = units["a"] * [1.0, 0.0, 2.0] + 0.5 * units["b"]
    assert relit.radiance == pytest.approx(expected, rel=1e-6)
    assert image.radiance == pytest.approx(units["a"] + units["b"], rel=1e-6)
    assert np.array_equal(relit.picture(0.3), picture(expected, 0.3))

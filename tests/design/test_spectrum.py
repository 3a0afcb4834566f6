"""LEDs whose light spreads over channels, by their datasheets."""

from __future__ import annotations

import numpy as np
import pytest

import optisense as ots
from optisense.design.lights import LightSpectra, Spectrum
from optisense.design.materials.optical_constants import CHANNEL_WAVELENGTHS
from optisense.errors import DesignError
from optisense.optics import OpticalModel

RED, GREEN, BLUE = CHANNEL_WAVELENGTHS


@pytest.mark.parametrize("wavelength", [400.0, 465.0, 500.0, 528.0, 590.0, 622.0, 700.0])
@pytest.mark.parametrize("half_width", [5.0, 20.0, 100.0])
def test_no_light_is_made_or_lost(wavelength: float, half_width: float) -> None:
    shares = Spectrum(wavelength=wavelength, half_width=half_width).shares()
    assert shares.sum() == pytest.approx(1.0) and shares.min() >= 0.0


def test_a_narrow_line_is_shared_by_its_distance_to_the_channels() -> None:
    between = Spectrum(wavelength=600.0, half_width=2.0).shares()
    assert between == pytest.approx([(600 - GREEN) / (RED - GREEN), (RED - 600) / (RED - GREEN), 0])
    assert Spectrum(wavelength=440.0, half_width=2.0).shares() == pytest.approx([0, 0, 1])


def test_a_wide_line_at_a_channel_spreads_by_its_mean_distance() -> None:
    """Of a Gaussian, half lies below; its mean distance there is sigma times sqrt(2 / pi)."""
    sigma = 20.0 / 2.354820
    shares = Spectrum(wavelength=RED, half_width=20.0).shares()
    assert shares[1] == pytest.approx(sigma / np.sqrt(2 * np.pi) / (RED - GREEN), rel=1e-3)


def test_only_dies_with_a_spectrum_spread() -> None:
    spread = LightSpectra(red=Spectrum(wavelength=600.0)).spread()
    assert np.array_equal(spread[1:], np.eye(3)[1:]) and spread[0, 1] > 0.2


def test_a_red_led_lights_the_green_channel_of_its_layer() -> None:
    plain = ots.load("gelsight-mini-ideal")
    seen = ots.set_value(
        plain, "lights.red.spectrum", {"red": {"wavelength": 610, "half_width": 18}}
    )
    shares = Spectrum(wavelength=610, half_width=18).shares()
    assert seen.lights["red"].channel_flux() == pytest.approx(plain.lights["red"].flux * shares)
    image = OpticalModel(seen).render(resolution=(32, 24), photons=20_000)
    red = image.layers["red"].mean(axis=(0, 1))
    assert red / red.sum() == pytest.approx(shares, abs=1e-5)
    wider = ots.set_value(seen, "lights.red.spectrum.red.half_width", 60.0)
    assert wider.lights["red"].channel_flux()[2] >= 0.0


@pytest.mark.parametrize(
    ("spectrum", "message"),
    [
        ({"red": {"wavelength": -622}}, "greater than or equal to 380"),
        ({"red": {"wavelength": 0.622}}, "greater than or equal to 380"),
        ({"red": {"wavelength": 622, "half_width": 0}}, "greater than 0"),
        ({"rde": {"wavelength": 622}}, "Did you mean 'red'"),
    ],
)
def test_what_no_led_has_is_refused(spectrum: object, message: str) -> None:
    with pytest.raises(DesignError, match=message):
        ots.set_value(ots.load("gelsight-mini-ideal"), "lights.red.spectrum", spectrum)

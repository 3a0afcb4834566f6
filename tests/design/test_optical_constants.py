"""Index and absorption of clear materials: published formulas and values, and what is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from optisense.design.materials import Dielectric
from optisense.design.materials.optical_constants import (
    CHANNEL_WAVELENGTHS,
    cauchy_index,
    sellmeier_index,
)

PDMS = {"sellmeier_b": (1.0093, 0.0, 0.0), "sellmeier_c": (0.013185, 0.0, 0.0)}


def test_sellmeier_gives_the_catalogue_indices_of_bk7() -> None:
    """Schott's coefficients and catalogue: nd = 1.51680, nF = 1.52238, nC = 1.51432."""
    b = (1.03961212, 0.231792344, 1.01046945)
    c = (0.00600069867, 0.0200179144, 103.560653)
    found = sellmeier_index(b, c, [587.56, 486.13, 656.27])
    assert found == pytest.approx([1.51680, 1.52238, 1.51432], abs=2e-5)


def test_cauchy_is_a_power_series_of_the_inverse_square() -> None:
    assert cauchy_index((1.5, 0.004, 1e-4), 500.0) == pytest.approx(1.5 + 0.016 + 0.0016)


def test_a_formula_is_evaluated_at_the_wavelengths_of_the_channels() -> None:
    gel = Dielectric(ior=1.4295, **PDMS)
    square = (np.array(CHANNEL_WAVELENGTHS) / 1000) ** 2
    expected = np.sqrt(1 + 1.0093 * square / (square - 0.013185))
    assert gel.medium().indices == pytest.approx(expected, rel=1e-12)
    assert gel.medium().ior == 1.4295


def test_without_dispersion_all_channels_have_one_index() -> None:
    assert Dielectric(ior=1.41).medium().indices is None


def test_extinction_and_absorption_are_one_thing() -> None:
    """4 pi k over the wavelength: k = 1e-6 at 630 nm is 0.01995 per mm."""
    assert Dielectric(ior=1.5, extinction=(1e-6,) * 3).absorption_coefficient()[0] == (
        pytest.approx(0.0199466, rel=1e-5)
    )


@pytest.mark.parametrize("absorption", [0.0, 0.0052, 0.5])
def test_a_measured_plate_gives_back_the_coefficient_that_it_was_made_of(
    absorption: float,
) -> None:
    """A plate of index 1.491: reflections summed one by one."""
    reflected = (0.491 / 2.491) ** 2
    left = np.exp(-absorption * 3.0)
    passed = sum((1 - reflected) ** 2 * left * (reflected * left) ** (2 * k) for k in range(40))
    plate = Dielectric(ior=1.491, transmittance=(passed,) * 3, thickness=3.0)
    assert plate.absorption_coefficient() == pytest.approx((absorption,) * 3, abs=1e-8)


def test_a_clear_material_says_nothing_of_absorption() -> None:
    assert "absorb" not in Dielectric(ior=1.5).in_words()
    assert "absorbs 0.03 /mm" in Dielectric(ior=1.5, absorption=(0.01, 0.02, 0.03)).in_words()


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"ior": -1.5}, "greater than or equal to 1"),
        ({"dispersion": (1.5, -1.5, 1.5)}, "greater than or equal to 1"),
        ({"absorption": (0.1, -0.1, 0.1)}, "greater than or equal to 0"),
        ({"extinction": (-1e-6,) * 3}, "greater than or equal to 0"),
        ({"absorption": (0.1,) * 3, "extinction": (1e-6,) * 3}, "given twice"),
        ({"transmittance": (0.9,) * 3}, "needs 'thickness'"),
        ({"thickness": 3.0}, "needs 'transmittance'"),
        ({"transmittance": (0.9,) * 3, "thickness": 0.0}, "greater than 0"),
        ({"transmittance": (0.9, 0.9, 0.97), "thickness": 3.0}, "passes at most 0.923"),
        ({"transmittance": (0.9, 0.9, 0.0), "thickness": 3.0}, "does not follow"),
        ({"sellmeier_b": (1.0, 0.0, 0.0)}, "needs 'sellmeier_c'"),
        ({"ior": 1.3, **PDMS}, "gives an index of 1.431 at 589 nm"),
        ({"sellmeier_b": (1.0, 0, 0), "sellmeier_c": (13185.0, 0, 0)}, "at 589 nm"),
        ({"cauchy": (1.5, 4000.0, 0.0)}, "at 589 nm"),
        ({"cauchy": (1.49, 0.004, 0.0), "dispersion": (1.5,) * 3}, "given twice"),
    ],
)
def test_what_no_material_can_be_is_refused(fields: dict[str, Any], message: str) -> None:
    with pytest.raises(ValidationError, match=message):
        Dielectric(**{"ior": 1.5, **fields})

"""The built-in GelSight Mini beside a picture of a real one: what the page says is measured."""

from __future__ import annotations

from importlib.resources import files

import numpy as np
import pytest

from optisense.design import set_value
from optisense.optics import OpticalModel
from optisense.report._page import render_page
from optisense.report.real_sensor import RealComparison, compare_with_real, has_real_picture
from optisense.sensors import load


@pytest.fixture(scope="module")
def model() -> OpticalModel:
    return OpticalModel(load("gelsight-mini"))


@pytest.fixture(scope="module")
def found(model: OpticalModel) -> RealComparison:
    return compare_with_real(model, photons=100_000)


def test_only_the_very_sensor_has_a_real_picture() -> None:
    mini = load("gelsight-mini")
    assert has_real_picture(mini)
    assert not has_real_picture(set_value(mini, "coating.specularity", 0.3))
    assert not has_real_picture(load("gelsight-mini-spherical"))
    assert not has_real_picture(load("gelsight-mini-ideal"))
    assert not has_real_picture(load("gelbelt"))


def test_both_pictures_are_alike_bright_and_show_the_ball_at_one_place(
    found: RealComparison,
) -> None:
    assert found.real.shape == found.model.shape == (240, 320, 3)
    assert np.median(found.model) == pytest.approx(np.median(found.real), rel=0.15)
    assert found.shading[0] > 0.9 and found.shading[2] > 0.5  # these come from the same sides


def test_the_green_light_is_as_even_as_in_the_real_sensor(found: RealComparison) -> None:
    """Near the green LEDs, on the right, it is nearly as strong as in the middle."""
    real, simulated = (
        picture[:, 280:, 1].mean() / picture[:, 140:180, 1].mean()
        for picture in (found.real.astype(float), found.model.astype(float))
    )
    assert simulated == pytest.approx(real, rel=0.2)


def test_figures_are_of_the_pictures(found: RealComparison) -> None:
    apart = found.real.astype(float) - found.model
    assert found.difference == pytest.approx(np.sqrt((apart**2).mean()))
    assert found.shares.sum(axis=1) == pytest.approx([1.0, 1.0])
    assert 2.0 < found.difference < 0.4 * found.own_spread


def test_the_page_shows_both_with_their_source(model: OpticalModel, found: RealComparison) -> None:
    image = model.render((), resolution=(32, 24), photons=20_000)
    text = render_page(model.design, image, real=found)
    assert f"{found.difference:.0f} of 255 levels" in text
    assert f"{found.shading[1]:.2f} in green" in text
    assert "github.com/rpl-cmu/gelslam" in text
    assert "Beside a real GelSight Mini" not in render_page(model.design, image)
    notice = (files("optisense.report") / "real" / "NOTICE.md").read_text(encoding="utf-8")
    assert "Permission is hereby granted" in notice

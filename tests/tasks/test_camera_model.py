"""Rays and pinholes of datasets: they say where a pixel's light comes from, through the glass."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from optisense import OpticalModel, sensors
from optisense.design import SensorDesign
from optisense.design.lenses.distortion import BrownConrady, KannalaBrandt
from optisense.geometry import Contact, Sphere
from optisense.tasks._camera_model import Pinhole, camera_model, fit_pinhole, ray_arrays

SIZE = (80, 60)


@pytest.fixture(scope="module")
def bare(mini: OpticalModel) -> SensorDesign:
    """A camera that looks at the skin with nothing in between."""
    design = mini.design.copy()
    design.cages = {}
    design.parts = {"skin": design.parts["skin"]}
    return design


def test_without_glass_the_design_is_right(bare: SensorDesign) -> None:
    """In OpenCV's convention, and counted from the edge of the picture."""
    rays = OpticalModel(bare).chief_rays(SIZE)
    told = camera_model(bare.camera, rays)
    assert told["as_designed"]["error"]["most_pixels"] < 2e-3
    assert told["fitted"]["error"]["most_pixels"] < 2e-3
    assert told["fitted"]["focal_pixels"] == pytest.approx(
        told["as_designed"]["focal_pixels"], rel=1e-3
    )


@pytest.mark.parametrize("size", [SIZE, (80, 40)])
def test_the_distortion_of_the_design_is_that_of_its_pinhole(
    bare: SensorDesign, size: tuple[int, int]
) -> None:
    lens = {"k1": -0.25, "k2": 0.06, "p1": 0.01, "p2": -0.015, "centre": [0.47, 0.56]}
    bent = bare.copy()
    bent.camera.distortion = BrownConrady.model_validate(lens)
    told = camera_model(bent.camera, OpticalModel(bent).chief_rays(size))
    assert told["as_designed"]["distortion"] == [-0.25, 0.06, 0.01, -0.015, 0.0]
    assert told["as_designed"]["centre_pixels"] == pytest.approx(
        [0.47 * 80, 0.5 * size[1] + 0.06 * 60]
    )
    assert told["as_designed"]["error"]["most_pixels"] < 2e-3
    assert told["fitted"]["error"]["most_pixels"] < 2e-3


def test_a_distortion_that_opencv_has_not_is_noted(bare: SensorDesign) -> None:
    rays = OpticalModel(bare).chief_rays(SIZE)
    assert "note" not in camera_model(bare.camera, rays)
    lens = KannalaBrandt(k1=0.1)  # in place of a kind of another package
    other = bare.camera.model_copy(update={"distortion": lens})
    assert "'kannala-brandt'" in camera_model(other, rays)["note"]


def test_through_glass_only_the_fitted_one_is(mini: OpticalModel) -> None:
    """A pinhole of the design is a millimetre off on a GelSight Mini; the fitted one, 0.01 mm."""
    told = camera_model(mini.design.camera, mini.chief_rays(SIZE))
    assert 0.8 < told["as_designed"]["error"]["rms_mm"] < 1.4
    assert told["fitted"]["error"]["rms_mm"] < 0.01


def test_a_pinhole_is_found_again() -> None:
    generator = np.random.default_rng(0)
    true = Pinhole(
        np.array([[0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]),
        np.array([0.4, -0.2, 30.0]),
        np.array([310.0, 305.0]),
        np.array([158.0, 122.0]),
        np.array([-0.15, 0.03]),
    )
    points = generator.uniform((-8.0, -6.0, -3.0), (8.0, 6.0, 3.0), (400, 3))
    pixels, _ = true.project(points)
    start = replace(true, translation=np.array([0.0, 0.0, 27.0]), focal=np.array([280.0, 280.0]))
    start = replace(start, centre=np.array([160.0, 120.0]), radial=np.zeros(2))
    found = fit_pinhole(start, points, pixels)
    assert found.errors(points, pixels)["most_pixels"] < 1e-6
    np.testing.assert_allclose(found.focal, true.focal, rtol=1e-6)
    np.testing.assert_allclose(found.radial, true.radial, atol=1e-6)


def test_what_is_pressed_lies_on_the_rays(mini: OpticalModel) -> None:
    """The pressed skin of a conforming ball, traced on its own, is met by the rays of the skin at
    rest, gone back some way.
    """
    rest = ray_arrays(mini.chief_rays(SIZE))
    ball = Contact(Sphere(2.0), at=(1.0, 0.5), depth=0.8)
    pressed = mini.chief_rays(SIZE, [ball], "conforming")
    away = (pressed.points - rest["points"])[pressed.contact_mask].astype(float)
    directions = rest["directions"][pressed.contact_mask].astype(float)
    along = (away * directions).sum(axis=1)
    assert along.max() > 0.7
    assert (along > -1e-3).all()
    assert np.linalg.norm(away - along[:, None] * directions, axis=1).max() < 2e-3


def test_a_fisheye_has_no_pinhole() -> None:
    design = sensors.load("builtin:gelsight360")
    told = camera_model(design.camera, OpticalModel(design).chief_rays((40, 40)))
    assert told == {"as_designed": None, "fitted": None}

"""The picture of a render's page: its mixer shows what the sensor would with other lights."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from optisense.design import SensorDesign
from optisense.design.responses.tone_curve import GammaCurve
from optisense.geometry import Contact, Sphere
from optisense.optics import OpticalModel, TactileImage
from optisense.report import write_report
from optisense.sensors import gelsight_mini_ideal

from .conftest import Open
from .visit import Visit

BALL = Contact(Sphere(radius=1.5), at=(0.0, 0.0), depth=0.8)
READ = """() => {
  const canvas = document.getElementById("picture");
  return [...canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data];
}"""


@pytest.fixture(scope="module")
def design() -> SensorDesign:
    return gelsight_mini_ideal()


@pytest.fixture(scope="module")
def image(design: SensorDesign) -> TactileImage:
    return OpticalModel(design).render([BALL], resolution=(64, 48), photons=40_000)


def opened(visit: Open, path: Path) -> Visit:
    window = visit(path, (640, 600))
    window.page.wait_for_selector("#picture:not([hidden])")
    return window


def shown(window: Visit) -> np.ndarray:
    """(h, w, 3) of the picture, as the page drew it."""
    canvas = window.page.locator("#picture")
    size = [int(canvas.get_attribute(side) or 0) for side in ("height", "width")]
    return np.array(window.page.evaluate(READ)).reshape(*size, 4)[:, :, :3]


def mix(window: Visit, weights: dict[str, float]) -> None:
    for name, weight in weights.items():
        slider = window.page.locator(f'.mixer input[data-group="{name}"]')
        slider.fill(str(round(100 * weight)))


MIXES = (
    {"red": 2.0, "green": 2.0, "blue": 2.0},  # overexposed
    {"red": 0.0, "green": 1.5, "blue": 0.35},
    {"red": 0.2, "green": 0.2, "blue": 0.2},
)


@pytest.mark.parametrize("brighter", [1.0, 4.0])  # at the latter single layers are overexposed
def test_the_mixer_shows_the_relit_picture(
    visit: Open, design: SensorDesign, image: TactileImage, tmp_path: Path, brighter: float
) -> None:
    """Within one grey level."""
    exposure = brighter * image.auto_exposure()
    path = write_report(tmp_path / "report.html", design, image, [BALL], exposure=exposure)
    window = opened(visit, path)
    np.testing.assert_array_equal(shown(window), image.picture(exposure))
    for weights in MIXES:
        mix(window, weights)
        assert difference(window, design, image, weights, exposure) <= 1
    window.page.get_by_role("button", name="As designed").click()
    np.testing.assert_array_equal(shown(window), image.picture(exposure))


def difference(
    window: Visit,
    design: SensorDesign,
    image: TactileImage,
    weights: dict[str, float],
    exposure: float,
) -> int:
    """Grey levels between what the page shows and the picture under those lights, at most."""
    lights = {name: weights[name] * group.channel_flux() for name, group in design.lights.items()}
    expected = image.relight(lights).picture(exposure)
    return int(np.abs(shown(window) - expected.astype(int)).max())


def test_the_mixer_knows_the_processor_of_the_camera(
    visit: Open, design: SensorDesign, image: TactileImage, tmp_path: Path
) -> None:
    """Its gains, its matrix, whose layers have negative levels, and its tone curve."""
    design = design.copy()
    matrix = ((1.5, -0.4, -0.1), (-0.3, 1.6, -0.3), (0.0, -0.5, 1.5))
    design.camera.white_balance, design.camera.colour_matrix = (1.2, 1.0, 1.4), matrix
    design.camera.tone_curve = GammaCurve(gamma=1.8)
    seen = replace(image, chain=design.camera.picture_chain())
    exposure = 0.4 * seen.auto_exposure()
    path = write_report(tmp_path / "report.html", design, seen, [BALL], exposure=exposure)
    window = opened(visit, path)
    for weights in MIXES[1:]:
        mix(window, weights)
        assert difference(window, design, seen, weights, exposure) <= 1


def test_a_pixel_is_read_by_mouse_and_keys(
    visit: Open, design: SensorDesign, image: TactileImage, tmp_path: Path
) -> None:
    exposure = image.auto_exposure()
    path = write_report(tmp_path / "report.html", design, image, [BALL], exposure=exposure)
    window = opened(visit, path)
    cross = window.page.locator("#cross")
    box = cross.bounding_box()
    assert box
    window.page.mouse.move(box["x"] + 10.5 / 64 * box["width"], box["y"] + 5.5 / 48 * box["height"])
    assert window.page.locator("#reading").inner_text().startswith(told(image, exposure, 10, 5))
    cross.focus()
    for key in ("ArrowRight", "Shift+ArrowDown", "ArrowUp", "ArrowLeft", "ArrowLeft"):
        window.page.keyboard.press(key)
    assert window.page.locator("#reading").inner_text().startswith(told(image, exposure, 9, 14))


def told(image: TactileImage, exposure: float, column: int, row: int) -> str:
    red, green, blue = image.picture(exposure)[row, column]
    return f"column {column}, row {row}: R {red} G {green} B {blue}"

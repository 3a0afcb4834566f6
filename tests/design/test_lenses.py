"""Distortion, shading and blur of lenses: closed forms, inverses, and impossible lenses."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import optisense as ots
from optisense.design import Camera, SensorDesign, check_design, projection
from optisense.design.lenses.blur import Defocus, GaussianBlur, blurred
from optisense.design.lenses.distortion import BrownConrady, KannalaBrandt, LensDistortion
from optisense.design.lenses.film import film_places
from optisense.design.lenses.shading import RadialShading, TableShading
from optisense.design.projection import directions, folding_angle, ideal_places, picture_places
from optisense.errors import DesignError

BARREL = BrownConrady(k1=-0.28, k2=0.07, p1=1e-3, p2=-2e-3, k3=-0.008)
FISHEYE = KannalaBrandt(k1=-0.013, k2=0.0021, k3=-0.0007, k4=0.0001)


def mini(**changes: Any) -> SensorDesign:
    """GelSight Mini with other values of its camera."""
    design = ots.load("builtin:gelsight-mini-ideal")
    camera = design.camera.model_dump(mode="json") | changes
    return ots.set_value(design, "camera", camera)


def grid(reach: float) -> tuple[Any, Any]:
    """Places on the image plane, as far as `reach` from its middle along x and y."""
    return np.meshgrid(np.linspace(-reach, reach, 41), np.linspace(-0.8 * reach, 0.8 * reach, 31))


def test_a_grid_is_distorted_as_the_formula_of_brown_and_conrady_says() -> None:
    x, y = grid(0.6)
    r2 = x**2 + y**2
    radial = 1 - 0.28 * r2 + 0.07 * r2**2 - 0.008 * r2**3
    shown = BARREL.distort(x, y, BARREL.coefficients())
    assert shown[0] == pytest.approx(x * radial + 2e-3 * x * y - 2e-3 * (r2 + 2 * x**2), abs=1e-14)
    assert shown[1] == pytest.approx(y * radial + 1e-3 * (r2 + 2 * y**2) - 4e-3 * x * y, abs=1e-14)


def test_a_grid_is_distorted_as_the_formula_of_kannala_and_brandt_says() -> None:
    angle = np.radians(np.linspace(0.0, 95.0, 39))
    turn = np.radians(30.0)
    shown = FISHEYE.distort(angle * np.cos(turn), angle * np.sin(turn), FISHEYE.coefficients())
    t = angle
    expected = t * (1 - 0.013 * t**2 + 0.0021 * t**4 - 0.0007 * t**6 + 0.0001 * t**8)
    assert np.hypot(*shown) == pytest.approx(expected, abs=1e-14)
    assert shown[1] == pytest.approx(np.tan(turn) * shown[0], abs=1e-14)


@pytest.mark.parametrize(("lens", "reach"), [(BARREL, 0.75), (FISHEYE, 1.3)])
def test_undistorting_takes_a_distorted_grid_back(lens: LensDistortion, reach: float) -> None:
    x, y = grid(reach)
    numbers = lens.coefficients()
    back = lens.undistort(*lens.distort(x, y, numbers), numbers)
    assert np.abs(np.array(back) - [x, y]).max() < 1e-9


@pytest.mark.parametrize("lens", [BARREL, FISHEYE])
def test_jacobian_is_that_of_differences(lens: LensDistortion) -> None:
    x, y = grid(0.7)
    numbers, step = lens.coefficients(), 1e-6
    a, b, c, d = lens.jacobian(x, y, numbers)
    by_x = np.subtract(lens.distort(x + step, y, numbers), lens.distort(x - step, y, numbers))
    by_y = np.subtract(lens.distort(x, y + step, numbers), lens.distort(x, y - step, numbers))
    assert np.abs(np.array([a, c]) - by_x / (2 * step)).max() < 1e-8
    assert np.abs(np.array([b, d]) - by_y / (2 * step)).max() < 1e-8


CAMERAS = [
    {},
    {"distortion": {"kind": "brown-conrady", "k1": -0.2, "p1": 0.01, "centre": [0.47, 0.53]}},
    {"distortion": {"kind": "brown-conrady", "k1": 0.3}},
    {"projection": "equidistant", "fov": 120.0},
    {
        "projection": "equidistant",
        "fov": 150.0,
        "distortion": {"kind": "kannala-brandt", "k1": -0.03, "k2": 0.002},
    },
]


@pytest.mark.parametrize("changes", CAMERAS)
def test_a_point_that_a_place_looks_at_is_shown_there(changes: dict[str, Any]) -> None:
    camera = mini(**changes).camera
    across, down = np.meshgrid(np.linspace(0.0, 1.0, 9), np.linspace(0.0, 1.0, 7))
    rays = directions(camera, across, down).reshape(-1, 3)
    assert np.linalg.norm(rays, axis=1) == pytest.approx(1.0)
    points = np.array(camera.position) + 17.0 * rays
    found = picture_places(camera, points)
    assert found[0] == pytest.approx(across.ravel(), abs=1e-9)
    assert found[1] == pytest.approx(down.ravel(), abs=1e-9)


def test_a_pincushion_shows_less_and_a_barrel_more_than_the_field_of_view() -> None:
    across, middle = np.array([0.0, 1.0]), np.array([0.5, 0.5])

    def width(k1: float) -> float:
        lens = mini(distortion={"kind": "brown-conrady", "k1": k1}).camera
        left, right = directions(lens, across, middle)
        return float(np.degrees(np.arccos(left @ right)))

    assert width(0.0) == pytest.approx(52.157)
    assert width(0.2) < 52.0 and width(-0.2) > 52.3


def test_a_lens_that_folds_is_found_where_it_folds() -> None:
    """x (1 - x^2 / 3) has its largest value at x = 1: 45 degrees."""
    lens = {"kind": "brown-conrady", "k1": -1.0 / 3.0}
    assert folding_angle(mini(distortion=lens).camera) is None  # shows 2/3 at most, and needs 0.61
    design = mini(distortion=lens, fov=75.0)
    assert folding_angle(design.camera) == pytest.approx(45.0, abs=0.2)
    problems = [each for each in check_design(design) if each.severity == "error"]
    assert len(problems) == 1 and "folds 45 degrees off its axis" in problems[0].message


def test_a_lens_is_searched_for_folds_once() -> None:
    lens = {"kind": "brown-conrady", "k1": -1.0 / 3.0, "k2": 1e-4}
    camera = mini(distortion=lens, fov=75.0).camera
    searched = projection._folding_angle.cache_info().misses
    first = folding_angle(camera)
    camera.position = (0.0, 0.0, 1.0)
    assert folding_angle(camera) == first is not None
    assert projection._folding_angle.cache_info().misses == searched + 1
    camera.fov = 40.0
    assert folding_angle(camera) is None


def test_a_lens_that_is_nearly_flat_on_the_way_to_the_corners_does_not_fold() -> None:
    """The slope of its radial function is 0.094 at 1.41 and larger elsewhere: the corner, shown at
    1.55, is seen at 2.176."""
    numbers = {"k1": -0.2598991426334218, "k2": 0.019080160189376538, "k3": 0.0048554078895102545}
    lens = {"kind": "brown-conrady", **numbers}
    camera = mini(fov=102.2463429033123, distortion=lens).camera
    assert folding_angle(camera) is None
    corner = ideal_places(camera, np.ones(1), np.ones(1))
    assert np.hypot(*corner) == pytest.approx(2.176, abs=1e-3)


def test_only_the_lens_that_it_is_made_for_is_distorted_by_a_model() -> None:
    with pytest.raises(DesignError, match="equidistant lenses, but this lens is perspective"):
        mini(distortion={"kind": "kannala-brandt", "k1": 0.1})


def test_radial_shading_falls_to_its_share_in_the_corners() -> None:
    places = film_places(480, 640)
    share = RadialShading(falloff=0.4, power=4.0).transmission(places)
    assert share.shape == (480, 640, 3)
    assert share[240, 320] == pytest.approx(1.0, abs=1e-6)
    assert share[0, 0] == pytest.approx(0.6, abs=4e-3)
    assert share[240, 0, 1] == pytest.approx(1.0 - 0.4 * 0.8**4, abs=2e-3)
    own = RadialShading(falloff=0.4, power=4.0, red_falloff=0.7).transmission(places)
    assert own[0, 0] == pytest.approx([0.3, 0.6, 0.6], abs=7e-3)


def test_a_shading_table_is_read_at_the_middles_of_its_cells() -> None:
    rng = np.random.default_rng(1)
    gain, red = (rng.uniform(1.0, 3.0, (12, 16)) for _ in range(2))
    lens = TableShading(gain=gain.tolist(), red=red.tolist())
    share = lens.transmission(film_places(12 * 5, 16 * 5))[2::5, 2::5]
    assert share[..., 1] == pytest.approx(1.0 / gain)
    assert share[..., 0] == pytest.approx(1.0 / (gain * red))
    assert share[..., 2] == pytest.approx(share[..., 1])


@pytest.mark.parametrize(
    ("table", "says"),
    [
        ({"gain": [[1.0, 1.0], [1.0]]}, "2 rows of 1 or 2 numbers"),
        ({"gain": [[1.0, 1.0]]}, "1 rows of 2 numbers"),
        ({"gain": [[1.0, 1.2]] * 2, "red": [[1.0, 1.2]] * 3}, "'red' has 3 rows of 2"),
        ({"gain": [[1.0, -1.2]] * 2}, "greater than or equal to 0.1"),
    ],
)
def test_a_shading_table_of_the_wrong_size_is_refused(table: dict[str, Any], says: str) -> None:
    with pytest.raises(DesignError, match=says):
        mini(shading={"kind": "table", **table})


def spread_of(picture: Any) -> tuple[float, float]:
    """Standard deviations along x and y of the light around its middle."""
    rows, columns = np.mgrid[: picture.shape[0], : picture.shape[1]]
    share = picture / picture.sum()
    middle = (share * columns).sum(), (share * rows).sum()
    across = np.sqrt((share * (columns - middle[0]) ** 2).sum())
    return float(across), float(np.sqrt((share * (rows - middle[1]) ** 2).sum()))


def test_a_point_is_blurred_to_the_width_that_is_asked_for() -> None:
    point = np.zeros((81, 101, 3), dtype=np.float32)
    point[40, 50] = 1.0
    soft = blurred(point, np.array(3.0))
    assert soft.sum() == pytest.approx(3.0, rel=1e-5)
    assert spread_of(soft[..., 1]) == pytest.approx((3.0, 3.0), rel=2e-3)
    assert blurred(point, np.array(0.0)) is point


def test_a_blur_that_varies_has_everywhere_the_variance_that_is_asked_for() -> None:
    widths = np.linspace(0.0, 4.0, 400)[None, :] + np.zeros((60, 1))
    stripes = np.zeros((60, 400, 3), dtype=np.float32)
    edges = np.arange(20, 400, 60)
    stripes[:, edges] = 1.0
    soft = blurred(stripes, widths)[30, :, 0]
    for edge in edges[1:-1]:
        near = np.arange(edge - 25, edge + 26)
        share = soft[near] / soft[near].sum()
        assert np.sqrt((share * (near - edge) ** 2).sum()) == pytest.approx(
            widths[0, edge], rel=0.1
        )


def test_the_circle_of_confusion_is_that_of_a_thin_lens() -> None:
    """c = A f |z - z_f| / (z (z_f - f)) on a sensor of the width 2 s tan(fov / 2), with the image
    at s = f z_f / (z_f - f)."""
    camera: Camera = mini(fov=60.0).camera
    f, number, sharp, z = 3.0, 2.0, 30.0, 20.0
    lens = Defocus(focal_length=f, f_number=number, focus_distance=sharp)
    pupil, image = f / number, f * sharp / (sharp - f)
    circle = pupil * f * abs(z - sharp) / (z * (sharp - f))
    width = 2.0 * image * np.tan(np.radians(30.0))
    assert lens.circle(camera, np.array(1.0 / z)) == pytest.approx(circle / width)
    assert lens.deviation(camera, np.array(1.0 / sharp)) == pytest.approx(0.0, abs=1e-12)
    share = GaussianBlur(width=1.6).deviation(camera, np.zeros(()))
    assert share == pytest.approx(1.6 / 320)


@pytest.mark.parametrize(
    "blur",
    [
        {"kind": "gaussian", "width": -1.0},
        {"kind": "defocus", "focal_length": 3.0, "f_number": 0.0, "focus_distance": 20.0},
        {"kind": "defocus", "focal_length": -3.0, "f_number": 2.0, "focus_distance": 20.0},
    ],
)
def test_negative_numbers_of_a_blur_are_refused(blur: dict[str, Any]) -> None:
    with pytest.raises(DesignError, match="should be greater than"):
        mini(blur=blur)

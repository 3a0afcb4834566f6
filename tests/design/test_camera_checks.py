"""Checks that refuse physically impossible cameras."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import shapely

from optisense import sensors
from optisense.design import Diagnostic, SensorDesign, check_design, set_value
from optisense.design._focus_checks import straight_vergences
from optisense.design.arrangement import SAMPLES, SAMPLES_TURN, straight_rays
from optisense.design.camera_checks import camera_fault, view_shares
from optisense.geometry import TriangleMesh
from optisense.optics._skin_view import ray_camera

BARREL = {"kind": "kannala-brandt", "k1": -0.0305, "k2": 0.001}
"""Distortion by which a fisheye of 230 degrees sees 266 across the picture."""


def errors(design: SensorDesign) -> list[Diagnostic]:
    return [problem for problem in check_design(design) if problem.severity == "error"]


def fault(design: SensorDesign) -> str | None:
    found = camera_fault(design, design.deformed_meshes())
    return None if found is None else found.message


@pytest.mark.parametrize("name", sensors.SENSORS.names())
def test_the_cameras_of_the_built_in_sensors_are_fine(name: str) -> None:
    design = sensors.load(name)
    assert fault(design) is None
    assert errors(design) == []


@pytest.mark.parametrize(
    ("projection", "fov", "said"),
    [
        ("perspective", 0.01, "as little as 0.01 degrees"),
        ("perspective", 1.0, None),
        # At 4:3, 125.2 degrees across are 2 atan(5/4 tan(62.6)) = 135 from corner to corner.
        ("perspective", 125.2, None),
        ("perspective", 125.3, "no perspective lens sees 125.3 degrees"),
        ("perspective", 179.0, "no perspective lens sees 179 degrees"),
        ("equidistant", 179.0, None),
        ("equidistant", 280.0, None),
        ("equidistant", 281.0, "no fisheye lens sees 281 degrees"),
        ("equidistant", 0.5, "as little as 0.5 degrees"),
    ],
)
def test_angles_that_no_lens_has(
    mini: SensorDesign, projection: str, fov: float, said: str | None
) -> None:
    design = set_value(set_value(mini, "camera.projection", projection), "camera.fov", fov)
    found = errors(design)
    if said is None:
        assert found == [] and fault(design) is None
    else:
        (problem,) = found
        assert said in problem.message and problem.where == "camera.fov"
        assert fault(design) == problem.message


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"fov": 280.0, "resolution": [120, 160]}, None),  # 233 degrees in the corners
        ({"fov": 280.0, "resolution": [160, 120]}, None),  # 175 degrees in the corners
        ({"fov": 230.0, "distortion": BARREL}, None),  # 180.7 in the corners
        ({"fov": 260.0, "distortion": BARREL}, "no fisheye lens sees 314.3 degrees"),
    ],
)
def test_a_fisheye_may_have_dark_corners(
    mini: SensorDesign, changes: dict[str, Any], said: str | None
) -> None:
    camera = mini.camera.model_dump(mode="json") | {"projection": "equidistant"} | changes
    design = set_value(mini, "camera", camera)
    assert fault(design) == said or (said is not None and said in str(fault(design)))
    ray_camera(design, (30, 120))


def test_no_skin_is_seen_in_dark_corners(mini: SensorDesign) -> None:
    """The corners of a square picture of 280 degrees would be 198 degrees off the axis: it shows a
    circle whose radius is 180/140 of half its side, less four segments.
    """
    design = set_value(mini, "camera.projection", "equidistant")
    design.camera.fov, design.camera.resolution = 280.0, (80, 80)
    rays = straight_rays(design.camera)
    radius, edge = 180.0 / 140.0, np.arccos(140.0 / 180.0)
    circle = radius**2 * (np.pi - 4.0 * (edge - np.sin(edge) * np.cos(edge)))
    assert len(rays) / SAMPLES == pytest.approx(circle / 4.0, abs=0.02)
    axis = design.camera.axes()[2]
    assert (rays @ axis).min() > -1.0


@pytest.mark.parametrize(
    ("height", "part"),
    [(-2.0, "gel"), (-6.0, "guide"), (-8.5, "guide"), (-10.0, None), (-22.25, None)],
)
def test_a_camera_inside_a_solid(mini: SensorDesign, height: float, part: str | None) -> None:
    design = set_value(mini, "camera.position.z", height)
    said = fault(design)
    if part is None:
        assert said is None and errors(design) == []
    else:
        assert said is not None and f"inside the solid part '{part}'" in said
        assert [problem.message for problem in errors(design)] == [said]


def test_a_camera_nearer_to_a_part_than_half_the_smallest_camera(mini: SensorDesign) -> None:
    back = float(mini.meshes["guide"].bounds[0, 2])
    near = set_value(mini, "camera.position.z", back - 0.32)
    assert "0.32 mm from part 'guide'" in str(fault(near))
    assert fault(set_value(mini, "camera.position.z", back - 0.33)) is None


def test_a_camera_in_a_cavity_of_the_gel_is_fine(mini: SensorDesign) -> None:
    """A camera that is cast into the gel: an octahedron about the pupil is cut out of the mesh."""
    corners = np.concatenate([np.eye(3), -np.eye(3)])
    faces = [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]]
    gel = mini.meshes["gel"]
    design = set_value(mini, "camera.position.z", -2.0)
    assert "inside the solid part 'gel'" in str(fault(design))
    hole = TriangleMesh(corners + np.array(design.camera.position), np.array(faces)).flipped()
    design = design.copy()
    design.meshes["gel"] = TriangleMesh.joined([gel, hole])
    assert fault(design) is None


class TestFocus:
    def out_of_focus(self, design: SensorDesign, distance: float, number: float) -> list[str]:
        """Return the messages about a lens of 3 mm that is focused at a distance."""
        blur = {"kind": "defocus", "focal_length": 3.0, "f_number": number}
        camera = design.camera.model_dump(mode="json") | {
            "blur": blur | {"focus_distance": distance}
        }
        problems = check_design(set_value(design, "camera", camera))
        assert all(each.severity == "warning" for each in problems)
        return [each.message for each in problems if "out of focus" in each.message]

    def test_layers_appear_as_thick_as_they_are_over_their_index(self, mini: SensorDesign) -> None:
        """13 mm of air, 5 mm of acrylic and 4.25 mm of gel, for a flat field of focus. In the plane
        of incidence they appear thinner off the axis."""
        across, along = 1.0 / straight_vergences(mini, mini.deformed_meshes()).T
        assert len(across) == SAMPLES
        middle = 13.0 + 5.0 / 1.491 + 4.25 / 1.41
        assert across == pytest.approx(middle, rel=1e-6)
        assert along.max() == pytest.approx(middle, rel=2e-3) and along.min() < 0.95 * middle

    def test_what_is_out_of_focus_is_told_with_its_circle(self, mini: SensorDesign) -> None:
        assert self.out_of_focus(mini, 19.4, 2.0) == []
        (said,) = self.out_of_focus(mini, 14.0, 2.0)
        middle = 13.0 + 5.0 / 1.491 + 4.25 / 1.41
        scale = 320.0 / (2.0 * np.tan(np.radians(52.157 / 2.0)))
        circle = 1.5 * abs(1.0 / middle - 1.0 / 14.0) * scale
        assert f"up to {circle:.1f} pixels; it appears 19.1 mm away" in said
        assert self.out_of_focus(mini, 14.0, 40.0) == []

    def test_a_camera_without_depth_of_field_says_nothing(self, mini: SensorDesign) -> None:
        camera = mini.camera.model_dump(mode="json") | {"blur": {"kind": "gaussian", "width": 9.0}}
        assert check_design(set_value(mini, "camera", camera)) == []


def test_the_shares_of_the_view_follow_the_lens(mini: SensorDesign) -> None:
    """A pincushion magnifies the borders, so that less of the skin is in the picture."""
    shares = []
    for k1 in (0.0, 0.5):
        lens = {"distortion": {"kind": "brown-conrady", "k1": k1}}
        design = set_value(mini, "camera", mini.camera.model_dump(mode="json") | lens)
        found = view_shares(design, design.deformed_meshes())
        assert found is not None and found.picture == 1.0
        shares.append(found.skin)
    assert shares[1] < 0.95 * shares[0]


def test_shares_of_oblique_rectangles() -> None:
    """Of any size, place and angle; see `SAMPLES`."""
    number = np.arange(SAMPLES)
    places = np.stack([number + 0.5, number * SAMPLES_TURN % SAMPLES + 0.5], axis=1) / SAMPLES
    rng = np.random.default_rng(0)
    errors = []
    for _ in range(500):
        (x, y), (wide, high) = rng.random(2), rng.uniform(0.05, 0.5, 2)
        box = shapely.box(x - wide, y - high, x + wide, y + high)
        turned = shapely.affinity.rotate(box, rng.uniform(0.0, 180.0), origin=(x, y))
        share = shapely.contains_xy(turned, *places.T).mean()
        errors.append(abs(share - turned.intersection(shapely.box(0, 0, 1, 1)).area))
    assert max(errors) < 0.08 and np.quantile(errors, 0.9) < 0.02

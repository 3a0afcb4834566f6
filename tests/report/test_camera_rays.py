"""Chief rays in drawings: they go from the camera by mirrors and through glass to the skin."""

from __future__ import annotations

import base64
import re

import numpy as np
import pytest

from optisense.design.section import along_rows
from optisense.design.section_drawing import LOST_RAY, RAY, section_svg
from optisense.optics import OpticalModel
from optisense.report._scene_view import scene_data
from optisense.report.camera_rays import ACROSS, CameraRays
from optisense.sensors import gelsight_mini_ideal, load


@pytest.fixture(scope="module")
def mini() -> CameraRays:
    return CameraRays.of(OpticalModel(gelsight_mini_ideal()))


def test_rays_of_a_mini_are_bent_by_the_tray_and_reach_the_skin(mini: CameraRays) -> None:
    design = gelsight_mini_ideal()
    assert all(ray.arrived for ray in mini.rays)
    for ray in mini.rays:
        assert ray.points[0] == pytest.approx(design.camera.position, abs=1e-5)
        assert ray.points[-1][2] == pytest.approx(0.0, abs=1e-4)  # the skin of a flat Mini
    # Snell's law where the ray in the corner of the picture enters the tray.
    points = mini.rays[0].points
    steps = np.diff(points, axis=0)
    sines = np.linalg.norm(steps[:, :2], axis=1) / np.linalg.norm(steps, axis=1)
    assert sines[0] / sines[1] == pytest.approx(design.materials["acrylic"].ior, rel=1e-3)


def test_rays_of_a_svelte_go_by_its_mirrors() -> None:
    design = load("gelsight-svelte")
    rays = CameraRays.of(OpticalModel(design))
    found = rays.in_section(along_rows(design))
    assert len(found) == ACROSS
    svg = section_svg(design, found)
    seen = sum(ray.arrived for ray in found)
    assert 0 < seen < ACROSS
    assert all(len(ray.points) >= 4 for ray in found if ray.arrived)  # two mirrors between
    assert svg.count(f'stroke="{RAY}"') == seen
    assert svg.count(f'stroke="{LOST_RAY}"') == ACROSS - seen
    assert f"{seen} of {ACROSS} rays reach the skin" in svg
    assert "rays reach" not in section_svg(design)


def test_the_3d_view_holds_the_segments_of_every_second_ray(mini: CameraRays) -> None:
    scene = scene_data(gelsight_mini_ideal(), {}, mini)
    ends = np.frombuffer(base64.b64decode(scene["rays"]["seen"]), "<f4").reshape(-1, 2, 3)
    rows, columns = mini.shape
    chosen = [mini.rays[r * columns + c] for r in range(0, rows, 2) for c in range(0, columns, 2)]
    assert len(ends) == sum(len(ray.points) - 1 for ray in chosen)
    assert np.allclose(ends[0, 0], gelsight_mini_ideal().camera.position, atol=1e-5)
    assert np.allclose(ends[0, 1], ends[1, 0])
    assert scene["rays"]["lost"] == ""
    assert scene_data(gelsight_mini_ideal(), {})["rays"] == {}


def test_lines_of_rays_lie_within_the_drawing(mini: CameraRays) -> None:
    design = gelsight_mini_ideal()
    svg = section_svg(design, mini.in_section(along_rows(design)))
    paths = re.findall(rf'<path d="M([^"]+)" stroke="{RAY}"', svg)
    assert len(paths) == ACROSS
    numbers = [float(each) for path in paths for each in re.split("[L ]", path)]
    assert min(numbers) >= 0.0

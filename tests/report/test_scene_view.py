"""The 3-D view holds the design's geometry."""

from __future__ import annotations

import base64

import numpy as np
import pytest

from optisense.geometry import TriangleMesh
from optisense.report._scene_view import feature_edges, scene_data
from optisense.sensors import gelsight_mini_ideal


def decoded(text: str, dtype: str) -> np.ndarray:
    return np.frombuffer(base64.b64decode(text), dtype=dtype)


def test_a_box_has_twelve_edges_however_it_is_cut() -> None:
    edges = feature_edges(TriangleMesh.box((0, 0, 0), (3, 2, 1), (4, 3, 2)))
    lengths = np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1)
    assert lengths.sum() == pytest.approx(4 * (3 + 2 + 1))


def test_an_open_sheet_shows_its_border_only() -> None:
    edges = feature_edges(TriangleMesh.grid((3, 2), (5, 5)))
    lengths = np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1)
    assert lengths.sum() == pytest.approx(10)


def test_every_part_light_and_the_camera_are_there() -> None:
    design = gelsight_mini_ideal()
    ball = TriangleMesh.box((-1, -1, 0), (1, 1, 2))
    scene = scene_data(design, {"ball": ball})
    assert [part["name"] for part in scene["parts"]] == [*design.parts, "ball"]
    assert [group["name"] for group in scene["lights"]] == list(design.lights)
    for part in scene["parts"][:-1]:
        points = decoded(part["points"], "<f4").reshape(-1, 3)
        bounds = design.deformed_meshes()[part["name"]].bounds
        assert np.allclose([points.min(axis=0), points.max(axis=0)], bounds, atol=1e-4)
        faces = decoded(part["faces"], "<u4")
        assert faces.max() < len(points)
    lamp = scene["lights"][0]["lights"][0]
    assert lamp["radius"] == pytest.approx(2.4 / 2 * np.sqrt(1.0))


def test_the_frustum_is_as_wide_as_the_field_of_view() -> None:
    design = gelsight_mini_ideal()
    camera = scene_data(design, {})["camera"]
    corners = np.array(camera["corners"]) - camera["position"]
    middle_left, middle_right = corners[[0, 3]].mean(axis=0), corners[[1, 2]].mean(axis=0)
    cosine = middle_left @ middle_right / np.linalg.norm(middle_left) ** 2
    assert np.degrees(np.arccos(cosine)) == pytest.approx(design.camera.fov, abs=1e-3)
    assert corners[:, 2] == pytest.approx(22.25)  # from the pupil to the sensing surface


def test_a_huge_mesh_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("optisense.report._scene_view.MAX_TRIANGLES", 100)
    names = [part["name"] for part in scene_data(gelsight_mini_ideal(), {})["parts"]]
    assert "gel" not in names
    assert "guide" in names

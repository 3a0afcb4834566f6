"""Reconstruction of shapes whose colours are algebra, and of what the renderer shows."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.ndimage import binary_erosion

from optisense import OpticalModel
from optisense.errors import ContactError, TaskError
from optisense.geometry import Contact, Sphere
from optisense.reading.tilts import angles_between, normals_of, tilts_of
from optisense.tasks import ReconstructionSettings, reconstruct
from optisense.tasks._colour_to_normal import fit_reader
from optisense.tasks._reconstruction import pyramid
from optisense.tasks.figures import draw_reconstruction

LAMBERTIAN = {"presses": 12, "camera_noise": 0.0, "resolution": (160, 120), "seed": 1}


@pytest.mark.parametrize(
    ("method", "degrees"), [("network", 4.0), ("table", 4.0)], ids=["network", "table"]
)
def test_known_lights_give_known_shapes_back(method: str, degrees: float, lambertian: Any) -> None:
    result = reconstruct(lambertian, ReconstructionSettings(method=method, **LAMBERTIAN))
    for name, each in result.objects.items():
        values = each.to_dict()
        assert each.normal_error < degrees, name
        assert each.depth_error < 0.07, name
        assert values["deepest_read"] == pytest.approx(values["deepest"], abs=0.08), name
        assert values["normal_error_of_reading_nothing"] > 12, name
        assert values["ring_pixels"] > 100, name
        assert values["ring_normal_error"] < 2 * degrees, name
        assert values["ring_depth_error"] < values["ring_depth_error_of_reading_nothing"], name
        # What is read where nothing touches is the skin that bends there.
        outside = ~each.mask & np.isfinite(each.true_depth)
        # Small errors of the slope add up along a cylinder's ring.
        assert np.abs(each.depth - each.true_depth)[outside].mean() < 0.05, name


def test_the_ring_is_scored_beside_the_contact_and_a_conforming_skin_has_none(
    lambertian: Any,
) -> None:
    ball = {"ball": Contact(Sphere(3.0), at=(0, 0), depth=0.6)}
    few = LAMBERTIAN | {"presses": 3, "method": "table"}
    result = reconstruct(lambertian, ReconstructionSettings(**few), ball)
    each = result.objects["ball"]
    off = np.abs(each.depth - each.true_depth)
    assert result.ring_normal_error == pytest.approx(each.angles[each.ring].mean())
    assert result.ring_depth_error == pytest.approx(off[each.ring].mean())
    assert not (each.ring & each.mask).any()
    stiff = reconstruct(lambertian, ReconstructionSettings(**few, skin="conforming"), ball)
    assert stiff.to_dict()["ring_normal_error"] is None


def test_true_depth_and_normals_are_those_of_the_ball(lambertian: Any) -> None:
    ball = {"ball": Contact(Sphere(3.0), at=(0, 0), depth=0.6)}
    each = reconstruct(
        lambertian, ReconstructionSettings(**(LAMBERTIAN | {"presses": 2, "method": "table"})), ball
    ).objects["ball"]
    # The triangles of the pressed skin are within 4 um of the ball.
    assert each.true_depth.max() == pytest.approx(0.6, abs=4e-3)
    inside = binary_erosion(each.mask)  # at the rim the slope jumps
    height = -each.true_normals[..., 2][inside]
    assert each.true_depth[inside] == pytest.approx(0.6 - 3 * (1 - height), abs=4e-3)


def test_camera_noise_makes_it_worse(lambertian: Any) -> None:
    ball = {"ball": Contact(Sphere(3.0), at=(0, 0), depth=0.6)}
    few = LAMBERTIAN | {"presses": 6, "method": "table"}
    quiet, loud = (
        reconstruct(
            lambertian,
            ReconstructionSettings(**(few | {"camera_noise": noise})),
            ball,
        ).normal_error
        for noise in (0.0, 12.0)
    )
    assert loud > quiet + 1


@pytest.mark.parametrize("method", ["network", "table"])
def test_a_reader_gives_a_linear_relation_back(method: str) -> None:
    rng = np.random.default_rng(0)
    mixing = np.array([[60.0, -30.0, -30.0], [0.0, 50.0, -50.0]])
    tilts = rng.uniform(-0.6, 0.6, (8000, 2))
    places = rng.uniform(-1, 1, (8000, 2))
    reader = fit_reader(method, tilts @ mixing, places, tilts)
    fresh = rng.uniform(-0.6, 0.6, (500, 2))
    read = reader.tilts(fresh @ mixing, rng.uniform(-1, 1, (500, 2)))
    # A bin of the table is 4 levels wide, 0.08 in the second tilt.
    assert np.abs(read - fresh).mean() < 0.03


def test_tilts_and_normals_are_each_others_inverse() -> None:
    rng = np.random.default_rng(1)
    axes = np.linalg.qr(rng.normal(size=(50, 3, 3)))[0]
    first, second, normals = axes[:, 0], axes[:, 1], axes[:, 2]
    tilts = rng.uniform(-0.6, 0.6, (50, 2))
    bent = normals_of(tilts, first, second, normals)
    assert np.linalg.norm(bent, axis=1) == pytest.approx(1)
    assert tilts_of(bent, first, second) == pytest.approx(tilts)
    # A tilt beyond 1 has no normal: it counts as the steepest.
    steep = normals_of(np.full((50, 2), 3.0), first, second, normals)
    assert angles_between(steep, normals) == pytest.approx(80)


def test_the_pyramid_is_closed_and_as_steep_as_it_says() -> None:
    mesh = pyramid(30.0, 2.0)
    side = 2 * 2.0 / np.tan(np.radians(30))
    a, b, c = (mesh.vertices[mesh.faces[:, i]] for i in range(3))
    assert np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6 == pytest.approx(side**2 * 2 / 3)
    downward = mesh.face_normals[mesh.face_normals[:, 2] < 0]
    assert np.degrees(np.arccos(-downward[:, 2])) == pytest.approx(30)


def test_what_cannot_work_is_told_before_any_picture(lambertian: Any) -> None:
    with pytest.raises(TaskError, match="no method 'forest'"):
        ReconstructionSettings(method="forest")
    for wrong in ({"presses": 0}, {"depth": (0.5, 0.2)}, {"depth": (0.2, 2.0)}, {"radius": -1}):
        with pytest.raises(TaskError, match="are impossible"):
            ReconstructionSettings(**wrong)
    deep = {"nail": Contact(Sphere(1.0), at=(0, 0), depth=9.0)}
    with pytest.raises(ContactError):
        reconstruct(lambertian, ReconstructionSettings(**LAMBERTIAN), deep)
    assert lambertian.pictures == 0
    aside = {"ball": Contact(Sphere(0.5), at=(12.0, 9.5), depth=0.2)}
    two = ReconstructionSettings(**(LAMBERTIAN | {"presses": 2, "method": "table"}))
    with pytest.raises(TaskError, match="does not see"):
        reconstruct(lambertian, two, aside)


def test_pictures_too_small_for_a_ball_are_told(lambertian: Any) -> None:
    small = ReconstructionSettings(**(LAMBERTIAN | {"resolution": (8, 6), "skin": "conforming"}))
    ball = {"ball": Contact(Sphere(1.5), at=(0, 0), depth=0.5)}
    with pytest.raises(TaskError, match="pixels of a picture of 8x6, and a reader needs 20"):
        reconstruct(lambertian, small, ball)


@pytest.mark.slow
def test_a_real_sensor_gives_a_ball_back(mini: OpticalModel) -> None:
    settings = ReconstructionSettings(presses=8, resolution=(96, 72), photons=60_000)
    ball = {"ball of 3 mm": Contact(Sphere(3.0), at=(-2.0, 1.5), depth=0.6)}
    result = reconstruct(mini, settings, ball)
    values = result.objects["ball of 3 mm"].to_dict()
    assert values["normal_error"] < 0.5 * values["normal_error_of_reading_nothing"]
    assert values["depth_error"] < 0.5 * values["depth_error_of_reading_nothing"]
    figure = draw_reconstruction(result, mini.design.camera.axes())
    texts = {axes.get_title() for axes in figure.axes}
    assert {"true normals", "read depth (mm)"} <= texts

"""The lens in front of the renderer's camera: distorted rays, ground truth, depth of field."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Literal

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import optisense as ots
from optisense import library
from optisense.design import SensorDesign, _focus_checks
from optisense.design.lenses import LensDistortion
from optisense.design.lenses.blur import Defocus
from optisense.design.lenses.film import PictureWindow
from optisense.design.projection import directions, ideal_places, image_edges
from optisense.design.responses import PictureChain
from optisense.errors import DesignError, LibraryError
from optisense.optics import OpticalModel
from optisense.optics.backend.arrays import floats
from optisense.optics.camera.projection import Pose, RayCamera
from optisense.optics.transport.apparent_distance import apparent_vergences
from optisense.optics.transport.chief_rays import trace_to_skin
from optisense.sensors import SENSORS

BARREL = {"kind": "brown-conrady", "k1": -0.3, "k2": 0.05, "p1": 0.004, "centre": [0.52, 0.49]}
FISHEYE = {"kind": "kannala-brandt", "k1": -0.04, "k2": 0.003}

NEARLY_FLAT = {"kind": "brown-conrady", "k1": -0.2599, "k2": 0.01908, "k3": 0.004855}
"""A lens that shows a step outwards as a tenth of it, on the way to the corners."""

BALL = ots.Contact(ots.Sphere(1.5), at=(3.0, 2.0), depth=0.8)


def mini(**changes: Any) -> SensorDesign:
    """GelSight Mini with other values of its camera."""
    design = ots.load("builtin:gelsight-mini-ideal")
    return ots.set_value(design, "camera", design.camera.model_dump(mode="json") | changes)


def rays_of(camera: RayCamera, x: Any, y: Any, pose: Pose | None = None) -> Any:
    """(k, 3) directions through film positions."""
    return np.asarray(camera.rays(floats(x), floats(y), pose)[1], dtype=np.float64).T


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"distortion": BARREL},
        {"projection": "equidistant", "fov": 130.0, "distortion": FISHEYE},
        {"fov": 102.25, "distortion": NEARLY_FLAT},
    ],
)
def test_rays_are_those_of_the_design(changes: dict[str, Any]) -> None:
    design = mini(**changes)
    camera = OpticalModel(design).camera((64, 48))
    x, y = (each.ravel() for each in np.meshgrid(np.arange(64) + 0.5, np.arange(48) + 0.5))
    exact = directions(design.camera, x / 64, y / 48)
    assert np.abs(rays_of(camera, x, y) - exact).max() < 1e-6


class Swelling(LensDistortion):
    """A distortion that returns what a function of NumPy does."""

    kind: Literal["test-swelling"] = "test-swelling"

    def coefficients(self) -> tuple[float, ...]:
        return (0.2,)

    @staticmethod
    def distort(x: Any, y: Any, numbers: tuple[Any, ...]) -> Any:
        return np.tan(numbers[0] * x) / numbers[0], y + 0.0

    @staticmethod
    def jacobian(x: Any, y: Any, numbers: tuple[Any, ...]) -> Any:
        return 1.0 + np.tan(numbers[0] * x) ** 2, 0.0, 0.0, 1.0


def test_a_distortion_that_calls_numpy_is_refused_with_its_file() -> None:
    design = mini()
    design.camera.distortion = Swelling()
    ots.check(design)
    with pytest.raises(LibraryError, match=r"distort\(\) .*arrays of the renderer") as found:
        OpticalModel(design)
    assert f"{__file__}: Swelling.distort" == found.value.where


def test_a_picture_of_another_shape_is_cut_out_of_the_distorted_camera() -> None:
    model = OpticalModel(mini(distortion={**BARREL, "centre": [0.5, 0.7]}))
    x, y = (each.ravel() for each in np.meshgrid(np.arange(64) + 0.5, np.arange(24) + 0.5))
    cut, whole = (model.camera((64, height)) for height in (24, 48))
    assert rays_of(cut, x, y) == pytest.approx(rays_of(whole, x, y + 12.0), abs=1e-6)


def test_ground_truth_follows_the_distorted_camera() -> None:
    """A pixel of the distorted camera sees what the plain one sees at the ideal place."""
    plain, bent = OpticalModel(mini()), OpticalModel(mini(distortion=BARREL))
    size = 160, 120
    seen = bent.chief_rays(size, [BALL])
    x, y = np.meshgrid((np.arange(160) + 0.5) / 160, (np.arange(120) + 0.5) / 120)
    edge, tall = image_edges(bent.design.camera)
    ideal = ideal_places(bent.design.camera, x, y)
    column, row = 80.0 * (1.0 + ideal[0] / edge), 60.0 * (1.0 + ideal[1] / tall)
    # A picture of the plain camera so fine that its nearest pixel will do.
    fine = plain.chief_rays((1600, 1200), [BALL])
    row, column = (np.round(10.0 * each - 0.5).astype(int) for each in (row, column))
    inside = (row >= 0) & (row < 1200) & (column >= 0) & (column < 1600)
    assert inside.mean() > 0.8
    at = row[inside], column[inside]
    off = np.linalg.norm(seen.points[inside] - fine.points[at], axis=1)
    assert np.quantile(off, 0.99) < 0.01 and off.max() < 0.1  # at the rim of the contact
    assert (seen.contact_mask[inside] == fine.contact_mask[at]).mean() > 0.999
    image = bent.render([BALL], size, photons=20_000)
    assert np.array_equal(image.contact_mask, seen.contact_mask)
    middle = plain.chief_rays(size, [BALL])
    assert np.abs(middle.contact_mask.sum() / seen.contact_mask.sum() - 1.0) > 0.02


def test_a_lens_that_folds_is_an_error_of_the_design() -> None:
    lens = {"kind": "brown-conrady", "k1": -0.6}
    with pytest.raises(DesignError, match=r"folds 36\.7 degrees off its axis"):
        OpticalModel(mini(distortion=lens)).chief_rays((32, 24))


@pytest.mark.parametrize(
    "changes",
    [{"distortion": BARREL}, {"projection": "equidistant", "fov": 130.0, "distortion": FISHEYE}],
)
def test_rays_have_derivatives_by_the_lens(changes: dict[str, Any]) -> None:
    design = mini(**changes)
    camera = OpticalModel(design).camera((64, 48))
    x, y = np.array([3.0, 50.0, 60.5]), np.array([44.0, 8.0, 3.5])
    weights = np.random.default_rng(1).random((3, 3))
    pose = camera.pose()
    numbers = pose.fov, *pose.lens
    dr.enable_grad(*numbers)
    _, direction = camera.rays(floats(x), floats(y), pose)
    dr.backward(dr.sum(dr.dot(direction, dr.unravel(mi.Vector3f, floats(weights)))))
    for number, value in enumerate(numbers):
        step = 0.02 if number == 0 else 0.0004

        def moved(change: float, at: int = number) -> float:
            given = [pose.fov, *pose.lens]
            given[at] = dr.detach(given[at]) + change
            other = pose._replace(fov=given[0], lens=tuple(given[1:]))
            return float((rays_of(camera, x, y, other) * weights).sum())

        slope = (moved(step) - moved(-step)) / (2 * step)
        assert float(dr.grad(value)[0]) == pytest.approx(slope, rel=5e-3, abs=2e-5)


def test_the_skin_appears_as_far_away_as_the_layers_in_front_of_it_say() -> None:
    """13 mm of air, 5 mm of acrylic and 4.25 mm of gel: on the axis each appears thinner by its
    index."""
    model = OpticalModel(mini())
    vergences = apparent_vergences(model.scenes.fine.scene, model.camera((33, 25)))
    assert 1.0 / vergences[12, 16] == pytest.approx(13.0 + 5.0 / 1.491 + 4.25 / 1.41, rel=1e-3)


def test_in_air_the_distance_is_the_distance() -> None:
    """A camera cast into a gel that fills all of its view sees nothing bent."""
    design = mini()
    for name in ("silicone-xp565", "acrylic"):
        design = ots.set_value(design, f"materials.{name}.ior", 1.0)
    for changes in ({}, {"distortion": BARREL}):
        camera = design.camera.model_dump(mode="json") | changes
        model = OpticalModel(ots.set_value(design, "camera", camera))
        vergences = apparent_vergences(model.scenes.fine.scene, model.camera((32, 24)))
        assert 1.0 / vergences == pytest.approx(22.25, rel=3e-3)


def traced_blur(model: OpticalModel, x: float, y: float) -> float:
    """Return the root mean square, over both directions, of the standard deviation in pixels of the
    rays from all of the pupil through the point in focus of a place of the camera's picture.
    """
    lens, camera = model.design.camera.blur, model.camera()
    assert isinstance(lens, Defocus)
    right, up, forward = camera.axes()
    places = np.array([[x, y], [x + 1.0, y], [x, y + 1.0]])
    chief = rays_of(camera, *places.T)
    eye = np.array(model.design.camera.position)
    number = np.arange(400) + 0.5
    radius = 0.5 * lens.focal_length / lens.f_number * np.sqrt(number / 400)
    turn = np.pi * (3.0 - np.sqrt(5.0)) * number  # the golden angle
    pupil = eye + np.outer(radius * np.cos(turn), right) + np.outer(radius * np.sin(turn), up)
    way = eye + chief[0] * lens.focus_distance / (chief[0] @ forward) - pupil
    way /= np.linalg.norm(way, axis=1)[:, None]
    origins, ways = np.concatenate([np.tile(eye, (3, 1)), pupil]), np.concatenate([chief, way])
    points = trace_to_skin(model.scenes.fine.scene, origins, ways)[1]
    steps = (points[1:3] - points[0]).T
    found = np.linalg.lstsq(steps, (points[3:] - points[0]).T, rcond=None)[0]
    return float(np.sqrt(found.var(axis=1).mean()))


def behind_a_wedge(tilt: float = 20.0) -> SensorDesign:
    """Mini with the camera's side of its acrylic inclined, near the mean focus on the axis."""
    lens = {"kind": "defocus", "focal_length": 3.04, "f_number": 2.0, "focus_distance": 19.1}
    design = mini(blur=lens)
    corners = design.meshes["guide"].vertices.copy()
    back = np.isclose(corners[:, 2], corners[:, 2].min())
    corners[back, 2] += np.tan(np.radians(tilt)) * corners[back, 0]
    design.meshes["guide"] = replace(design.meshes["guide"], vertices=corners)
    return design


def behind_a_curved_mirror() -> SensorDesign:
    """Svelte with a camera on sale, focused between its foci across and along its first mirror."""
    return library.with_imaging(ots.load("builtin:gelsight-svelte"), "pi-v1", focus_distance=126.0)


@pytest.mark.parametrize("build", [behind_a_wedge, behind_a_curved_mirror])
def test_the_blur_of_an_astigmatic_view_has_the_variance_of_the_traced_one(build: Any) -> None:
    model = OpticalModel(build())
    focus, (width, height) = model.picture_chain.focus, model.design.camera.resolution
    assert focus is not None
    blur = focus.in_pixels(PictureWindow.whole(height, width))
    for x in (width // 3, width // 2, 2 * width // 3):
        traced = traced_blur(model, x, height // 2)
        assert blur[height // 2, x] == pytest.approx(traced, rel=0.04)


def test_what_is_in_focus_stays_sharp_and_what_is_not_is_blurred() -> None:
    model = OpticalModel(mini())

    def contrast(focus: float | None) -> float:
        lens = {"kind": "defocus", "focal_length": 3.0, "f_number": 1.8, "focus_distance": focus}
        model.set_design(mini() if focus is None else mini(blur=lens))
        picture = model.render([BALL], (160, 120), photons=50_000).picture()
        return float(np.abs(np.diff(picture.astype(float), axis=1)).max())

    plain, sharp, soft = (contrast(focus) for focus in (None, 19.36, 12.0))
    assert sharp > 0.9 * plain
    assert soft < 0.6 * plain


def test_the_check_of_the_focus_knows_where_the_skin_appears_behind_a_wedge() -> None:
    design = behind_a_wedge(35.0)
    model = OpticalModel(design)
    traced = apparent_vergences(model.scenes.fine.scene, model.camera((32, 24)))
    straight = _focus_checks.straight_vergences(design, design.deformed_meshes())
    found, true = (np.median(each.mean(axis=-1)) for each in (straight, traced))
    assert found == pytest.approx(true, rel=0.015)


def test_rays_that_meet_different_surfaces_do_not_count_as_blur() -> None:
    """The largest deviation is that of the view, and not of the edges of the mirrors and the skin,
    so that an interpolation up to it blurs lines."""
    chain = OpticalModel(behind_a_curved_mirror()).picture_chain
    assert chain.focus is not None and chain.focus.largest * 320 < 1.2
    lines = np.zeros((240, 320, 3), dtype=np.float32)
    lines[:, 160] = 1.0
    assert chain.linear(lines)[120, 160].max() < 0.5 * chain.linear(np.ones_like(lines)).max()


def test_pictures_are_noisy_by_their_seed_alone() -> None:
    design = mini(noise={"full_well": 1000.0, "gain": 2.0})
    image = OpticalModel(design).render((), (80, 60), photons=50_000, seed=4)
    plain = replace(image, chain=PictureChain())
    first = image.picture()
    assert np.array_equal(first, image.picture()) and not np.array_equal(first, plain.picture())
    assert not np.array_equal(first, image.picture(noise_seed=5))
    assert np.array_equal(image.without_noise().picture(), plain.picture())


@pytest.mark.parametrize("name", SENSORS.names())
def test_only_the_fitted_sensors_have_no_plain_camera(name: str) -> None:
    """The others have ideal cameras, as the experiments of the paper do."""
    is_plain = ots.load(f"builtin:{name}").camera.picture_chain().is_plain
    fitted = name.startswith("gelsight-mini") and "ideal" not in name
    assert is_plain == (not fitted)


def test_light_is_kept_where_only_the_sensor_of_the_camera_changes() -> None:
    design = mini()
    camera = design.camera.model_dump(mode="json")
    model = OpticalModel(design)
    first = model.render((), (80, 60), photons=50_000)
    store = model._store
    sensor = {"noise": {"full_well": 900.0}, "tone_curve": {"kind": "gamma", "gamma": 2.0}}
    model.set_design(ots.set_value(design, "camera", camera | sensor))
    again = model.render((), (80, 60), photons=50_000)
    assert model._store is store
    assert np.allclose(again.radiance, first.radiance, rtol=1e-4)
    assert again.chain.noise is not None
    model.set_design(ots.set_value(design, "camera", camera | {"distortion": BARREL}))
    assert model._store is not store
    assert model.render((), (80, 60), photons=50_000).chain.is_plain
    seen = model.chief_rays((80, 60)).points
    assert np.abs(seen - OpticalModel(mini()).chief_rays((80, 60)).points).max() > 0.1

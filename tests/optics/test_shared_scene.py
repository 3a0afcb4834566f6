"""Ray scenes that share a scene of Mitsuba, as OptiX needs, against the same ones apart."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
import pytest

from optisense import Contact, OpticalModel, Sphere
from optisense.optics.scene import sensor_scenes
from optisense.optics.scene.contact_scenes import ContactScenes
from optisense.optics.scene.ray_scene import Ray, RayScene
from optisense.sensors import build

BALLS = [Contact(Sphere(radius=1.5), at=(x, 0.0), depth=0.5) for x in (-1.7, 1.7)]
RAYS = 20_000


@pytest.fixture(scope="module")
def model() -> OpticalModel:
    return OpticalModel(build("gelsight-mini"), "llvm")


@pytest.fixture(scope="module")
def apart(model: OpticalModel) -> ContactScenes:
    return model.scenes.touched(BALLS, [model.place(ball) for ball in BALLS])


def rays(scene: RayScene) -> Ray:
    """Return rays from the box around a scene in all directions."""
    random = np.random.default_rng(0)
    lower, upper = scene.bounds
    origin = random.uniform(lower, upper, (RAYS, 3))
    way = random.normal(size=(RAYS, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    return Ray(mi.Point3f(origin.T), mi.Vector3f(way.T), mi.Bool(True))


def test_rays_meet_the_same_triangles(apart: ContactScenes) -> None:
    """Rays that leave a mesh towards another one meet nothing."""
    together = apart.in_one_scene()
    assert together.full.scene is together.fixed.scene is together.indenters.scene
    for name in ("full", "fixed", "indenters"):
        one, other = getattr(apart, name), getattr(together, name)
        ray = rays(apart.full)
        expected, found = one.intersect(ray), other.intersect(ray)
        valid = np.asarray(expected.valid)
        assert valid.any() and not valid.all()
        # A few rays pass within the rounding of an edge.
        same = valid == np.asarray(found.valid)
        assert same.mean() > 1 - 1e-3, name
        hit = valid & same
        distance = np.asarray(expected.distance)[hit]
        assert np.quantile(np.abs(np.asarray(found.distance)[hit] - distance), 0.999) < 1e-3
        assert (np.asarray(found.face)[hit] == np.asarray(expected.face)[hit]).mean() > 0.999
        blocked = np.asarray(other.occluded(ray.origin, ray.direction, ray.active))
        assert (blocked == valid).mean() > 1 - 1e-3
        far, reached = other.hit_distance(ray.origin, ray.direction)
        assert (np.asarray(reached) == valid).mean() > 1 - 1e-3
        assert np.quantile(np.abs(np.asarray(far)[hit] - distance), 0.999) < 1e-3


def test_pictures_are_equal(model: OpticalModel, monkeypatch: pytest.MonkeyPatch) -> None:
    """The second picture is rendered as on a GPU, whose kernels trace rays in only one scene."""
    size = {"resolution": (80, 60), "photons": 100_000}
    expected = model.render(BALLS, **size).radiance
    asked = []
    monkeypatch.setattr(sensor_scenes, "one_scene_per_kernel", lambda: asked.append(1) or True)
    found = OpticalModel(model.design, "llvm").render(BALLS, **size).radiance
    assert asked
    error = np.abs(found - expected) / expected.mean()
    assert np.quantile(error, 0.99) < 1e-3
    assert found.mean() == pytest.approx(expected.mean(), rel=1e-3)

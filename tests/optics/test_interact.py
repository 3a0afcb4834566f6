"""Rays of every kind obey the same laws at a surface and have the same depth limit."""

from __future__ import annotations

from dataclasses import replace

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from reference_scenes import diffuse_coating, quad

from optisense.optics.scene.ray_scene import Ray, RayScene
from optisense.optics.scene.surfaces import Surface, SurfaceKind
from optisense.optics.transport.interact import (
    MAX_DEPTH,
    PHOTON_DEPTH,
    Interaction,
    LobeSample,
    RayKind,
    interact,
)

SINE = 0.6
INDEX = 1.5
RAYS = 4096
SILVER = Surface(SurfaceKind.MIRROR, metal_eta=(0.1,) * 3, metal_k=(4.0,) * 3)


def wide(surface: Surface, z: float = 0.0) -> RayScene:
    """Return a square of 100 mm whose normal points to +z."""
    corners = [(-50, -50, z), (50, -50, z), (50, 50, z), (-50, 50, z)]
    return RayScene([quad("wide", corners, surface)])


def slanting(depth: int = 0) -> Ray:
    """Rays from above that meet the origin."""
    cosine = float(np.sqrt(1 - SINE**2))
    origin = mi.Point3f(-SINE, 0, cosine) + dr.zeros(mi.Point3f, RAYS)
    direction = mi.Vector3f(SINE, 0, -cosine) + dr.zeros(mi.Vector3f, RAYS)
    return Ray(origin, direction, dr.full(mi.Bool, True, RAYS), dr.full(mi.UInt32, depth, RAYS))


def met(surface: Surface, ray_kind: RayKind, depth: int = 0) -> Interaction:
    even = (dr.arange(mi.Float, RAYS) + 0.5) / RAYS
    place = mi.Point2f(0.5, 0.5) + dr.zeros(mi.Point2f, RAYS)
    step = interact(wide(surface), slanting(depth), ray_kind, LobeSample(even, place))
    dr.eval(step)
    return step


@pytest.mark.parametrize("ray_kind", RayKind)
def test_refraction_follows_snell_and_fresnel(ray_kind: RayKind) -> None:
    step = met(Surface(SurfaceKind.DIELECTRIC, eta=INDEX), ray_kind)
    turned = np.asarray(step.turned).astype(bool)
    way = np.asarray(step.ray.direction).T
    cos_i, cos_t = np.sqrt(1 - SINE**2), np.sqrt(1 - (SINE / INDEX) ** 2)
    assert np.allclose(way[~turned], (SINE / INDEX, 0, -cos_t), atol=1e-6)
    assert np.allclose(way[turned], (SINE, 0, cos_i), atol=1e-6)
    across = (cos_i - INDEX * cos_t) / (cos_i + INDEX * cos_t)
    along = (INDEX * cos_i - cos_t) / (INDEX * cos_i + cos_t)
    reflectance = (across**2 + along**2) / 2
    weight = np.asarray(step.lobe.weight)[0]
    if ray_kind.draws:
        assert turned.mean() == pytest.approx(reflectance, abs=1 / RAYS)
    else:
        assert not turned.any()
    if ray_kind is RayKind.PHOTON:  # power is shared out by the draw
        assert np.allclose(weight, 1)
    if (
        ray_kind is RayKind.CAMERA
    ):  # radiance in the denser medium is larger by the square of the index
        assert np.allclose(weight, (1 - reflectance) / INDEX**2, rtol=1e-5)
        assert np.allclose(np.asarray(step.reflection.weight), reflectance, rtol=1e-5)


def test_a_rough_face_splits_camera_rays_by_the_shares_of_drawn_ones() -> None:
    """All rays meet one facet; those of the camera go through, and carry their reflection along."""
    rough = Surface(SurfaceKind.DIELECTRIC, eta=INDEX, alpha=0.3)
    camera, drawn = met(rough, RayKind.CAMERA), met(rough, RayKind.REFLECTION)
    way, weight = np.asarray(drawn.ray.direction).T, np.asarray(drawn.lobe.weight)[0]
    for lobe, share in ((camera.lobe, way[:, 2] < 0), (camera.reflection, way[:, 2] > 0)):
        assert np.allclose(np.asarray(lobe.direction).T, way[share][0], atol=1e-6)
        expected = np.where(share, weight, 0).mean()
        assert np.allclose(np.asarray(lobe.weight), expected, atol=1 / RAYS)
        assert expected > 0.01


@pytest.mark.parametrize("ray_kind", [RayKind.PHOTON, RayKind.CAMERA])
def test_metal_reflects_as_in_the_medium_that_light_comes_from(ray_kind: RayKind) -> None:
    """The normal points to air; from behind, in gel, light meets the same metal as from the front
    of a surface of it in gel.
    """
    glued = replace(SILVER, eta=INDEX)
    in_gel = replace(SILVER, metal_eta=(0.1 / INDEX,) * 3, metal_k=(4.0 / INDEX,) * 3)
    assert np.all(met(glued, ray_kind).lobe.weight == met(SILVER, ray_kind).lobe.weight)
    expected = met(in_gel, ray_kind).lobe.weight
    ray = slanting()
    ray.origin.z, ray.direction.z = -ray.origin.z, -ray.direction.z
    place = mi.Point2f(0.5, 0.5) + dr.zeros(mi.Point2f, RAYS)
    step = interact(wide(glued), ray, ray_kind, LobeSample(dr.zeros(mi.Float, RAYS), place))
    assert np.allclose(np.asarray(step.lobe.weight), np.asarray(expected), rtol=1e-6)


@pytest.mark.parametrize("ray_kind", RayKind)
def test_mirrors_reflect_to_the_same_place_with_the_same_weight(ray_kind: RayKind) -> None:
    step = met(SILVER, ray_kind)
    cosine = np.sqrt(1 - SINE**2)
    assert np.allclose(np.asarray(step.ray.direction).T, (SINE, 0, cosine), atol=1e-6)
    assert (np.asarray(step.ray.origin)[2] > 0).all()
    if ray_kind is not RayKind.CHIEF:
        expected = met(SILVER, RayKind.PHOTON).lobe.weight
        assert np.array_equal(np.asarray(step.lobe.weight), np.asarray(expected))
        assert 0.9 < float(step.lobe.weight[0][0]) < 1


@pytest.mark.parametrize("ray_kind", RayKind)
def test_only_photons_go_on_from_opaque_surfaces(ray_kind: RayKind) -> None:
    step = met(diffuse_coating(0.5), ray_kind)
    assert dr.all(step.sensed)
    assert dr.all(step.ray.active == (ray_kind is RayKind.PHOTON))
    if ray_kind is RayKind.PHOTON:
        assert np.allclose(np.asarray(step.lobe.weight), 0.5)


@pytest.mark.parametrize("ray_kind", RayKind)
def test_rays_are_given_up_after_a_number_of_surfaces(ray_kind: RayKind) -> None:
    most = PHOTON_DEPTH if ray_kind is RayKind.PHOTON else MAX_DEPTH
    assert dr.all(met(SILVER, ray_kind, most - 2).ray.active)
    assert not dr.any(met(SILVER, ray_kind, most - 1).ray.active)

"""Media that refract R, G and B by indices of their own."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
import pytest
from reference_scenes import (
    ReferenceScene,
    diffuse_coating,
    landings_of,
    narrow_beam,
    pixel_middles,
    quad,
    side_lit_block,
)

import optisense as ots
from benchmarks.mitsuba_export import mitsuba_scene
from optisense.design.materials import Dielectric
from optisense.optics import OpticalModel
from optisense.optics.scene.emitters import Emitter
from optisense.optics.scene.ray_scene import Piece, RayScene
from optisense.optics.scene.surfaces import RGB, Surface, SurfaceKind
from optisense.optics.transport.camera_paths import find_visible_points

INDICES: RGB = (1.489, 1.494, 1.499)
"""Indices of acrylic at R, G, B."""

APEX = np.radians(50.0)


def prism(etas: RGB) -> Piece:
    """A prism along y whose two faces meet in an edge above, at x = 0."""
    half = np.tan(APEX / 2)
    low, high = -6.0, 4.0
    slope = (high - (low - 3)) * half
    points = [
        (x, y, z)
        for y in (-5.0, 5.0)
        for x, z in ((-slope, low - 3), (0.0, high), (slope, low - 3))
    ]
    faces = [[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4], [2, 0, 3], [2, 3, 5], [0, 2, 1], [3, 4, 5]]
    surface = Surface(SurfaceKind.DIELECTRIC, eta=etas[1], etas=etas)
    return Piece("prism", np.array(points), np.array(faces), surface)


def deviation(index: float, incidence: float) -> float:
    """Radians by which a prism turns a ray (Born and Wolf, 4.7.2)."""
    inside = np.arcsin(np.sin(incidence) / index)
    leaving = np.arcsin(index * np.sin(APEX - inside))
    return float(incidence + leaving - APEX)


def test_a_prism_turns_each_channel_by_its_own_angle() -> None:
    tilt = np.radians(4.0)  # the beam's, upwards; the left face's normal is APEX / 2 above -x
    incidence = APEX / 2 + tilt
    way = (float(np.cos(tilt)), 0.0, float(np.sin(tilt)))
    lamp = Emitter(0, (-8.0, 0.0, -4.0), way, intensity=narrow_beam(0.01))
    corners = [(30, -40, -60), (30, -40, 60), (30, 40, 60), (30, 40, -60)]
    pieces = [prism(INDICES), quad("wall", corners, diffuse_coating(0.0))]
    found = landings_of(pieces, [lamp], 30_000, True)
    power, travel = found.power, found.direction
    assert np.all((power > 0).sum(axis=1) == 1)  # each photon is light of one channel
    angles = np.arctan2(travel[:, 2], travel[:, 0])
    expected = [tilt - deviation(index, incidence) for index in INDICES]
    assert expected[0] - expected[2] > 0.008
    for channel in range(3):
        own = (power[:, channel] > 0) & (np.abs(angles - expected[channel]) < 0.02)
        assert own.mean() > 0.25  # a third, less what the faces reflect
        assert angles[own].mean() == pytest.approx(expected[channel], abs=1e-4)
        faces = power[own][:, channel].sum()
        assert 0.9 < faces < 0.93  # two faces reflect some 4 % each


def block(etas: RGB) -> ReferenceScene:
    return side_lit_block(Surface(SurfaceKind.DIELECTRIC, eta=etas[1], etas=etas))


WIDE: RGB = (1.3, 1.45, 1.6)
"""Indices far apart, so that they matter to the mean of an image."""

PATH_MEAN = (0.040967, 0.035074, 0.029092)
"""Means of images by Mitsuba 3.9.1's path of these scenes, one for each channel: 20 images of 2048
samples a pixel, with standard errors of 0.1 %."""


def path_mean(samples: int, seed: int) -> list[float]:
    """Of Mitsuba's path, a scene for each channel."""
    scene = block(WIDE)
    means = []
    for channel in range(3):
        described = mitsuba_scene(
            scene.pieces, scene.emitters, scene.camera, scene.flux, samples=samples, channel=channel
        )
        image = np.asarray(mi.render(mi.load_dict(described), seed=seed))
        means.append(float(image[..., channel].mean()))
    return means


def test_both_estimators_agree_with_mitsuba_channel_by_channel() -> None:
    for image in (block(WIDE).pairwise(2, 800_000)[0], block(WIDE).pooled(600_000)):
        assert image.sum(axis=0).mean(axis=(0, 1)) == pytest.approx(PATH_MEAN, rel=0.015)


def test_a_camera_sees_each_channel_by_its_own_way() -> None:
    scene = block(WIDE)
    pixel, film = pixel_middles(scene.camera)
    for channel, index in enumerate(WIDE):
        main, _ = find_visible_points(
            RayScene(scene.pieces), scene.camera, pixel, pixel, film, 0, channel=channel
        )
        weight = np.asarray(main.weight)
        assert np.all(np.delete(weight, channel, axis=0) == 0)
        x = np.asarray(film.x) / 16 - 1
        y = (24 - 2 * np.asarray(film.y)) / 32
        slope = np.hypot(x, y) * np.tan(np.radians(11))
        sine = slope / np.hypot(1, slope) / index
        reach = 20 * slope + 4 * sine / np.sqrt(1 - sine**2)
        points = np.asarray(main.point)
        assert np.hypot(points[0], points[1]) == pytest.approx(reach, abs=2e-3)


def test_equal_indices_for_all_channels_give_the_usual_picture(plain_mini: OpticalModel) -> None:
    design = ots.load("gelsight-mini-ideal")
    for name, material in design.materials.items():
        assert isinstance(material, Dielectric)
        ior = material.ior
        design.materials[name] = Dielectric(ior=ior, dispersion=(ior, ior, ior + 1e-9))
    design.dispersion = True
    usual = plain_mini.render((), (64, 48), photons=300_000)
    spread = OpticalModel(design)
    assert spread.scene.dispersive
    image = spread.render((), (64, 48), photons=900_000)
    for name, layer in image.layers.items():
        assert layer.sum() == pytest.approx(usual.layers[name].sum(), rel=0.01)
        blocks = [
            each.sum(axis=2).reshape(3, 16, 4, 16).mean(axis=(1, 3))
            for each in (layer, usual.layers[name])
        ]
        assert blocks[0] == pytest.approx(blocks[1], abs=0.05 * float(blocks[1].mean()))


def test_an_index_for_each_channel_counts_only_where_the_design_asks(
    plain_mini: OpticalModel,
) -> None:
    assert not plain_mini.scene.dispersive
    asked = ots.set_value(ots.load("gelsight-mini-ideal"), "dispersion", True)
    model = OpticalModel(asked)
    assert model.scene.dispersive
    model.update("dispersion", False)
    assert not model.scene.dispersive

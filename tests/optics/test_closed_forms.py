"""Light in scenes whose answer can be written down."""

from __future__ import annotations

import numpy as np
import pytest
from reference_scenes import (
    ReferenceScene,
    box,
    diffuse_coating,
    emitting_face,
    floor,
    fresnel,
    isotropic,
    landings_of,
    pixel_middles,
    quad,
)

from optisense.optics.camera.projection import RayCamera
from optisense.optics.scene.emitters import Emitter, EmitterShape
from optisense.optics.scene.ray_scene import Piece, RayScene
from optisense.optics.scene.surfaces import Surface, SurfaceKind
from optisense.optics.transport.camera_paths import find_visible_points

PHOTONS = 400_000
POWER = 1000.0

LANDED = 0.004
"""Relative error of sums over 100,000 landings and more; the points have a low discrepancy."""

PER_PIXEL = 0.05
"""RMS error of single pixels; some 800 photons under each kernel give 4 %."""

ON_AVERAGE = 0.01
"""Relative error of an image's mean."""

BLACK = diffuse_coating(0.0)
GREY = diffuse_coating(0.5)


def looking_down(fov: float = 20.0, height: float = 20.0) -> RayCamera:
    return RayCamera((0, 0, height), (0, 0, -1), (0, 1, 0), fov, 32, 24)


def both_estimators(scene: ReferenceScene) -> list[np.ndarray]:
    paired, _ = scene.pairwise(2, PHOTONS // 2, radius=0.3)
    return [paired.sum(axis=0)[..., 0], scene.pooled(PHOTONS).sum(axis=0)[..., 0]]


def agrees(image: np.ndarray, expected: np.ndarray) -> None:
    assert image.mean() == pytest.approx(expected.mean(), rel=ON_AVERAGE)
    assert np.sqrt(((image / expected - 1) ** 2).mean()) < PER_PIXEL


def test_a_point_light_over_a_plane_falls_with_the_square_and_the_cosine() -> None:
    height = 4.0
    lamp = Emitter(0, (1.0, 0, height), (0, 0, -1), intensity=isotropic())
    scene = ReferenceScene([floor(GREY)], [lamp], [(POWER,) * 3], looking_down())
    points = scene.chief_rays().points.astype(float)
    distance2 = height**2 + (points[..., 0] - 1) ** 2 + points[..., 1] ** 2
    irradiance = POWER / (4 * np.pi) * height / distance2**1.5
    for image in both_estimators(scene):
        agrees(image, 0.5 / np.pi * irradiance)
    # Within a circle lands the share of all light that its cone holds.
    landings = landings_of([floor(BLACK, 20)], [lamp], PHOTONS)
    from_axis = np.hypot(landings.place[:, 0] - 1, landings.place[:, 1])
    for radius in (1.0, 3.0, 8.0):
        share = (1 - height / np.hypot(height, radius)) / 2
        assert landings.power[from_axis < radius].sum() == pytest.approx(share, rel=4 * LANDED)


def test_light_on_a_skin_of_2_mm_is_as_sharp_as_on_a_large_one() -> None:
    height = 0.4
    lamp = Emitter(0, (0.1, 0, height), (0, 0, -1), intensity=isotropic())
    camera = looking_down(height=2.0)
    scene = ReferenceScene([floor(GREY, 1.0)], [lamp], [(POWER,) * 3], camera)
    points = scene.chief_rays().points.astype(float)
    distance2 = height**2 + (points[..., 0] - 0.1) ** 2 + points[..., 1] ** 2
    expected = 0.5 / np.pi * POWER / (4 * np.pi) * height / distance2**1.5
    agrees(scene.pooled(PHOTONS).sum(axis=0)[..., 0], expected)


def parallel_rectangle(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Form factor of a rectangle with a corner over a point, parallel; sides over distance."""
    a, b = np.sqrt(1 + x * x), np.sqrt(1 + y * y)
    return (x / a * np.arctan(y / a) + y / b * np.arctan(x / b)) / (2 * np.pi)


@pytest.mark.parametrize("shape", [EmitterShape.RECTANGLE, EmitterShape.DISC])
def test_a_lambertian_area_light_has_its_form_factor(shape: EmitterShape) -> None:
    height, size = 6.0, (4.0, 2.0) if shape is EmitterShape.RECTANGLE else (3.0, 3.0)
    lamp = Emitter(0, (0, 0, height), (0, 0, -1), (0, 1, 0), shape, size)
    camera = RayCamera((0, 0, 5.9), (0, 0, -1), (0, 1, 0), 60, 32, 24)
    scene = ReferenceScene([floor(GREY)], [lamp], [(POWER,) * 3], camera)
    points = scene.chief_rays().points.astype(float)
    x, y = points[..., 0], points[..., 1]
    if shape is EmitterShape.RECTANGLE:
        factor = sum(
            i * j * parallel_rectangle((2 * i - x) / height, (1 * j - y) / height)
            for i in (-1, 1)
            for j in (-1, 1)
        )
    else:
        # A disc seen from a parallel plane, off its axis (Howell's catalogue, B-13).
        h2, r2 = (height / 1.5) ** 2, (x**2 + y**2) / 1.5**2
        z = 1 + h2 + r2
        factor = 0.5 * (1 - (r2 + h2 - 1) / np.sqrt(z * z - 4 * r2))
    radiance = POWER / (np.pi * lamp.area)
    for image in both_estimators(scene):
        agrees(image, 0.5 * radiance * factor)


def test_a_square_light_sends_a_fifth_to_a_square_as_far_as_it_is_wide() -> None:
    lamp = Emitter(0, (0, 0, 2), (0, 0, -1), (0, 1, 0), EmitterShape.RECTANGLE, (2.0, 2.0))
    got = landings_of([floor(BLACK, 1.0)], [lamp], PHOTONS).power.sum()
    # Two equal squares, facing, one side apart (Howell's catalogue, C-11).
    assert got == pytest.approx(0.199825, rel=LANDED)


def test_a_light_in_view_has_its_own_radiance() -> None:
    lamp = Emitter(0, (0, 0, 0), (0, 0, 1), (0, 1, 0), EmitterShape.RECTANGLE, (8.0, 8.0))
    pieces = [emitting_face(0, lamp), floor(GREY, 10, -1.0)]
    scene = ReferenceScene(pieces, [lamp], [(POWER,) * 3], looking_down())
    paired, _ = scene.pairwise(1, 1000)
    for image in (paired, scene.pooled(10_000)):
        assert image[0] == pytest.approx(POWER / (np.pi * 64), rel=1e-4)


GLASS = Surface(SurfaceKind.DIELECTRIC, eta=1.5)


def test_what_a_camera_sees_through_interfaces_is_weighted_by_fresnel_and_index() -> None:
    camera = looking_down(60.0, 10.0)
    pixel, film = pixel_middles(camera)
    x, y = (np.asarray(film)[0] / 16 - 1), (24 - 2 * np.asarray(film)[1]) / 32
    angle = np.arctan(np.hypot(x, y) * np.tan(np.radians(30)))
    known = [fresnel(a, 1.5) for a in angle]
    reflectance = np.array([k[0] for k in known])
    inside = np.array([k[1] for k in known])
    # Through a plate, and into a block whose bottom is coated.
    plate = box("plate", (-40, -40, 1), (40, 40, 3), GLASS)
    main, _ = find_visible_points(RayScene([plate, floor(GREY, 40)]), camera, pixel, pixel, film, 0)
    assert np.asarray(main.weight)[0] == pytest.approx((1 - reflectance) ** 2, rel=1e-4)
    block = box("block", (-40, -40, 0), (40, 40, 3), GLASS, without=["-z"])
    main, _ = find_visible_points(RayScene([block, floor(GREY, 40)]), camera, pixel, pixel, film, 0)
    # Radiance in glass is n^2 times that outside.
    assert np.asarray(main.weight)[0] == pytest.approx((1 - reflectance) / 1.5**2, rel=1e-4)
    reach = 7 * np.tan(angle) + 3 * np.tan(inside)
    points = np.asarray(main.point)
    assert np.hypot(points[0], points[1]) == pytest.approx(reach, abs=2e-3)


ACRYLIC = 1.49


def guide_with_plane_above(gap: float) -> tuple[list[Piece], Emitter]:
    """A bar lit from its -x end by a flat LED in air; black planes over it and at its far end."""
    bar = Surface(SurfaceKind.DIELECTRIC, eta=ACRYLIC)
    top = 2.0
    sides = ["+z"] if gap == 0 else []
    pieces = [box("bar", (-10, -5, -top), (10, 5, top), bar, without=sides)]
    z = top + gap
    start = -10.0 if gap == 0 else -9.0
    pieces.append(quad("above", [(start, -5, z), (start, 5, z), (10, 5, z), (10, -5, z)], BLACK))
    end = [(11.0, -40, -40), (11.0, 40, -40), (11.0, 40, 40), (11.0, -40, 40)]
    pieces.append(quad("end", end, BLACK))
    lamp = Emitter(0, (-10.2, 0, 0), (1, 0, 0), (0, 0, 1), EmitterShape.RECTANGLE, (2.0, 2.0))
    return pieces, lamp


def test_a_side_lit_guide_keeps_its_light_behind_a_film_of_air() -> None:
    pieces, lamp = guide_with_plane_above(0.02)
    landings = landings_of(pieces, [lamp], 100_000)
    # Inside, light is within 42.2 degrees of the axis: it meets the long faces at more than 47.8
    # degrees, beyond the critical 42.2. It leaves at the far end only.
    assert landings.power[landings.surface == 1].sum() == 0.0
    # What does not come out there went back out of the near end, or past the bar at once.
    assert landings.power[landings.surface == 2].sum() > 0.75


def test_a_side_lit_guide_gives_its_light_to_what_touches_it() -> None:
    pieces, lamp = guide_with_plane_above(0.0)
    landings = landings_of(pieces, [lamp], 100_000)
    assert landings.power[landings.surface == 1].sum() > 0.3


@pytest.mark.parametrize(
    ("albedo", "filling"),
    [(0.0, "nothing"), (0.5, "nothing"), (0.8, "nothing"), (0.0, "glass"), (0.5, "glass")],
)
def test_a_closed_box_keeps_its_energy(albedo: float, filling: str) -> None:
    pieces = [box("room", (-5, -4, -3), (5, 4, 3), diffuse_coating(albedo), inward=True)]
    if filling == "glass":
        pieces.append(box("block", (1, -2, -2), (4, 2, 1.5), GLASS))
    lamp = Emitter(0, (-2, 0.5, 0.2), (0, 0, 1), intensity=isotropic())
    landings = landings_of(pieces, [lamp], 200_000)
    # P (1 + a + a^2 + ...); the paths cut off after 32 surfaces hold less than 0.1 % of it, some
    # more where light is caught in the glass.
    tolerance = LANDED if filling == "nothing" else 2 * LANDED
    assert landings.power.sum() == pytest.approx(1 / (1 - albedo), rel=tolerance)


def test_a_lamp_in_gel_over_a_coating_lights_it_as_in_air() -> None:
    """Refraction plays no part where light crosses no interface."""
    lamp = Emitter(0, (0, 0, 2), (0, 0, -1), (0, 1, 0), EmitterShape.RECTANGLE, (1.0, 1.0))
    gel = box("gel", (-10, -10, 0), (10, 10, 4), GLASS, without=["-z"])
    in_air = landings_of([floor(BLACK)], [lamp], PHOTONS).power.sum()
    in_gel = landings_of([floor(BLACK), gel], [lamp], PHOTONS).power.sum()
    assert in_gel == pytest.approx(in_air, rel=LANDED)


def test_photons_of_one_light_add_up_to_its_power() -> None:
    room = [box("room", (-5, -4, -3), (5, 4, 3), BLACK, inward=True)]
    lamps = [
        Emitter(0, (0, 0, 0), (0, 1, 0), shape=EmitterShape.DISC, size=(1.0, 1.0)),
        Emitter(0, (1, 0, 0), (1, 1, 0), intensity=isotropic()),
    ]
    assert landings_of(room, lamps, 10_000).power.sum() == pytest.approx(2.0, rel=1e-5)

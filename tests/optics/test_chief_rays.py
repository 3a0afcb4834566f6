"""Chief rays against the laws of refraction and reflection, written out."""

from __future__ import annotations

import numpy as np
import pytest
from reference_scenes import box, diffuse_coating, quad

from optisense import OpticalModel, set_value
from optisense.optics.camera.projection import RayCamera
from optisense.optics.scene.ray_scene import Piece, RayScene
from optisense.optics.scene.surfaces import Surface, SurfaceKind
from optisense.optics.transport.chief_rays import (
    ChiefRays,
    RayOutcome,
    picture_directions,
    pixel_stretching,
    sees_nothing,
    trace_chief_rays,
)
from optisense.sensors import gelbelt, load

# Single precision over some 10 mm, and rays that start RAY_OFFSET (0.0002 mm) off each surface.
PLACE = 2e-3
GLASS = Surface(SurfaceKind.DIELECTRIC, eta=1.5)
COATING = diffuse_coating(0.5)


def trace(pieces: list[Piece], camera: RayCamera) -> ChiefRays:
    scene = RayScene(pieces)
    return trace_chief_rays(scene, camera, np.arange(sum(len(p.faces) for p in pieces)))


def camera(
    direction: tuple[float, float, float] = (0, 0, 1),
    fov: float = 60.0,
    equidistant: bool = False,
    position: tuple[float, float, float] = (0, 0, -10),
    pixels: tuple[int, int] = (32, 24),
) -> RayCamera:
    return RayCamera(position, direction, (0, 1, 0), fov, *pixels, equidistant)


def slopes(fov: float, width: int, height: int) -> tuple[np.ndarray, np.ndarray]:
    """Right and up components of pixel rays whose forward component is 1."""
    tangent = np.tan(np.radians(fov) / 2)
    x = (2 * (np.arange(width) + 0.5) / width - 1) * tangent
    y = (height - 2 * (np.arange(height) + 0.5)) / width * tangent
    return np.meshgrid(x, y)


def plane(z: float, half: float = 50.0) -> Piece:
    corners = [(-half, -half, z), (-half, half, z), (half, half, z), (half, -half, z)]
    return quad("plane", corners, COATING)


def test_a_flat_plate_shifts_rays_by_snells_law() -> None:
    plate = box("plate", (-50, -50, -2), (50, 50, 0), GLASS)
    rays = trace([plate, plane(3.0)], camera())
    x, y = slopes(60.0, 32, 24)
    tangent = np.hypot(x, y)
    inside = np.sin(np.arctan(tangent)) / 1.5
    reach = (8 + 3) * tangent + 2 * inside / np.sqrt(1 - inside**2)
    # Looking along +z with +y up, image right is -x.
    expected = np.stack([-x / tangent * reach, y / tangent * reach], axis=-1)
    assert rays.hit.all()
    assert np.abs(rays.points[..., :2] - expected).max() < PLACE
    assert np.abs(rays.points[..., 2] - 3).max() < PLACE
    # Parallel faces leave the direction as it was, and the normal looks back along the ray.
    assert np.abs(rays.incidence - np.cos(np.arctan(tangent))).max() < 1e-5
    assert np.allclose(rays.normals, (0, 0, -1))


def test_a_mirror_at_45_degrees_swaps_two_axes() -> None:
    tilted = [(-9.0, -50, -4), (9.0, -50, 14), (9.0, 50, 14), (-9.0, 50, -4)]
    silver = Surface(SurfaceKind.MIRROR, metal_eta=(0.1,) * 3, metal_k=(4.0,) * 3)
    wall = [(12.0, -50, -50), (12.0, -50, 50), (12.0, 50, 50), (12.0, 50, -50)]
    rays = trace([quad("mirror", tilted, silver), quad("wall", wall, COATING)], camera(fov=30))
    right, up = slopes(30.0, 32, 24)
    x = -right
    # The mirror is the plane x = z - 5; it turns (x, y, 1) into (1, y, x).
    t = 15 / (1 - x)
    travel = 12 - t * x
    expected = np.stack([np.full_like(x, 12.0), t * up + travel * up, t - 10 + travel * x], axis=-1)
    assert rays.hit.all()
    assert np.abs(rays.points - expected).max() < PLACE
    # To the right on this picture is down on the wall, as a picture shows it in the mirror.
    right, up = picture_directions(rays, np.array([12.0, 0.0, 5.0]))
    assert right / np.linalg.norm(right) == pytest.approx([0.0, 0.0, -1.0], abs=0.05)
    assert up / np.linalg.norm(up) == pytest.approx([0.0, 1.0, 0.0], abs=0.05)


def test_a_ray_that_meets_nothing_escapes() -> None:
    rays = trace([plane(3.0)], camera(direction=(0, 0, -1)))
    assert (rays.outcome == RayOutcome.ESCAPED).all()


def test_the_outside_of_the_coating_is_no_hit() -> None:
    rays = trace([plane(3.0)], camera(direction=(0, 0, -1), position=(0, 0, 10)))
    assert (rays.outcome == RayOutcome.ABSORBED).all()


@pytest.mark.parametrize("kind", [SurfaceKind.ABSORBER, SurfaceKind.LIGHT, SurfaceKind.OPAQUE])
def test_a_ray_ends_on_what_is_not_the_sensing_surface(kind: SurfaceKind) -> None:
    half = [(0.0, -50, 0), (0.0, 50, 0), (50.0, 50, 0), (50.0, -50, 0)]
    rays = trace([quad("blocker", half, Surface(kind)), plane(3.0)], camera())
    assert (rays.outcome[:, :16] == RayOutcome.ABSORBED).all()
    assert (rays.outcome[:, 16:] == RayOutcome.HIT).all()


def test_rays_caught_in_a_glass_cube_are_totally_reflected() -> None:
    cube = box("cube", (-1, -1, -1), (1, 1, 1), GLASS)
    # To all six faces at 54.7 degrees; the critical angle is 41.8.
    caught = trace([cube], camera((1, 1, 1), 1.0, position=(0.1, 0.05, 0.02)))
    assert (caught.outcome == RayOutcome.TOTAL_REFLECTION).all()
    free = trace([cube], camera((0, 0, 1), 1.0, position=(0.1, 0.05, 0.02)))
    assert (free.outcome == RayOutcome.ESCAPED).all()


def test_a_fisheye_maps_angle_to_radius_evenly() -> None:
    room = box("room", (-4, -4, -4), (4, 4, 4), COATING, inward=True)
    rays = trace([room], camera(fov=180, equidistant=True, position=(0, 0, 0), pixels=(64, 48)))
    ways = rays.points / np.linalg.norm(rays.points, axis=-1, keepdims=True)
    x = 2 * (np.arange(64) + 0.5) / 64 - 1
    y = (48 - 2 * (np.arange(48) + 0.5)) / 64
    radius = np.hypot(*np.meshgrid(x, y))
    assert np.abs(np.degrees(np.arccos(ways[..., 2])) - 90 * radius).max() < 0.05
    assert rays.points[24, 0, 0] > 0 > rays.points[24, 63, 0]
    assert rays.points[0, 32, 1] > 0 > rays.points[47, 32, 1]


@pytest.mark.parametrize(("fov", "pixels"), [(280.0, (48, 48)), (200.0, (20, 80))])
def test_a_fisheye_sees_nothing_beyond_180_degrees(fov: float, pixels: tuple[int, int]) -> None:
    room = box("room", (-4, -4, -4), (4, 4, 4), COATING, inward=True)
    rays = trace([room], camera(fov=fov, equidistant=True, position=(0, 0, 0), pixels=pixels))
    width, height = pixels
    x = 2 * (np.arange(width) + 0.5) / width - 1
    y = (height - 2 * (np.arange(height) + 0.5)) / width
    shows = 0.5 * fov * np.hypot(*np.meshgrid(x, y)) <= 180.0
    assert 0.3 < shows.mean() < 0.99 and np.array_equal(rays.hit, shows)
    assert (rays.outcome[~shows] == RayOutcome.ESCAPED).all()


def test_face_numbers_are_those_of_the_mesh_hit() -> None:
    room = box("room", (-4, -4, -4), (4, 4, 4), COATING, inward=True)
    rays = trace([room], camera(fov=120, position=(0.3, 0.2, 0.1)))
    corners = np.asarray(room.vertices)[np.asarray(room.faces)][rays.face]
    normal = np.cross(
        corners[..., 1, :] - corners[..., 0, :], corners[..., 2, :] - corners[..., 0, :]
    )
    off = np.einsum("hwk,hwk->hw", rays.points - corners[..., 0, :], normal)
    assert np.abs(off).max() < PLACE * 64


def test_no_ray_slips_through_between_two_triangles() -> None:
    # Rays of the middle row and column run along edges of this regular mesh.
    belt = OpticalModel(gelbelt(light_design=2, tessellation=0.7), "llvm")
    assert belt.chief_rays((320, 240)).hit.all()


def test_a_tilted_plane_is_stretched_by_the_cosine() -> None:
    """Seen from far along its normal a plane keeps angles; tilted by 60 degrees, it shows a small
    circle of the picture twice as long as wide.
    """
    straight = pixel_stretching(trace([plane(300.0, 500.0)], camera(fov=2)))
    assert np.nanmax(straight) == pytest.approx(1.0, abs=2e-3)
    assert np.isnan(straight[0]).all() and np.isfinite(straight[1:-1, 1:-1]).all()
    slope = np.tan(np.radians(60))
    corners = [(x, y, 300 + slope * x) for x, y in ((-90, -500), (-90, 500), (90, 500), (90, -500))]
    tilted = pixel_stretching(trace([quad("plane", corners, COATING)], camera(fov=2)))
    assert np.nanmedian(tilted) == pytest.approx(2.0, rel=0.02)


def test_stretching_is_unknown_where_nothing_is_seen() -> None:
    half = [(0.0, -50, 3), (0.0, 50, 3), (50.0, 50, 3), (50.0, -50, 3)]
    rays = trace([quad("plane", half, COATING)], camera())
    found = pixel_stretching(rays)
    assert np.isnan(found[~rays.hit]).all()
    assert np.isfinite(found).any()


def test_rays_in_a_plane_of_symmetry_miss_no_triangle() -> None:
    # A picture with an odd number of rows has one row in the plane y = 0 of DIGIT.
    assert OpticalModel(load("digit")).chief_rays((160, 213)).hit.all()


@pytest.mark.parametrize("size", [(60, 80), (60, 60), (80, 40), (80, 60)])
def test_nine_contacts_span_pictures_of_any_shape(
    plain_mini: OpticalModel, size: tuple[int, int]
) -> None:
    # A narrow field of view, so that tall pictures show skin only.
    narrow = set_value(plain_mini.design, "camera.fov", 45.0)
    own = OpticalModel(set_value(narrow, "camera.resolution", list(size)))
    for model, resolution in ((own, None), (OpticalModel(narrow), size)):
        points = model.chief_rays(size).points
        spots = []
        for contact in model.nine_contacts(resolution=resolution):
            away = np.linalg.norm(points - np.array(contact.point), axis=2)
            row, column = np.unravel_index(away.argmin(), away.shape)
            spots.append(((column + 0.5) / size[0], (row + 0.5) / size[1]))
        low, high = np.min(spots, axis=0), np.max(spots, axis=0)
        # A grid of three by three leaves a sixth of the picture at each side; on 2:1 pictures the
        # even patches are no grid, and reach farther along the width.
        assert (low < 0.25).all() and (low > 0.05).all()
        assert (high > 0.75).all() and (high < 0.95).all()


@pytest.mark.parametrize(("specularity", "told"), [(1.0, True), (0.5, False)])
def test_a_blind_camera_is_told_about_rough_mirrors_only(specularity: float, told: bool) -> None:
    metal = Surface(SurfaceKind.OPAQUE, alpha=0.1, specularity=specularity)
    corners = [(-5, -5, 2), (-5, 5, 2), (5, 5, 2), (5, -5, 2)]
    scene = RayScene([quad("metal", corners, metal)])
    hint = str(sees_nothing(trace_chief_rays(scene, camera()), scene).hint)
    assert ("roughness" in hint) == told


@pytest.mark.parametrize("tilt", [-0.002, 0.0, 0.002])
@pytest.mark.parametrize(
    ("up", "u", "v"),
    [((0.0, 1.0, 0.0), (-1, 0, 0), (0, 1, 0)), ((0.0, 0.0, 1.0), (0, -1, 0), (-1, 0, 0))],
)
def test_axes_are_those_of_the_picture_for_a_camera_along_the_surface(
    plain_mini: OpticalModel,
    tilt: float,
    up: tuple[float, ...],
    u: tuple[int, ...],
    v: tuple[int, ...],
) -> None:
    placed = {"position": (-20.0, 0.0, -15.0), "direction": (1.0, 0.0, tilt), "up": up}
    beside = set_value(plain_mini.design, "camera.fov", 100.0)
    for name, value in placed.items():
        beside = set_value(beside, f"camera.{name}", value)
    surface = OpticalModel(beside).surface
    assert surface.u_axis == pytest.approx(np.array(u), abs=1e-3)
    assert surface.v_axis == pytest.approx(np.array(v), abs=1e-3)

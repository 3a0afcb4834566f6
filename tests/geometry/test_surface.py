"""Surface coordinates: lengths on flat, cylindrical and spherical surfaces."""

import math

import numpy as np
import pytest

from optisense.errors import ContactError
from optisense.geometry import SensingSurface, TriangleMesh, nine_places


def bent(radius: float, ball: bool) -> SensingSurface:
    """A 20 x 16 mm sheet bent to a cylinder about y (or a ball) with its top at the origin."""
    mesh = TriangleMesh.grid((20.0, 16.0), (80, 64)).flipped()
    x, y = mesh.vertices[:, 0], mesh.vertices[:, 1]
    distance = np.hypot(x, y) if ball else x
    with np.errstate(invalid="ignore"):
        out = np.where(distance == 0, 1.0, radius * np.sin(distance / radius) / distance)
    vertices = np.column_stack(
        [x * out, y * out if ball else y, radius * (np.cos(distance / radius) - 1)]
    )
    return SensingSurface(TriangleMesh(vertices, mesh.faces), (0, 0, 1), (1, 0, 0), (0, 1, 0))


def test_flat_coordinates_are_plane_coordinates() -> None:
    mesh = TriangleMesh.grid((20.0, 16.0), (7, 6), height=0.3).flipped()
    surface = SensingSurface(mesh, (1, 2, 5), (1, 0, 0.2), (0.3, 1, 0))
    for u, v in [(0, 0), (3, 0), (0, -4), (2.5, 3.1), (-11, -10), (9, 6)]:
        place = surface.point_at(u, v)
        np.testing.assert_allclose(place.point, [1 + u, 2 + v, 0.3], atol=1e-9)
        np.testing.assert_allclose(place.inward, [0, 0, -1], atol=1e-12)


def test_on_a_cylinder_straight_ways_are_helices() -> None:
    surface = bent(8.0, ball=False)
    for u, v in [(5, 0), (0, 5), (4, 3), (-9, 7), (8, -7.9)]:
        place = surface.point_at(u, v)
        expected = [8 * math.sin(u / 8), v, 8 * (math.cos(u / 8) - 1)]
        np.testing.assert_allclose(place.point, expected, atol=2e-3)
        np.testing.assert_allclose(place.inward, [-math.sin(u / 8), 0, -math.cos(u / 8)], atol=5e-3)


def test_on_a_ball_straight_ways_are_great_circles() -> None:
    surface = bent(9.0, ball=True)
    for u, v in [(5, 0), (3, 4), (-6, 5), (2, -7)]:
        angle, length = math.atan2(v, u), math.hypot(u, v)
        across = 9 * math.sin(length / 9)
        expected = [
            across * math.cos(angle), across * math.sin(angle), 9 * (math.cos(length / 9) - 1)
        ]  # fmt: skip
        np.testing.assert_allclose(surface.point_at(u, v).point, expected, atol=1e-2)


def test_u_and_v_turn_with_a_cylinder_also_beyond_its_side() -> None:
    surface = bent(5.0, ball=False)
    for place in (2.0, 9.0):  # bent down by 23 and by 103 degrees
        ends = [surface.point_at(place + step, 0.0).point for step in (-0.5, 0.5)]
        u, v = surface.directions(surface.point_at(place, 0.0).inward)
        np.testing.assert_allclose(u, ends[1] - ends[0], atol=0.02)
        np.testing.assert_allclose(v, [0, 1, 0], atol=1e-9)


def test_tangents_turn_with_the_surface_without_a_jump_on_a_dome() -> None:
    surface = bent(9.0, ball=True)
    polar, azimuth = np.meshgrid(np.radians(np.linspace(0, 100, 51)), np.linspace(-4, 4, 401))
    normals = np.stack(
        [-np.sin(polar) * np.cos(azimuth), -np.sin(polar) * np.sin(azimuth), -np.cos(polar)], -1
    )
    first, second = surface.tangents(normals)
    axes = np.stack([first, second, normals], axis=-2)
    np.testing.assert_allclose(axes @ axes.swapaxes(-1, -2), np.broadcast_to(np.eye(3), axes.shape),
                               atol=1e-9)  # fmt: skip
    np.testing.assert_allclose(first[:, 0], np.broadcast_to([1.0, 0, 0], first[:, 0].shape),
                               atol=1e-3)  # fmt: skip
    # Neighbours are two degrees of polar angle or a fiftieth of a radian of azimuth apart.
    for step in (np.diff(first, axis=0), np.diff(first, axis=1)):
        assert np.linalg.norm(step, axis=-1).max() < 0.05


def test_tangents_on_a_fingertip_follow_its_meridians() -> None:
    """A dome of radius 5 mm on a round wall; at the wall, they point along the axis."""
    mesh = TriangleMesh.grid((24.0, 24.0), (80, 80)).flipped()
    distance = np.maximum(np.hypot(*mesh.vertices[:, :2].T), 1e-9)
    polar = np.minimum(distance / 5.0, math.pi / 2)
    across = 5.0 * np.sin(polar) / distance
    down = 5.0 * (np.cos(polar) - 1.0) - np.maximum(distance - 5.0 * math.pi / 2, 0.0)
    vertices = np.column_stack([mesh.vertices[:, :2] * across[:, None], down])
    surface = SensingSurface(TriangleMesh(vertices, mesh.faces), (0, 0, 1), (1, 0, 0), (0, 1, 0))
    azimuth = np.linspace(0.0, 6.0, 20)
    for polar in (1.0, math.pi / 2):
        out = np.stack([np.cos(azimuth), np.sin(azimuth)], axis=-1)
        normals = np.column_stack([-np.sin(polar) * out, np.full(20, -np.cos(polar))])
        first, second = surface.tangents(normals)
        meridian = np.column_stack([np.cos(polar) * out, np.full(20, -np.sin(polar))])
        np.testing.assert_allclose(first, meridian, atol=0.06)
        np.testing.assert_allclose(np.cross(normals, first), -second, atol=1e-9)


def test_off_the_edge_says_how_far_the_edge_is() -> None:
    surface = bent(8.0, ball=False)
    with pytest.raises(ContactError, match=r"\(12, 0\).*10\.00 mm"):
        surface.point_at(12, 0)


def test_nearest_is_the_foot_of_the_perpendicular() -> None:
    place = bent(8.0, ball=False).nearest((8, 1.0, 0))
    expected = np.array([math.sin(math.pi / 4) * 8, 1.0, 8 * (math.cos(math.pi / 4) - 1)])
    np.testing.assert_allclose(place.point, expected, atol=0.03)


def test_an_axis_square_to_the_surface_is_refused() -> None:
    mesh = TriangleMesh.grid((4, 4))
    with pytest.raises(ContactError, match="u axis"):
        SensingSurface(mesh, (0, 0, 0), (0, 0, 1), (0, 1, 0))


def test_nine_places_on_a_rectangle_are_the_middles_of_its_ninths() -> None:
    x, y = np.meshgrid(np.linspace(-9, 9, 91), np.linspace(-6, 6, 61), indexing="ij")
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    chosen = points[nine_places(points)]
    assert (points[nine_places([*points, (np.nan, 0.0, 0.0)])] == chosen).all()
    expected = np.array([(a, b, 0) for a in (-6, 0, 6) for b in (-4, 0, 4)])
    distance = np.linalg.norm(chosen[:, None] - expected, axis=2)
    assert (distance.min(axis=0) < 0.3).all()
    assert len(set(distance.argmin(axis=1))) == 9


def test_nine_places_share_the_area_even_where_points_crowd() -> None:
    """Points crowd on one side, as a camera's pixels do; weights are the areas they see."""
    rng = np.random.default_rng(3)
    s = rng.uniform(size=(20_000, 2))
    points = np.column_stack([18 * s[:, 0] ** 2, 12 * s[:, 1], 0 * s[:, 0]])
    places = nine_places(points, weights=s[:, 0])
    chosen = points[places]
    assert len(set(places.tolist())) == 9
    nearest = np.linalg.norm(points[:, None] - chosen, axis=2).argmin(axis=1)
    shares = np.bincount(nearest, s[:, 0], 9) / s[:, 0].sum()
    assert shares.max() < 1.25 / 9
    assert shares.min() > 0.75 / 9


def test_nine_places_need_nine_points() -> None:
    with pytest.raises(ContactError, match="only 4"):
        nine_places(np.zeros((4, 3)))


def test_rounding_does_not_choose_among_equally_near_points() -> None:
    """The middle of a picture with an even number of pixels lies between four of them."""
    x, y = np.meshgrid(np.linspace(-9, 9, 96), np.linspace(-6, 6, 72), indexing="ij")
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    exact = nine_places(points)
    np.testing.assert_allclose(points[exact[4]], [-9 / 95, -6 / 71, 0], atol=1e-9)
    rng = np.random.default_rng(8)
    for _ in range(10):
        rounded = points + 1e-6 * rng.standard_normal(points.shape)
        np.testing.assert_array_equal(nine_places(rounded), exact)

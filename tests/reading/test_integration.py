"""Depth from normals against surfaces whose depth is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from optisense.errors import TaskError
from optisense.reading.integration import GridIntegrator, NormalIntegrator
from optisense.reading.untouched import UntouchedSurface

SHAPE = 90, 120
PITCH = 0.05  # mm between pixels


def grid() -> tuple[np.ndarray, np.ndarray]:
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]].astype(float)
    return x - x.mean(), y - y.mean()


def integrated(mask: np.ndarray, slope_x: np.ndarray, slope_y: np.ndarray) -> np.ndarray:
    """Values from slopes a pixel: a step is the mean of the slopes at both its ends."""
    across, down = 0.5 * (slope_x[:, :-1] + slope_x[:, 1:]), 0.5 * (slope_y[:-1] + slope_y[1:])
    return GridIntegrator(mask).from_steps(across, down)


def test_a_quadratic_surface_comes_back_exactly() -> None:
    x, y = grid()
    surface = 0.3 * x - 0.2 * y + 0.01 * x**2 - 0.02 * x * y + 0.005 * y**2
    slope_x, slope_y = 0.3 + 0.02 * x - 0.02 * y, -0.2 - 0.02 * x + 0.01 * y
    got = integrated(np.ones(SHAPE, dtype=bool), slope_x, slope_y)
    assert got == pytest.approx(surface - surface.mean(), abs=1e-8)


def test_parts_of_a_mask_are_integrated_each_for_itself() -> None:
    x, y = grid()
    mask = (np.hypot(x - 30, y) < 20) | (np.hypot(x + 30, y) < 15)
    slope = np.where(mask, 0.1, np.nan)
    got = integrated(mask, slope, 2 * slope)
    assert np.isnan(got[~mask]).all()
    for side in (mask & (x > 0), mask & (x < 0)):
        expected = 0.1 * x[side] + 0.2 * y[side]
        assert got[side] == pytest.approx(expected - expected.mean(), abs=1e-8)


def test_slopes_that_fit_no_surface_give_the_nearest_one() -> None:
    # A swirl is square to every gradient: nothing of it is left in the values.
    x, y = grid()
    window = np.cos(np.pi * x / SHAPE[1]) ** 2 * np.cos(np.pi * y / SHAPE[0]) ** 2
    swirl_x, swirl_y = -np.gradient(window, axis=0), np.gradient(window, axis=1)
    got = integrated(np.ones(SHAPE, dtype=bool), swirl_x, swirl_y)
    assert np.abs(got).max() < 0.02 * np.abs(window).max()


def rays(pinhole: float, radius: float) -> UntouchedSurface:
    """A convex cylinder about y (or, with an infinite radius, a plane), apex at the origin, seen
    by a pinhole below its axis, through no refraction; +z is out of the sensor.
    """
    x, y = grid()
    eye = np.array([0.0, 0.0, -pinhole])
    way = np.stack([x * PITCH, y * PITCH, np.full(SHAPE, pinhole)], axis=-1)
    way /= np.linalg.norm(way, axis=2, keepdims=True)
    if np.isinf(radius):
        distance = -eye[2] / way[..., 2]
    else:
        # |(eye + distance way - centre)_xz| = radius
        away = eye[2] + radius
        a = way[..., 0] ** 2 + way[..., 2] ** 2
        b = away * way[..., 2]
        distance = (-b + np.sqrt(b * b - a * (away * away - radius * radius))) / a
    points = eye + distance[..., None] * way
    normals = np.zeros_like(points)
    normals[..., 0] = 0.0 if np.isinf(radius) else -points[..., 0] / radius
    normals[..., 2] = -np.sqrt(1 - normals[..., 0] ** 2)
    return UntouchedSurface(points, normals, way, np.ones(SHAPE, dtype=bool))


def pressed(
    untouched: UntouchedSurface, pinhole: float, radius: float, ball: float, deep: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Depths, normals and touched pixels of a ball in a surface of `rays`: each ray meets the ball
    or the surface first.
    """
    eye = np.array([0.0, 0.0, -pinhole])
    middle = np.array([0.3, -0.2, ball - deep])
    if np.isfinite(radius):
        middle[2] += np.sqrt(radius**2 - 0.3**2) - radius
    way = untouched.directions
    b = way @ (eye - middle)
    inside = b * b - ((eye - middle) ** 2).sum() + ball**2
    near = -b - np.sqrt(np.maximum(inside, 0))
    far = np.linalg.norm(untouched.points - eye, axis=2)
    touched = (inside > 0) & (near < far)
    points = np.where(touched[..., None], eye + near[..., None] * way, untouched.points)
    normals = np.where(touched[..., None], (points - middle) / ball, untouched.normals)
    return untouched.depth(points), normals, touched


@pytest.mark.parametrize("radius", [np.inf, 12.0], ids=["flat", "cylinder"])
@pytest.mark.parametrize("pinhole", [1e4, 8.0], ids=["orthographic", "pinhole"])
def test_a_pressed_ball_comes_back(radius: float, pinhole: float) -> None:
    untouched = rays(pinhole, radius)
    deep = 0.5
    expected, normals, touched = pressed(untouched, pinhole, radius, 1.5, deep)
    got = NormalIntegrator(untouched).depths(normals)
    # The rim, where the slope jumps between two pixels, costs less than half a step.
    assert expected.max() == pytest.approx(deep, abs=0.01)
    assert np.abs(got - expected).max() < 0.02
    assert np.abs(got - expected)[touched].mean() < 0.006


def test_each_part_of_the_view_is_level_at_its_own_border() -> None:
    """A strut in front of the camera divides the view beside the ball."""
    seen = np.ones(SHAPE, dtype=bool)
    seen[:, 20] = False
    untouched = replace(rays(1e4, np.inf), seen=seen)
    expected, normals, _ = pressed(untouched, 1e4, np.inf, 1.5, 0.5)
    got = NormalIntegrator(untouched).depths(normals)
    assert np.abs(got - expected)[seen].max() < 0.02


def test_nothing_beyond_the_border_of_the_view_is_read() -> None:
    """Untouched skin is level whatever stands in the pixels that miss it."""
    whole = rays(8.0, 12.0)
    x, y = grid()
    seen = (np.hypot(x, y) < 40) & (np.abs(x - 5) > 2)
    points = np.where(seen[..., None], whole.points, 0.0)
    untouched = UntouchedSurface(points, whole.normals, whole.directions, seen)
    assert np.abs(NormalIntegrator(untouched).depths(whole.normals)[seen]).max() < 1e-4


def test_depth_on_a_cylinder_is_the_distance_from_it() -> None:
    untouched = rays(8.0, 12.0)
    depth = np.linspace(-0.3, 1.0, SHAPE[1])[None, :]
    below = untouched.points + depth[..., None] * untouched.normals
    # Points under the picture's edge are nearest to what is not seen.
    assert untouched.depth(below)[5:-5, 5:-5] == pytest.approx(
        np.broadcast_to(depth, SHAPE)[5:-5, 5:-5], abs=1e-4
    )
    assert np.isnan(untouched.depth(np.full((2, 3), np.nan))).all()


def test_normals_that_give_no_depth_are_refused() -> None:
    """One NaN would spread over all pixels."""
    untouched = rays(8.0, np.inf)
    normals = untouched.normals.copy()
    normals[40, 50] = np.nan
    integrator = NormalIntegrator(untouched)
    with pytest.raises(TaskError, match="not finite"):
        integrator.depths(normals)
    with pytest.raises(TaskError, match="do not fit the rays"):
        integrator.depths(normals[:-1])

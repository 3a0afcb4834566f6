"""The windows of lamps as a camera sees them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from optisense.design.emitters import Intensity
from optisense.geometry import TriangleMesh
from optisense.optics.backend.sequences import sequence_4d
from optisense.optics.camera.projection import RayCamera
from optisense.optics.imaging._film import Film
from optisense.optics.scene._lamp_places import off_faces, window
from optisense.optics.scene.emitters import Emitter, EmitterShape, emit, emitter_table
from optisense.optics.scene.lamp_windows import LampWindows
from optisense.optics.scene.ray_scene import Piece, Ray, RayScene
from optisense.optics.scene.surfaces import RAY_OFFSET, Surface, SurfaceKind
from optisense.optics.transport.camera_paths import find_visible_points

DISTANCE = 20.0
"""Distance (mm) between lamp and camera."""
PIXELS = 256
"""Width and height of the image."""
FOV = 10.0
"""Field of view, degrees; the lamp fills two thirds of it."""
PHOTONS = 200_000
SHARE_ERROR = 0.002
"""Largest error of the share of a part: its largest share is 0.05, which the samples give with a
noise of 0.0005, and the inverse tables that photons are drawn from are linear between cells."""
LOPSIDED = Intensity(
    np.array([0.0, 20.0, 45.0, 80.0]),
    np.array([0.0, 90.0, 180.0, 270.0, 360.0]),
    np.array([[5, 6, 3, 0.2], [5, 2, 4, 0.5], [5, 7, 1, 0.1], [5, 3, 2, 1], [5, 6, 3, 0.2]]),
)
NOISE = 0.005
"""Relative error of an area that is counted in pixels, some 20,000 of them."""


def seen(lamps: list[Emitter], groups: int) -> np.ndarray:
    """Return the layers (groups, PIXELS, PIXELS) of the image of lamps at `DISTANCE`."""
    scene = RayScene([window(number, lamp) for number, lamp in enumerate(lamps)])
    camera = RayCamera((0, 0, 0), (0, 0, 1), (0, 1, 0), FOV, PIXELS, PIXELS)
    pixel = dr.arange(mi.UInt32, PIXELS * PIXELS)
    spots = mi.Point2f(pixel % PIXELS + 0.5, pixel // PIXELS + 0.5)
    points, _ = find_visible_points(
        scene, camera, pixel, dr.zeros(mi.UInt32, PIXELS * PIXELS), spots, 1, only_main=True
    )
    film = Film(PIXELS * PIXELS, groups)
    film.count(pixel)
    film.add_light(points, LampWindows.of(lamps))
    return film.layers(PIXELS, PIXELS)[..., 0]


@pytest.mark.parametrize("shape", [EmitterShape.RECTANGLE, EmitterShape.DISC])
@pytest.mark.parametrize("exponent", [1.0, 4.0])
@pytest.mark.parametrize("turned", [0.0, 0.6])
def test_a_window_sends_its_power_to_a_distant_camera(
    shape: EmitterShape, exponent: float, turned: float
) -> None:
    """A lamp of 1 mW with a profile cos^m has a radiant intensity of (m + 1) / (2 pi) cos^m
    mW/sr, and a radiance of that over its projected area; ``turned`` is the angle (radians) of its
    axis with the direction to the camera.
    """
    axis = (0.0, float(np.sin(turned)), -float(np.cos(turned)))
    lamp = Emitter(0, (0, 0, DISTANCE), axis, (1, 0, 0), shape, (2.4, 2.4), exponent)
    radiance = seen([lamp], 1)[0]
    side = 2 * np.tan(np.radians(FOV / 2)) / PIXELS
    intensity = (exponent + 1) / (2 * np.pi) * np.cos(turned) ** exponent
    assert radiance.sum() * side**2 * DISTANCE**2 == pytest.approx(intensity, rel=NOISE)
    middle = radiance[PIXELS // 2, PIXELS // 2]
    assert middle * lamp.area * np.cos(turned) == pytest.approx(intensity, rel=NOISE)


def test_lights_of_several_groups_at_one_place_are_all_seen() -> None:
    """The red and the blue die of an LED share a window; a third lamp has its own beside it."""
    shape, size = EmitterShape.RECTANGLE, (0.8, 0.8)
    red = Emitter(0, (0, 0, DISTANCE), (0, 0, -1), (1, 0, 0), shape, size)
    blue = replace(red, group=1, direction=(0, 0, -2), exponent=3.0)
    alone = replace(red, group=2, position=(1, 0, DISTANCE))
    together = seen([red, alone, blue], 3)
    for layer, lamp in zip(together, (red, blue, alone), strict=True):
        assert np.array_equal(layer, seen([replace(lamp, group=0)], 1)[0]) and layer.any()


RED = Emitter(
    0, (0.49999949, 0, DISTANCE), (0, 0, -1), (1, 0, 0), EmitterShape.RECTANGLE, (0.8, 0.4)
)


@pytest.mark.parametrize(
    ("one", "changes", "together"),
    [
        (RED, {"position": (0.49999951, 0, DISTANCE)}, True),  # equal to the rounding of files
        (RED, {"position": (0.5001, 0, DISTANCE)}, False),
        (RED, {"up": (-1, 0, 0)}, True),
        (RED, {"up": (0, 1, 0), "size": (0.4, 0.8)}, True),
        (RED, {"up": (0, 1, 0)}, False),
        (RED, {"direction": (0, 0, 1)}, False),
        (replace(RED, shape=EmitterShape.DISC, size=(0.8, 0.8)), {"up": (1, 2, 0)}, True),
        (replace(RED, shape=EmitterShape.DISC, size=(0.8, 0.8)), {"size": (0.7, 0.7)}, False),
    ],
)
def test_windows_are_one_if_they_cover_the_same_area(
    one: Emitter, changes: dict[str, Any], together: bool
) -> None:
    far = replace(one, position=(9, 0, DISTANCE))
    after = LampWindows.of([one, far, replace(one, **changes)]).after
    assert (after is not None) == together
    assert after is None or np.asarray(after).tolist() == [0, 3, 2, 1]


def test_kernels_do_not_depend_on_the_number_of_lights_in_a_window() -> None:
    found = []
    for count in (2, 5):
        lamps = [replace(RED, group=number % 2) for number in range(count)]
        with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
            dr.kernel_history_clear()
            seen(lamps, 2)
            found.append({each["hash"] for each in dr.kernel_history([dr.KernelType.JIT])})
    assert found[0] == found[1]


@pytest.mark.parametrize(
    ("gap", "first"), [(0.05, "wall"), (1e-4, "light 0"), (0.0, "light 0"), (-0.05, "light 0")]
)
def test_rays_meet_a_window_on_a_face_before_the_face(gap: float, first: str) -> None:
    """A light ``gap`` in front of the wall of a box shines into it; photons start beyond the wall
    if the gap is narrower than `RAY_OFFSET`. Another light faces away from the box.
    """
    box = TriangleMesh.box((-5, -5, -5), (5, 5, 5))
    pieces = [Piece("wall", box.vertices, box.faces, Surface(SurfaceKind.DIELECTRIC, eta=1.4))]
    lamp = Emitter(0, (-5 - gap, 1, 0.5), (1, 0, 0), None, EmitterShape.RECTANGLE, (1.0, 1.0))
    away = replace(lamp, position=(5.01, 1, 0.5))
    lamps = off_faces([lamp, away], pieces)
    assert lamps[1] is away and (lamps[0] is lamp) == (abs(gap) > RAY_OFFSET)
    pieces += [window(number, each) for number, each in enumerate(lamps)]
    hit = RayScene(pieces).intersect(
        Ray(mi.Point3f(0, 1, 0.5), mi.Vector3f(-1, 0, 0), mi.Bool(True))
    )
    assert pieces[int(hit.surface[0])].name == first


def test_a_tabulated_window_shows_the_light_that_photons_carry_away() -> None:
    """Shares of the power in 48 parts of the hemisphere: of drawn photons, and of the radiance
    times the projected area. A second lamp has another profile and another group.
    """
    size = (2.0, 0.5)
    first = Emitter(1, (0, 0, 0), (0, 0, 1), (0, 1, 0), EmitterShape.RECTANGLE, size)
    lamp = Emitter(
        2, (1, 2, 3), (0.2, 0.1, 1), (0, 1, 0.3), EmitterShape.RECTANGLE, size, intensity=LOPSIDED
    )
    table = emitter_table([first, lamp], 3)
    u = sequence_4d(dr.arange(mi.UInt32, PHOTONS), mi.UInt32(1), mi.UInt32(1))
    places = mi.Point2f(u[0], u[1]), mi.Point2f(u[2], u[3])
    ways = emit(table, mi.UInt32(1), *places)[1]
    width, height, axis = lamp.frame
    polar, turn = (np.arange(600) + 0.5) * np.pi / 1200, (np.arange(720) + 0.5) * np.pi / 360
    theta, phi = (each.ravel() for each in np.meshgrid(polar, turn, indexing="ij"))
    sine = np.sin(theta)
    grid = np.stack([sine * np.cos(phi), sine * np.sin(phi), np.cos(theta)]).T @ lamp.frame
    radiance, group, lit = LampWindows.of([first, lamp]).radiance(mi.UInt32(2), mi.Vector3f(grid.T))
    assert np.all(np.asarray(lit)) and np.all(np.asarray(group) == 2)
    power = np.asarray(radiance) * np.cos(theta) * lamp.area * sine
    power *= (np.pi / 1200) * (np.pi / 360)

    def shares(directions: np.ndarray, weights: np.ndarray) -> np.ndarray:
        x, y, z = directions @ width, directions @ height, directions @ axis
        limits = [np.linspace(0, np.pi / 2, 7), np.linspace(-np.pi, np.pi, 9)]
        return np.histogram2d(np.arccos(z), np.arctan2(y, x), limits, weights=weights)[0]

    drawn = shares(np.asarray(ways).T, np.full(PHOTONS, 1 / PHOTONS))
    assert drawn == pytest.approx(shares(grid, power), abs=SHARE_ERROR)
    assert power.sum() == pytest.approx(1.0, abs=SHARE_ERROR)

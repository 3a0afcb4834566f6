"""The windows of lamps as a camera sees them."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from optisense.optics.camera.projection import RayCamera
from optisense.optics.imaging._film import Film
from optisense.optics.scene.assembly import window
from optisense.optics.scene.emitters import Emitter, EmitterShape
from optisense.optics.scene.ray_scene import RayScene
from optisense.optics.transport.camera_paths import find_visible_points

DISTANCE = 20.0
"""Distance (mm) between lamp and camera."""
PIXELS = 256
"""Width and height of the image."""
FOV = 10.0
"""Field of view, degrees; the lamp fills two thirds of it."""
NOISE = 0.005
"""Relative error of an area that is counted in pixels, some 20,000 of them."""


@pytest.mark.parametrize("shape", [EmitterShape.RECTANGLE, EmitterShape.DISC])
def test_a_window_sends_its_power_to_a_distant_camera(shape: EmitterShape) -> None:
    """A Lambertian lamp of 1 mW has a radiant intensity of 1/pi mW/sr along its axis."""
    lamp = Emitter(0, (0, 0, DISTANCE), (0, 0, -1), (0, 1, 0), shape, (2.4, 2.4))
    scene = RayScene([window(0, lamp)])
    camera = RayCamera((0, 0, 0), (0, 0, 1), (0, 1, 0), FOV, PIXELS, PIXELS)
    pixel = dr.arange(mi.UInt32, PIXELS * PIXELS)
    spots = mi.Point2f(pixel % PIXELS + 0.5, pixel // PIXELS + 0.5)
    points, _ = find_visible_points(
        scene, camera, pixel, dr.zeros(mi.UInt32, PIXELS * PIXELS), spots, 1, only_main=True
    )
    film = Film(PIXELS * PIXELS, 1)
    film.count(pixel)
    film.add_light(points, [lamp])
    radiance = film.layers(PIXELS, PIXELS)[0, ..., 0]
    side = 2 * np.tan(np.radians(FOV / 2)) / PIXELS
    assert radiance.sum() * side**2 * DISTANCE**2 == pytest.approx(1 / np.pi, rel=NOISE)

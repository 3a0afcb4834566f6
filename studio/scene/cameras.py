"""The sensor's camera as a Blender camera."""

from __future__ import annotations

import json
import math
from typing import Any

import bpy
import numpy as np

from ..core.errors import SceneError
from ..core.numbers import kept
from ..core.pose import pose_of
from .collections import OPTICAL_SYSTEM, collection, objects_of
from .lamps import place
from .world import world_matrix

DRAWN_SIZE = 5.0
"""Drawn size of the camera's pyramid, mm."""

VIEW = ("model", "projection", "fov", "resolution")
POSE = ("position", "direction", "up")
"""Fields of a camera that Blender's properties and the object's pose hold."""

FACTS = ("pixel_size", "focal_length", "f_number")
"""Fields of a library camera that are not part of designs."""

WIDEST_DRAWN = 170.0
"""Largest field of view in degrees that a frustum is drawn with, as Blender's pinhole cameras have
less than 180.
"""


def add_camera(scene: bpy.types.Scene, values: dict[str, Any]) -> bpy.types.Object:
    """Add an object for the design's camera; it becomes the camera of the scene."""
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    own = camera.optisense
    own.data = json.dumps(values)
    own.kind = "CAMERA"
    own.key = "camera"
    own.model = values["model"]
    own.projection = values.get("projection", "perspective")
    own.fov = values["fov"]
    own.pixels = values["resolution"]
    place(camera, values)
    camera.lock_scale = (True, True, True)
    camera.data.display_size = DRAWN_SIZE
    camera.data.clip_start = 0.01
    camera.show_in_front = True  # a housing would hide it
    collection(scene, OPTICAL_SYSTEM).objects.link(camera)
    show(camera)
    scene.camera = camera
    return camera


def show(camera: bpy.types.Object) -> None:
    """Adapt Blender's camera to the sensor's, as far as a pinhole camera can."""
    if not isinstance(camera.data, bpy.types.Camera):
        return
    values = camera.optisense
    camera.data.sensor_fit = "HORIZONTAL"
    camera.data.angle = math.radians(min(values.fov, WIDEST_DRAWN))
    for scene in camera.users_scene:
        scene.render.resolution_x, scene.render.resolution_y = values.pixels


def camera_values(scene: bpy.types.Scene) -> dict[str, Any] | None:
    """Return the camera as for the design file; None if there is no camera.

    Raises:
        SceneError: there is more than one camera.
    """
    cameras = objects_of(scene, "CAMERA")
    if not cameras:
        return None
    if len(cameras) > 1:
        raise SceneError(f"the sensor has {len(cameras)} cameras; delete all but one", "camera")
    camera = cameras[0]
    values = camera.optisense
    before = json.loads(values.data) if values.data else {}
    try:
        pose = pose_of(np.array(world_matrix(camera)), before, up=True)
    except ValueError as error:
        raise SceneError(f"the camera {error}", "camera") from error
    return {
        "model": values.model,
        "projection": values.projection,
        "fov": kept(before.get("fov"), values.fov),
        "resolution": list(values.pixels),
        **{name: pose[name] for name in POSE},
        **imaging(before),
    }


def imaging(values: dict[str, Any]) -> dict[str, Any]:
    """Return the fields of a camera besides view and pose: lens, image sensor and processing."""
    others = (*VIEW, *POSE, *FACTS)
    return {name: value for name, value in values.items() if name not in others and value}

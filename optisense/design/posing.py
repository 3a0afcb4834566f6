"""Designs with moved lights, or with a turned camera."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from optisense.array_types import FloatArray
from optisense.design.lights import Light
from optisense.design.sensor_design import SensorDesign
from optisense.geometry.rotations import rotation

UNTURNED: FloatArray = np.eye(3)
"""Rotation matrix that turns nothing."""


def with_lights(
    design: SensorDesign, group: str, change: Callable[[Light], Light], only: int | None = None
) -> SensorDesign:
    """Return a design in which the lights of a group, or `only` the one of a number, are changed by
    a function that returns a light in its new pose.
    """
    own = design.lights[group]
    lights = [
        change(light) if only in (None, number) else light
        for number, light in enumerate(own.lights)
    ]
    changed = own.model_copy(update={"lights": lights})
    return design.model_copy(update={"lights": {**design.lights, group: changed}})


def moved(light: Light, shift: FloatArray, turn: FloatArray = UNTURNED) -> Light:
    """Return a light turned about the origin by a matrix (3, 3), and then shifted by (3,), mm."""
    return light.model_copy(
        update={
            "position": triple(turn @ np.array(light.position) + shift),
            "direction": triple(turn @ np.array(light.direction)),
            "up": None if light.up is None else triple(turn @ np.array(light.up)),
        }
    )


def with_camera_turned(axis: int, design: SensorDesign, angle: float) -> SensorDesign:
    """Return a design whose camera is turned by `angle` degrees about one of its axes: upwards
    about its right (0), to the left about its top (1) or clockwise about its viewing direction (2).
    """
    turn = rotation(design.camera.axes()[axis], angle)
    camera = design.camera.model_copy(
        update={
            "direction": triple(turn @ np.array(design.camera.direction)),
            "up": triple(turn @ np.array(design.camera.up)),
        }
    )
    return design.model_copy(update={"camera": camera})


def triple(vector: FloatArray) -> tuple[float, float, float]:
    """Return the numbers of a vector (3,) as a design holds them."""
    x, y, z = vector.tolist()
    return x, y, z

"""Changes of a sensor's camera that a calibration tries: its place and its lens.

Each function returns a changed design; the given one is not changed.
"""

from __future__ import annotations

import numpy as np

from optisense.design import SensorDesign, set_value


def with_camera_moved(axis: int, design: SensorDesign, amount: float) -> SensorDesign:
    """Return a design whose camera is moved by `amount` mm along one of its axes: to the picture's
    right (0), to its top (1) or ahead (2).
    """
    moved = np.array(design.camera.position) + amount * design.camera.axes()[axis]
    return set_value(design, "camera.position", tuple(moved.tolist()))


def with_distortion(design: SensorDesign, k1: float) -> SensorDesign:
    """Return a design with another first coefficient of its lens's radial distortion."""
    own = design.camera.distortion
    if own is not None:
        return set_value(design, "camera.distortion.k1", k1)
    fisheye = design.camera.projection == "equidistant"
    kind = "kannala-brandt" if fisheye else "brown-conrady"
    return set_value(design, "camera.distortion", {"kind": kind, "k1": k1})

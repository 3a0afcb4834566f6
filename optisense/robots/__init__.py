"""Export to robot simulators: a sensor as a rigid body with meshes, mass, and frames of its camera
and its skin. Lengths are in metres there, and masses in kilograms.
"""

from optisense.robots._body import Frame, SensorBody, Skin, sensor_body
from optisense.robots.formats import ROBOT_FORMATS, RobotFormat, export_robot

__all__ = [
    "ROBOT_FORMATS",
    "Frame",
    "RobotFormat",
    "SensorBody",
    "Skin",
    "export_robot",
    "sensor_body",
]

"""Sensor designs: their parts, the file format, and dotted paths to every value in them.

A design is a folder with `design.yaml` and `meshes/`. This package does not render.
"""

from optisense.design.addressing import get_value, parse_path, set_value, set_values
from optisense.design.cage import Cage, Point, Share
from optisense.design.cage_checks import cage_problems
from optisense.design.cage_edit import (
    add_cage,
    move_points,
    refine_cage,
    remove_cage,
    set_range,
    settle_cage,
)
from optisense.design.camera import Camera
from optisense.design.check import check_design
from optisense.design.emitters import AreaEmitter, IesEmitter, LightModel, SpotEmitter
from optisense.design.lights import Light, LightGroup
from optisense.design.markers import Markers
from optisense.design.materials import (
    Absorber,
    Coating,
    Conductor,
    Dielectric,
    Diffuse,
    Material,
)
from optisense.design.parts import FaceFinish, Part, Role
from optisense.design.problems import Diagnostic
from optisense.design.sensor_design import Provenance, SensorDesign, Status
from optisense.design.storage import load_design, save_design

__all__ = [
    "Absorber",
    "AreaEmitter",
    "Cage",
    "Camera",
    "Coating",
    "Conductor",
    "Diagnostic",
    "Dielectric",
    "Diffuse",
    "FaceFinish",
    "IesEmitter",
    "Light",
    "LightGroup",
    "LightModel",
    "Markers",
    "Material",
    "Part",
    "Point",
    "Provenance",
    "Role",
    "SensorDesign",
    "Share",
    "SpotEmitter",
    "Status",
    "add_cage",
    "cage_problems",
    "check_design",
    "get_value",
    "load_design",
    "move_points",
    "parse_path",
    "refine_cage",
    "remove_cage",
    "save_design",
    "set_range",
    "set_value",
    "set_values",
    "settle_cage",
]

"""OptiSense Studio: simulate and design camera-based tactile sensors.

Lengths are in mm, angles in degrees, powers in mW. Names load on first use, so that the import of
the package neither loads the renderer nor needs libLLVM.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from optisense.lazy_names import load_on_first_use

if TYPE_CHECKING:
    from optisense import search
    from optisense.design import SensorDesign, get_value, load_design, set_value
    from optisense.geometry import Contact, Cylinder, MeshIndenter, Plane, Sphere
    from optisense.objectives import Score, evaluate, objective
    from optisense.optics import OpticalModel
    from optisense.search import SearchSpace
    from optisense.sensors import check, load, save_design
    from optisense.version import __version__

__all__ = [
    "Contact",
    "Cylinder",
    "MeshIndenter",
    "OpticalModel",
    "Plane",
    "Score",
    "SearchSpace",
    "SensorDesign",
    "Sphere",
    "__version__",
    "check",
    "evaluate",
    "get_value",
    "load",
    "load_design",
    "objective",
    "save_design",
    "search",
    "set_value",
]

if not TYPE_CHECKING:  # type checkers would take any name for one of the package's
    __getattr__, __dir__ = load_on_first_use(__name__, __file__)

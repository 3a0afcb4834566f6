"""OptiSense Studio: simulate and design camera-based tactile sensors.

Lengths are in mm, angles in degrees, powers in mW. Names load on first use, so that importing
the package neither loads the renderer nor needs libLLVM.
"""

from __future__ import annotations

from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from optisense.design import SensorDesign, get_value, load_design, set_value
    from optisense.geometry import Contact, Cylinder, MeshIndenter, Plane, Sphere
    from optisense.objectives import Score, evaluate, objective
    from optisense.optics import OpticalModel
    from optisense.search import SearchSpace, search
    from optisense.sensors import check, load, save_design

_HOMES = {
    "Contact": "optisense.geometry",
    "Cylinder": "optisense.geometry",
    "MeshIndenter": "optisense.geometry",
    "OpticalModel": "optisense.optics",
    "Plane": "optisense.geometry",
    "Score": "optisense.objectives",
    "SearchSpace": "optisense.search",
    "SensorDesign": "optisense.design",
    "Sphere": "optisense.geometry",
    "check": "optisense.sensors",
    "evaluate": "optisense.objectives",
    "get_value": "optisense.design",
    "load": "optisense.sensors",
    "load_design": "optisense.design",
    "objective": "optisense.objectives",
    "save_design": "optisense.sensors",
    "set_value": "optisense.design",
}

try:
    __version__ = version("optisense")
except PackageNotFoundError:  # running from a source folder that is not installed
    __version__ = "0+unknown"

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


def __getattr__(name: str) -> object:
    """Import a public name on first use (PEP 562)."""
    if name == "search":  # a package that can be called: see there
        return import_module("optisense.search")
    if name not in _HOMES:
        raise AttributeError(f"module 'optisense' has no attribute {name!r}")
    value: object = getattr(import_module(_HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)

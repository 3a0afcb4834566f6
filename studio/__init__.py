"""OptiSense Studio in Blender: the sensor bench.

The extension holds no optics. It shows a sensor design as objects, lets the user edit it, and asks
the engine, a child process, for everything that takes light: pictures, scores, searches. It
imports bpy, numpy and the standard library only.
"""

from __future__ import annotations

from . import engine, scene, sensor, simulate  # noqa: F401  (the packages hold the modules below)
from .engine import catalogue, preferences, session, starting
from .scene import cages, object_properties, properties
from .sensor import operator as sensor_operator
from .sensor import ui as sensor_ui
from .simulate import drafts, picture, relight
from .simulate import operator as simulate_operator
from .simulate import prop as simulate_prop
from .simulate import ui as simulate_ui

MODULES = (
    preferences,
    session,
    catalogue,
    properties,
    object_properties,
    cages,
    picture,
    simulate_prop,
    relight,
    drafts,
    sensor_operator,
    simulate_operator,
    sensor_ui,
    simulate_ui,
    starting,
)


def register() -> None:
    """Add everything to Blender."""
    for each in MODULES:
        each.register()


def unregister() -> None:
    """Take everything out of Blender again, and end the engine."""
    for each in reversed(MODULES):
        each.unregister()

"""A sensor as a model of MuJoCo (MJCF): one body, its camera, its sites and a touch sensor."""

from __future__ import annotations

from collections.abc import Iterable
from xml.etree.ElementTree import Element, SubElement, indent, tostring

import numpy as np

from optisense.robots._body import SensorBody

LEAST_HALF_SIDE = 5e-4
"""Half of the smallest side (m) of the box in which the touch sensor counts contacts, which is 1
mm: objects rest on the skin with their contacts up to some tenths of a millimetre off it."""


SENSOR_HEIGHT = 1e-3
"""Height (m) of the image sensor to which the focal length refers where the camera's axis is off
the middle of the picture: only their ratio counts."""


def mjcf(body: SensorBody, folder: str) -> str:
    """Return the text of an MJCF file with its mesh files (binary STL, m) in a folder beside it."""
    model = Element("mujoco", model=body.name)
    child(model, "compiler", angle="radian", meshdir=folder)
    asset = child(model, "asset")
    for each in [*body.looks, *body.hulls]:
        # A sheet has no volume, of which MuJoCo would otherwise compute the inertia.
        shell = {} if each.is_closed else {"inertia": "shell"}
        child(asset, "mesh", name=each.name, file=f"{each.name}.stl", **shell)
    sensor = child(child(model, "worldbody"), "body", name=body.name)
    inertia = numbers(body.inertia[i, j] for i, j in _UPPER)
    at = {"pos": numbers(body.centre), "mass": f"{body.mass:.9g}", "fullinertia": inertia}
    child(sensor, "inertial", **at)
    for each in body.looks:
        shown = {"group": "2", "contype": "0", "conaffinity": "0", "mass": "0"}
        colour = numbers(each.colour)
        child(sensor, "geom", type="mesh", mesh=each.name, **shown, rgba=colour)
    for each in body.hulls:
        # Of two geoms, the one of higher priority gives the friction; else, the larger counts.
        gel = {"friction": f"{body.friction:g} 0.005 0.0001", "priority": "1"}
        touched = {"group": "3", "mass": "0", **(gel if each.is_gel else {})}
        child(sensor, "geom", name=each.name, type="mesh", mesh=each.name, **touched)
    right, down, _ = body.camera.axes.T
    width, height = body.resolution
    pose = {"pos": numbers(body.camera.origin), "xyaxes": numbers((*right, *-down))}
    size = {"resolution": f"{width} {height}"}
    child(sensor, "camera", name="camera", **pose, **_view(body), **size)
    sensors = child(model, "sensor")
    for skin in body.skins:
        frame, (middle, half) = skin.frame, skin.box
        axes = numbers((*frame.axes[:, 0], *frame.axes[:, 1]))
        pose = {"pos": numbers(frame.origin), "xyaxes": axes}
        child(sensor, "site", name=f"skin{skin.suffix}", **pose, size="0.0005", group="4")
        pose = {"pos": numbers(frame.origin + frame.axes @ middle), "xyaxes": axes}
        box = numbers(half + LEAST_HALF_SIDE)
        touched = {"type": "box", **pose, "size": box, "group": "4", "rgba": "0 0 0 0"}
        site = f"touched{skin.suffix}"
        child(sensor, "site", name=site, **touched)
        child(sensors, "touch", name=f"normal_force{skin.suffix}", site=site)
    return xml_text(model)


def _view(body: SensorBody) -> dict[str, str]:
    """Return the attributes of the camera's angle of view, and of its axis if it is off the middle.

    MuJoCo's `principal` is the place of the picture's middle from the axis, to the right and down.
    """
    width, height = body.resolution
    across, down = body.camera_middle
    if across == down == 0.5:
        return {"fovy": f"{body.camera_angle:.9g}"}
    size = SENSOR_HEIGHT * np.array([width / height, 1.0])
    focal = 0.5 * SENSOR_HEIGHT / np.tan(np.radians(0.5 * body.camera_angle))
    principal = size * (0.5 - np.array([across, down]))
    values: dict[str, Iterable[float]] = {
        "sensorsize": size,
        "focal": (focal, focal),
        "principal": principal,
    }
    return {name: numbers(value) for name, value in values.items()}


_UPPER = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
"""Rows and columns of the elements of a symmetric matrix in the order of MJCF's `fullinertia`."""


def numbers(values: Iterable[float]) -> str:
    """Return numbers with nine digits, separated by spaces; tiny ones that are rounding are 0."""
    return " ".join(f"{0.0 if abs(value) < 1e-15 else value:.9g}" for value in values)


def child(parent: Element, tag: str, **attributes: str) -> Element:
    """Return a new element in another one."""
    return SubElement(parent, tag, attributes)


def xml_text(root: Element) -> str:
    """Return the text of an XML file with indented elements."""
    indent(root)
    return tostring(root, encoding="unicode") + "\n"

"""A sensor as a model of MuJoCo (MJCF): one body, its camera, its sites and a touch sensor."""

from __future__ import annotations

from collections.abc import Iterable
from xml.sax.saxutils import quoteattr

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
    lines = [f"<mujoco model={quoteattr(body.name)}>"]
    lines.append(f'  <compiler angle="radian" meshdir={quoteattr(folder)}/>')
    lines.append("  <asset>")
    for each in [*body.looks, *body.hulls]:
        # A sheet has no volume, of which MuJoCo would otherwise compute the inertia.
        shell = "" if each.is_closed else ' inertia="shell"'
        lines.append(
            f"    <mesh name={quoteattr(each.name)} file={quoteattr(each.name + '.stl')}{shell}/>"
        )
    lines += ["  </asset>", "  <worldbody>", f"    <body name={quoteattr(body.name)}>"]
    xx, yy, zz, xy, xz, yz = (body.inertia[i, j] for i, j in _UPPER)
    lines.append(
        f'      <inertial pos="{numbers(body.centre)}" mass="{body.mass:.9g}" '
        f'fullinertia="{numbers((xx, yy, zz, xy, xz, yz))}"/>'
    )
    for each in body.looks:
        lines.append(
            f'      <geom type="mesh" mesh={quoteattr(each.name)} group="2" contype="0" '
            f'conaffinity="0" mass="0" rgba="{numbers(each.colour)}"/>'
        )
    for each in body.hulls:
        friction = ""
        if each.is_gel:
            # Of two geoms, the one of higher priority gives the friction; else, the larger counts.
            friction = f' friction="{body.friction:g} 0.005 0.0001" priority="1"'
        lines.append(
            f'      <geom name={quoteattr(each.name)} type="mesh" mesh={quoteattr(each.name)} '
            f'group="3" mass="0"{friction}/>'
        )
    right, down, _ = body.camera.axes.T
    width, height = body.resolution
    lines.append(
        f'      <camera name="camera" pos="{numbers(body.camera.origin)}" '
        f'xyaxes="{numbers((*right, *-down))}" {_view(body)} resolution="{width} {height}"/>'
    )
    skin, (middle, half) = body.skin, body.skin_box
    axes = numbers((*skin.axes[:, 0], *skin.axes[:, 1]))
    lines.append(
        f'      <site name="skin" pos="{numbers(skin.origin)}" xyaxes="{axes}" '
        'size="0.0005" group="4"/>'
    )
    box = np.maximum(half + LEAST_HALF_SIDE, LEAST_HALF_SIDE)
    lines.append(
        f'      <site name="touched" type="box" pos="{numbers(skin.origin + skin.axes @ middle)}" '
        f'xyaxes="{axes}" size="{numbers(box)}" group="4" rgba="0 0 0 0"/>'
    )
    lines += ["    </body>", "  </worldbody>", "  <sensor>"]
    lines.append('    <touch name="normal_force" site="touched"/>')
    lines += ["  </sensor>", "</mujoco>"]
    return "\n".join(lines) + "\n"


def _view(body: SensorBody) -> str:
    """Return the attributes of the camera's angle of view, and of its axis if it is off the middle.

    MuJoCo's `principal` is the place of the picture's middle from the axis, to the right and down.
    """
    width, height = body.resolution
    across, down = body.camera_middle
    if across == down == 0.5:
        return f'fovy="{body.camera_angle:.9g}"'
    size = SENSOR_HEIGHT * np.array([width / height, 1.0])
    focal = 0.5 * SENSOR_HEIGHT / np.tan(np.radians(0.5 * body.camera_angle))
    principal = size * (0.5 - np.array([across, down]))
    return (
        f'sensorsize="{numbers(size)}" focal="{numbers((focal, focal))}" '
        f'principal="{numbers(principal)}"'
    )


_UPPER = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
"""Rows and columns of the elements of a symmetric matrix in the order of MJCF's `fullinertia`."""


def numbers(values: Iterable[float]) -> str:
    """Return numbers with nine digits, separated by spaces; tiny ones that are rounding are 0."""
    return " ".join(f"{0.0 if abs(value) < 1e-15 else value:.9g}" for value in values)

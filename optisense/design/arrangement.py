"""How parts stand to each other, and where the picture is: solids in one place, straight rays."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from optisense.design.camera import Camera
from optisense.design.parts import TRANSPARENT_SOLIDS
from optisense.design.problems import Diagnostic
from optisense.design.sensor_design import SensorDesign
from optisense.geometry import TriangleMesh
from optisense.geometry.common_space import common_space
from optisense.geometry.meeting import CONTACT

EQUAL_INDEX = 1e-6
"""Solids whose refractive indices differ by less are one to the light."""

SAMPLES = (8, 6)
"""So many places across and down the picture are tried for the sensing surface."""


def overlaps(design: SensorDesign, meshes: dict[str, TriangleMesh]) -> list[Diagnostic]:
    """Solids of different index that share space without a priority that says which one counts.

    Args:
        meshes: the deformed meshes, mm.
    """
    problems: list[Diagnostic] = []
    solids = [n for n in meshes if design.parts[n].role in TRANSPARENT_SOLIDS]
    for name, other in combinations(solids, 2):
        parts = design.parts[name], design.parts[other]
        one, two = (getattr(design.materials[p.material or ""], "ior", None) for p in parts)
        if parts[0].priority != parts[1].priority or one is None or two is None:
            continue
        if abs(one - two) <= EQUAL_INDEX:
            continue
        place = common_space(meshes[name], meshes[other], CONTACT)
        if place is not None:
            problems.append(
                Diagnostic(
                    f"parts '{name}' and '{other}' overlap near "
                    "({:.2f}, {:.2f}, {:.2f}) mm".format(*place)
                    + f" and have the same priority {parts[0].priority}",
                    design.where("parts", other, "priority"),
                    "Move them apart, or give the part that fills the common space the larger "
                    "priority",
                )
            )
    return problems


def in_picture(camera: Camera, points: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(n,) whether points lie in the picture, seen straight."""
    right, up, depth = camera.axes() @ (points - np.array(camera.position)).T
    aside = np.hypot(right, up)
    angle = np.arctan2(aside, depth)
    half = np.radians(0.5 * camera.fov)
    if camera.projection == "equidistant":
        height, edge = angle, half
    else:
        height = np.where(depth > 0.0, np.tan(np.minimum(angle, 1.57)), np.inf)
        edge = float(np.tan(half))
    scale = height / np.maximum(aside, 1e-300)
    tall = edge * camera.resolution[1] / camera.resolution[0]
    with np.errstate(invalid="ignore"):  # on the axis of what is behind: infinity times zero
        inside: NDArray[np.bool_] = (np.abs(right * scale) <= edge) & (np.abs(up * scale) <= tall)
    return inside


def straight_rays(camera: Camera) -> NDArray[np.float64]:
    """(k, 3) the directions of some places spread over the picture."""
    half = np.radians(0.5 * camera.fov)
    edge = half if camera.projection == "equidistant" else float(np.tan(half))
    tall = edge * camera.resolution[1] / camera.resolution[0]
    x, y = np.meshgrid(np.linspace(-edge, edge, SAMPLES[0]), np.linspace(-tall, tall, SAMPLES[1]))
    height = np.hypot(x, y)
    angle = height if camera.projection == "equidistant" else np.arctan(height)
    across = np.sin(angle) / np.maximum(height, 1e-300)
    axes = np.stack([x * across, y * across, np.cos(angle)], axis=-1).reshape(-1, 3)
    rays: NDArray[np.float64] = axes @ camera.axes()
    return rays

"""Sizes that a tactile sensor can have; others come from wrong units."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from optisense.design.fields import Steps
from optisense.design.problems import Diagnostic
from optisense.design.sensor_design import Meshes, SensorDesign
from optisense.errors import DesignError

LARGEST = 1000.0
"""Largest size of a part, and largest distance of a light or camera from the origin, mm; larger
numbers come from a wrong unit."""

PLACE_HINT = "Give positions in millimetres"
"""Remedy for places that are too far away."""

SMALLEST = 0.5
"""Smallest size of a part in its largest dimension, mm; thin parts are larger in the others."""


def unit_slips(design: SensorDesign, meshes: Meshes) -> list[Diagnostic]:
    """Return problems of parts, lights and camera whose sizes or distances suggest another unit."""
    problems: list[Diagnostic] = []
    for name, mesh in meshes.items():
        place = design.where("parts", name, "mesh")
        extent = float(np.ptp(mesh.bounds, axis=0).max())
        far = float(np.abs(mesh.bounds).max())
        if extent > LARGEST or far > 2.0 * LARGEST:
            size = f"{extent:.6g} mm large" if extent > LARGEST else f"{far:.6g} mm from the origin"
            problems.append(
                Diagnostic(
                    f"part '{name}' is {size}: looks like micrometres or another smaller unit",
                    place,
                    f"Scale the mesh to millimetres; a sensor is smaller than {LARGEST:g} mm",
                )
            )
        elif extent < SMALLEST:
            problems.append(
                Diagnostic(
                    f"part '{name}' is only {extent:.3g} mm large: looks like metres or inches",
                    place,
                    "Scale the mesh to millimetres (metres times 1000)",
                )
            )
    for cage_name, cage in design.cages.items():
        far = float(np.abs(cage.current_points()).max())
        if far > 2.0 * LARGEST:
            problems.append(
                Diagnostic(
                    f"cage '{cage_name}' has a control point {far:.6g} mm from the origin",
                    design.where("cages", cage_name, "points"),
                    "Give control points in millimetres",
                )
            )
    for label, position, path in placed_things(design):
        slip = place_slip(position)
        if slip is not None:
            problems.append(Diagnostic(f"{label} {slip}", design.where(*path), PLACE_HINT))
    return problems


def refuse_far(label: str, position: ArrayLike) -> None:
    """Raise DesignError if a light or camera, named by `label`, is at a place (3,), mm, farther
    from the origin than `LARGEST`, or not finite.
    """
    slip = place_slip(position)
    if slip is not None:
        raise DesignError(f"{label} {slip}", hint=PLACE_HINT)


def place_slip(position: ArrayLike) -> str | None:
    """Return a text that says how a light or camera at (3,), mm, is too far away, or None."""
    distance = float(np.linalg.norm(position))
    if distance <= LARGEST:
        return None
    return f"is {distance:.6g} mm from the origin: is its position in millimetres?"


def placed_things(
    design: SensorDesign,
) -> list[tuple[str, tuple[float, float, float], Steps]]:
    """Return the camera and all lights: name in words, position (mm) and its path in the design."""
    found: list[tuple[str, tuple[float, float, float], Steps]] = [
        ("the camera", design.camera.position, ("camera", "position"))
    ]
    for name, group in design.lights.items():
        for index, light in enumerate(group.lights):
            label = f"light {index} of group '{name}'"
            found.append((label, light.position, ("lights", name, "lights", index, "position")))
    return found

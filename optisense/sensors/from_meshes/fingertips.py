"""Round fingertips in a user's CAD files: hollow domes of gel, with lights and a fisheye inside."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np

from optisense.array_types import FloatArray
from optisense.design.posing import triple
from optisense.geometry import TriangleMesh
from optisense.geometry.containment import inside
from optisense.geometry.patches import faces_towards, smoothly_joined
from optisense.geometry.rays import ray_hits
from optisense.sensors.from_meshes.directions import SIDES, axis_of, vector
from optisense.sensors.from_meshes.recipe import CameraChoice
from optisense.sensors.from_meshes.recipe_lights import LightChoice, Ring
from optisense.sensors.from_meshes.surfaces import WITHIN

STEEP = 80.0
"""Angle (degrees) from the outward direction above which faces of a gel are taken for the sides of
a block, which have 90, and not for those of a dome."""

FISHEYE = "imx219-fisheye-160"
"""Camera of the library for the inside of a dome: a common module that sees 128 degrees across."""

LIGHT_HEIGHT = 0.5
"""Height (mm) of the lights above the camera's pupil, which puts them outside of its view."""

RING_CLEARANCE = 2.5
"""Distance (mm) of the middle of a light from the wall of the cavity: half the diagonal of a 3528
package, 2.2 mm, and some clearance."""

LEAST_RING = 4.0
"""Smallest radius (mm) of a ring of lights that leaves room for a camera within it."""

LED_PITCH = 4.5
"""Distance (mm) between lights in a guessed row or ring; a 3528 package is 3.5 mm long."""

GAP_BETWEEN_COLOURS = 0.25
"""Share of a colour's third of the ring that stays empty between two colours."""

SPOKES = 36
"""Number of directions in which the distance to the wall of the cavity is measured."""

STEP = 0.5
"""Step (mm) in which the camera moves into the cavity until it and the lights have room."""

CAMERA_CLEARANCE = 0.1
"""Distance (mm) from the pupil, along the axis of the dome, in which there is no solid: twice the
smallest that a camera needs from a face."""


def is_round(gel: TriangleMesh, outward: str) -> bool:
    """Return whether the outer face of a gel is a dome or the like, and not the top of a pad.

    The faces that continue the outermost ones without a sharp edge are those of a dome if more of
    them are inclined by `WITHIN` to `STEEP` degrees than by less. The rounded edges of a pad are
    smaller than its top, and its sides are steeper.
    """
    mesh = gel.welded()
    top = faces_towards(mesh, vector(outward), WITHIN)
    if len(top) == 0:
        return False
    joined = smoothly_joined(mesh, top)
    sloping = np.intersect1d(joined, faces_towards(mesh, vector(outward), STEEP))
    area = float(mesh.face_areas[top].sum())
    return float(mesh.face_areas[sloping].sum()) - area > area


def tip_of(gel: TriangleMesh) -> str | None:
    """Return the side, such as +z, on which the tip of a hollow dome is, opposite to its opening;
    None if the gel isn't one.
    """
    sides = np.stack([vector(side) for side in SIDES])
    walls = set(ray_hits(gel, gel.bounds.mean(axis=0), sides).ray.tolist())
    for number, side in enumerate(SIDES):
        opposite = number ^ 1  # +x and -x, +y and -y, +z and -z are pairs
        if number in walls and opposite not in walls and is_round(gel, side):
            return side
    return None


def lights_and_camera(
    meshes: Mapping[str, TriangleMesh], gel: str, outward: str, light: str, flux: float
) -> tuple[dict[str, LightChoice], CameraChoice] | None:
    """Return a ring of red, green and blue lights at the open side of a hollow dome, whose tip
    points outward, and a fisheye within it that looks into the dome; None if there is no cavity
    with room for them. The dome is the part `gel`, and the flux is in mW.
    """
    axis, sign = axis_of(outward)
    way = vector(outward)
    bounds = meshes[gel].bounds
    open_end, far_end = np.sort(sign * bounds[:, axis])
    pupil = bounds.mean(axis=0)
    for low in np.arange(open_end, (open_end + far_end) / 2.0, STEP):
        pupil[axis] = sign * low
        centre = pupil + LIGHT_HEIGHT * way
        radius = round(_room(meshes.values(), pupil, centre, axis) - RING_CLEARANCE, 2)
        if radius >= LEAST_RING:
            break
    else:
        return None
    arc = 120.0 * (1.0 - GAP_BETWEEN_COLOURS)
    count = 1 + int(np.radians(arc) * radius / LED_PITCH)
    lights = {}
    for number, colour in enumerate(("red", "green", "blue")):
        ring = Ring(
            part=gel,
            axis=outward,
            count=count,
            radius=radius,
            height=round(float(centre[axis]), 3),
            start=120.0 * number,
            end=120.0 * number + arc,
            direction=outward,
        )
        lights[colour] = LightChoice(model=light, colour=colour, flux=flux, ring=ring)
    at = triple(np.round(pupil, 3))
    return lights, CameraChoice(model=FISHEYE, at=at, direction=outward)


def _room(
    meshes: Collection[TriangleMesh], pupil: FloatArray, centre: FloatArray, axis: int
) -> float:
    """Return the distance (mm) from the middle of a ring around an axis to the nearest wall; 0 if
    there is none, or if the camera's pupil is in a solid or in the face of one.
    """
    way = np.eye(3)[axis]
    near = pupil + CAMERA_CLEARANCE * np.stack([-way, way])
    if any(mesh.is_closed and inside(near, mesh).any() for mesh in meshes):
        return 0.0
    angles = np.linspace(0.0, 2.0 * np.pi, SPOKES, endpoint=False)
    spokes = np.zeros((SPOKES, 3))
    spokes[:, (axis + 1) % 3], spokes[:, (axis + 2) % 3] = np.cos(angles), np.sin(angles)
    distances = [ray_hits(mesh, centre, spokes).distance for mesh in meshes]
    return float(min((found.min() for found in distances if len(found)), default=0.0))

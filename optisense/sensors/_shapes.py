"""Basic shapes of sensors: solids of revolution, bent strips, rows of lights.

Solids that share a surface take it from the same points, so that their vertices agree bit for bit
there and the media on both sides are found face by face.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from optisense.array_types import FloatArray
from optisense.design import Camera, Light
from optisense.design.posing import triple
from optisense.geometry import TriangleMesh
from optisense.geometry.mesh import grid_faces

Vector = tuple[float, float, float]

ON_AXIS = 1e-12
"""Largest distance from the axis of a profile point that is a pole, mm; a margin for rounding."""

TWIST = 0.31
"""Angle by which turned shapes are rotated, in segments. No vertex then lies exactly on a plane of
symmetry, where rays of regular grids would meet edges."""

ASIDE = 0.01
"""Distance by which a pole is moved off the axis, as a share of the next ring's radius."""


def revolve(profile: ArrayLike, segments: int) -> TriangleMesh:
    """Return a profile, r >= 0 and z, (n, 2) mm, turned about the z axis.

    Normals point to the right of the direction along the profile (r to the right, z up): out of a
    solid whose outline runs counter-clockwise. Two neighbouring points on the axis make no faces.

    The welded mesh has n rings of `segments` vertices, one vertex where r is 0; closed outlines,
    which end on their first point, and outlines from axis to axis make closed meshes. No edge lies
    in the xz or yz plane and no corner on the axis, where a camera's rays would run exactly along
    edges: a ray tracer may miss both faces there.
    """
    points = np.asarray(profile, dtype=np.float64)
    turn = 2.0 * np.pi * (np.arange(segments) + TWIST) / segments
    circle = np.column_stack([np.cos(turn), np.sin(turn)])
    vertices, rings = [], []
    start = 0
    for index, (radius, height) in enumerate(points):
        pole = radius < ON_AXIS
        if pole:
            beside = points[[max(index - 1, 0), min(index + 1, len(points) - 1)], 0].max()
            ring = np.array([[*ASIDE * beside * circle[segments // 7], 0.0]])
        else:
            ring = np.column_stack([radius * circle, np.zeros(segments)])
        ring[:, 2] = height
        vertices.append(ring)
        rings.append(np.full(segments, start) if pole else start + np.arange(segments))
        start += len(ring)
    faces = []
    for index, (one, other) in enumerate(pairwise(rings)):
        # The diagonal of a quad depends on its corners only, not on the direction along the
        # profile.
        upward = tuple(points[index, ::-1]) <= tuple(points[index + 1, ::-1])
        low, high = (one, other) if upward else (other, one)
        beside_low, beside_high = np.roll(low, -1), np.roll(high, -1)
        quads = []
        if low[0] != low[1]:
            quads.append(np.column_stack([low, beside_low, beside_high]))
        if high[0] != high[1]:
            quads.append(np.column_stack([low, beside_high, high]))
        faces += quads if upward else [triangles[:, ::-1] for triangles in quads]
    return TriangleMesh(np.concatenate(vertices), np.concatenate(faces)).welded()


def ribbon(path: ArrayLike, half_width: float, rows: int) -> TriangleMesh:
    """Return a path in the xz plane, (n, 2) mm, extruded along y to both sides; an open sheet.

    Normals point to the left of the direction along the path (x to the right, z up). The mesh has n
    times (rows + 1) vertices, row by row along the path.
    """
    points = np.asarray(path, dtype=np.float64)
    y = np.linspace(-half_width, half_width, rows + 1)
    along, across = np.repeat(np.arange(len(points)), rows + 1), np.tile(y, len(points))
    vertices = np.column_stack([points[along, 0], across, points[along, 1]])
    return TriangleMesh(vertices, grid_faces(len(points), rows + 1))


def strip(lower: ArrayLike, upper: ArrayLike, half_width: float, rows: int) -> TriangleMesh:
    """Return the closed solid between two paths in the xz plane, (n, 2) mm, extruded along y.

    `upper` lies to the left of the direction along the paths. The mesh has, bit for bit, the
    vertices of `ribbon(upper)` and `ribbon(lower)`.
    """
    bottom, top = np.asarray(lower, dtype=np.float64), np.asarray(upper, dtype=np.float64)
    count = len(bottom)
    sides = []
    for y, flip in ((half_width, False), (-half_width, True)):
        points = np.concatenate([bottom, top])
        wall = TriangleMesh(
            np.column_stack([points[:, 0], np.full(2 * count, y), points[:, 1]]),
            grid_faces(2, count),
        )
        sides.append(wall.flipped() if flip else wall)
    ends = [
        ribbon([bottom[0], top[0]], half_width, rows),
        ribbon([top[-1], bottom[-1]], half_width, rows),
    ]
    faces = [ribbon(top, half_width, rows), ribbon(bottom, half_width, rows).flipped()]
    return TriangleMesh.joined(faces + sides + ends).welded()


def rod(outline: ArrayLike, half_width: float) -> TriangleMesh:
    """Return a convex outline in the xz plane, (n, 2) mm, counter-clockwise (x to the right, z up),
    extruded along y: a closed prism.
    """
    points = np.asarray(outline, dtype=np.float64)
    count = len(points)
    near, far = (np.column_stack([points[:, 0], np.full(count, y), points[:, 1]])
                 for y in (-half_width, half_width))  # fmt: skip
    this, following = np.arange(count), np.roll(np.arange(count), -1)
    inner = np.arange(1, count - 1)
    cap = np.column_stack([np.zeros(count - 2, dtype=np.int64), inner, inner + 1])
    faces = [
        cap,
        cap[:, ::-1] + count,
        np.column_stack([this, this + count, following + count]),
        np.column_stack([this, following + count, following]),
    ]
    return TriangleMesh(np.concatenate([near, far]), np.concatenate(faces))


def arc(
    centre: tuple[float, float], radius: float, start: float, end: float, pieces: int
) -> FloatArray:
    """Return points on an arc in a plane, (pieces + 1, 2) mm, from one angle to another, degrees
    from the first axis towards the second.
    """
    angle = np.radians(np.linspace(start, end, pieces + 1))
    return np.column_stack([centre[0] + radius * np.cos(angle), centre[1] + radius * np.sin(angle)])


def pieces_of_arc(radius: float, degrees: float, tessellation: float, least: int = 2) -> int:
    """Return the number of pieces of about `tessellation` mm, 15 degrees at most, of an arc."""
    length = abs(math.radians(degrees)) * radius
    return max(least, math.ceil(length / tessellation), math.ceil(abs(degrees) / 15.0))


def axial_camera(
    model: str,
    fov: float,
    resolution: tuple[int, int],
    z: float,
    projection: Literal["perspective", "equidistant"] = "perspective",
) -> Camera:
    """Return a camera with its pupil on the z axis, at z (mm), that looks along the axis, with +y
    up; right in its picture is -x.
    """
    return Camera(
        model=model,
        projection=projection,
        fov=fov,
        resolution=resolution,
        position=(0.0, 0.0, z),
        direction=(0.0, 0.0, 1.0),
        up=(0.0, 1.0, 0.0),
    )


def row_of_lights(
    centre: Vector,
    along: Vector,
    count: int,
    pitch: float,
    direction: Vector,
    *,
    upright: bool = True,
) -> list[Light]:
    """Return lights `pitch` mm apart along a unit vector that all shine in one direction; if they
    are upright, this vector is their `up`, else they have none.
    """
    lights = []
    for offset in (np.arange(count) - 0.5 * (count - 1)) * pitch:
        place = triple(np.array(centre) + offset * np.array(along))
        lights.append(Light(position=place, direction=direction, up=along if upright else None))
    return lights

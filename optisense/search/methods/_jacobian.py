"""The Jacobian of shapes and camera by the coordinates of a search space.

It is computed by finite differences: where shapes depend linearly on the coordinates, as they do in
a cage, these are exact, and one Jacobian serves all points.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from optisense.array_types import FloatArray
from optisense.design import Camera, SensorDesign
from optisense.errors import SearchError
from optisense.geometry import TriangleMesh
from optisense.search.space.search_space import BoundSpace

STEP = 1e-4
"""Step of the finite differences to each side, as a share of a parameter's range; small against all
details of a shape, and large against rounding.
"""

LINEAR = 1e-6
"""Tolerance of linearity of shapes along a random direction, mm; far above rounding errors and far
below any dimension of a sensor."""


@dataclass(frozen=True)
class Jacobian:
    """Derivatives of shapes and camera by each coordinate.

    Attributes:
        point: point (n,) at which the Jacobian was computed.
        parts: derivatives of the vertices by part name, (n, v, 3), mm per unit of each coordinate.
        camera: derivatives (n, c) of the camera's numbers (see `camera_numbers`), per unit of each
            coordinate.
    """

    point: FloatArray
    parts: dict[str, FloatArray]
    camera: FloatArray


def moving_parts(space: BoundSpace) -> list[str]:
    """Return the names of the parts whose shape a point of the space, all of whose parameters are
    continuous, changes; SearchError if chief rays have no derivative by a parameter.
    """
    start = space.apply(space.start)
    meshes = start.deformed_meshes()
    moving: set[str] = set()
    for number, parameter in enumerate(space.parameters):
        design = space.apply(_beside(space, space.start, number)[0])
        changed = [n for n, m in design.deformed_meshes().items() if not _same(m, meshes[n])]
        # A point inside of a cage may move no part: it has a gradient, of 0.
        harmless = parameter.name.startswith("cages.")
        still = np.array_equal(camera_numbers(design.camera), camera_numbers(start.camera))
        if not changed and not harmless and still:
            raise SearchError(
                "it moves neither a surface nor the camera, so chief rays have no gradient by it",
                where=parameter.name,
                hint="Search it with --method cma-es",
            )
        moving |= set(changed)
    return [name for name in meshes if name in moving]


def jacobian(space: BoundSpace, point: FloatArray, parts: list[str]) -> Jacobian:
    """Return the Jacobian of parts and camera at a point (n,)."""
    slopes: dict[str, list[FloatArray]] = {name: [] for name in parts}
    camera = []
    for number in range(space.size):
        after, before = _beside(space, point, number)
        step = after[number] - before[number]
        there, back = space.apply(after), space.apply(before)
        moved, stayed = there.deformed_meshes(), back.deformed_meshes()
        for name in parts:
            slopes[name].append((moved[name].vertices - stayed[name].vertices) / step)
        camera.append((camera_numbers(there.camera) - camera_numbers(back.camera)) / step)
    return Jacobian(point, {n: np.array(s) for n, s in slopes.items()}, np.array(camera))


def predicts(known: Jacobian, space: BoundSpace, design: SensorDesign, point: FloatArray) -> bool:
    """Return whether a Jacobian predicts the shapes and the camera at a point."""
    way = point - known.point
    if not way.any():
        return True
    start, meshes = space.apply(known.point), design.deformed_meshes()
    old = start.deformed_meshes()
    for name, slope in known.parts.items():
        predicted = old[name].vertices + np.tensordot(way, slope, axes=1)
        if np.abs(meshes[name].vertices - predicted).max() > LINEAR:
            return False
    camera = camera_numbers(start.camera) + way @ known.camera
    return bool(np.abs(camera_numbers(design.camera) - camera).max() <= LINEAR)


def camera_numbers(camera: Camera) -> FloatArray:
    """Return the numbers of a camera, (13,) or more: position (mm), rows of the camera's axes,
    field of view (degrees), coefficients of the distortion.
    """
    lens = () if camera.distortion is None else camera.distortion.coefficients()
    return np.concatenate([camera.position, np.ravel(camera.axes()), [camera.fov], lens])


def _beside(space: BoundSpace, point: FloatArray, number: int) -> tuple[FloatArray, FloatArray]:
    """Return two points at a small distance to either side of one, within the bounds."""
    step = STEP * space.span[number]
    after, before = point.copy(), point.copy()
    after[number] = min(point[number] + step, space.upper[number])
    before[number] = max(point[number] - step, space.lower[number])
    return after, before


def _same(one: TriangleMesh, other: TriangleMesh) -> bool:
    return one is other or np.array_equal(one.vertices, other.vertices)

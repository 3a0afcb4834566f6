"""Plates: flat parts that are cut from sheet material, each with its outline in its own plane."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from optisense.array_types import FloatArray
from optisense.design import Role
from optisense.geometry import TriangleMesh
from optisense.geometry.solids import bodies
from optisense.workshop._profiles import OutlinePiece, pieces
from optisense.workshop._recognised import extruded_along
from optisense.workshop.shapes import Shape

THICKEST = 10.0
"""Largest thickness of a plate, mm: common laser cutters cut acrylic of up to 10 mm."""

FLAT = 0.5
"""Largest ratio of a plate's thickness to its smaller side; a thicker part is a block."""

CAST_OR_PAINTED = frozenset({Role.ELASTOMER, Role.SENSING_SURFACE})
"""Roles of parts that are cast or sprayed and not cut."""

ROUND = 12
"""Smallest number of corners on a circle of a round outline; octagons stay octagons."""

SAME_RADIUS = 1e-4
"""Largest difference of the corners' distances from the middle of a round outline, mm; it covers
rounding in files."""

ON_AXIS = 1e-9
"""Largest difference from 1 of a unit normal's component along the axis that it is parallel to."""


@dataclass(frozen=True)
class Circle:
    """Round hole, or disc.

    Attributes:
        centre: centre, (2,) mm.
        radius: radius, mm.
    """

    centre: FloatArray
    radius: float


@dataclass(frozen=True)
class Plate:
    """Plate to be cut.

    Attributes:
        name: name of the part, with a number if a part has several plates.
        material: name of its material in the design, None if it has none.
        count: number of plates with this outline.
        thickness: thickness, mm.
        outlines: outlines, the outer one first, then holes: a circle, or the lines, arcs and curves
            in their order. Coordinates are in mm from the lower left corner of the plate.
        size: width and height, mm.
    """

    name: str
    material: str | None
    count: int
    thickness: float
    outlines: list[Circle | list[OutlinePiece]]
    size: tuple[float, float]


def plates(made: Sequence[Shape]) -> list[Plate]:
    """Return the plates among the parts of a design."""
    found: list[Plate] = []
    for shape in made:
        if not shape.is_solid or shape.role in CAST_OR_PAINTED:
            continue
        own: list[Plate] = []
        for outside, *cavities in bodies(shape.mesh):
            plate = None if cavities else _plate(shape, outside)
            if plate is None:
                continue
            twin = next((k for k, each in enumerate(own) if _alike(each, plate)), None)
            if twin is None:
                own.append(plate)
            else:
                own[twin] = replace(own[twin], count=own[twin].count + 1)
        if len(own) > 1:
            own = [replace(each, name=f"{each.name}-{k}") for k, each in enumerate(own, start=1)]
        found += own
    return found


def _plate(shape: Shape, mesh: TriangleMesh) -> Plate | None:
    """Return a body as a plate in the plane of its largest face; None if it is no plate."""
    normal = mesh.face_normals[int(mesh.face_areas.argmax())]
    frame = _frame(normal, mesh)
    size = np.ptp(mesh.vertices @ frame.T, axis=0)
    if size[1] > size[0] + ON_AXIS:  # drawing sheets are wide
        frame = frame[[1, 0, 2]] * np.array([[1.0], [-1.0], [1.0]])
        size = size[[1, 0, 2]]
    flat = TriangleMesh(mesh.vertices @ frame.T, mesh.faces)
    thickness, size = float(size[2]), size[:2]
    if thickness > THICKEST or thickness > FLAT * float(size.min()):
        return None
    found = extruded_along(flat, 2)
    if found is None:
        return None
    corner = flat.bounds[0][:2]
    outlines = [_outline(each - corner) for each in found.outlines]
    return Plate(
        shape.name, shape.material, 1, thickness, outlines, (float(size[0]), float(size[1]))
    )


def _frame(normal: FloatArray, mesh: TriangleMesh) -> FloatArray:
    """Return rows (3, 3): right and up in the plane of a plate, and its normal.

    In a plane across x, y or z right and up are along axes of the design; else right is along the
    longest edge.
    """
    axis = int(np.abs(normal).argmax())
    if 1.0 - abs(normal[axis]) < ON_AXIS:
        return np.eye(3)[[(axis + 1) % 3, (axis + 2) % 3, axis]]
    edges = mesh.triangles[:, [1, 2, 0]] - mesh.triangles
    edges = edges.reshape(-1, 3)[np.abs(edges.reshape(-1, 3) @ normal) < 1e-6]
    # Diagonals of quadrilaterals are no edges of the plate; its sides tell which are.
    sides = mesh.face_normals[np.abs(mesh.face_normals @ normal) < 1e-6]
    lengths = np.linalg.norm(edges, axis=1)
    order = np.argsort(-lengths, kind="stable")
    right = edges[order[0]] / lengths[order[0]]
    for edge, length in zip(edges[order], lengths[order], strict=True):
        if len(sides) and np.abs(sides @ edge).min() < 1e-6 * length:
            right = edge / length
            break
    return np.array([right, np.cross(normal, right), normal])


def _outline(corners: FloatArray) -> Circle | list[OutlinePiece]:
    """Return an outline that begins at its longest side, so that no arc or curve is split."""
    points = corners[:-1]
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    middle = points.mean(axis=0) if len(points) % 2 else middle
    away = np.linalg.norm(points - middle, axis=1)
    if len(points) >= ROUND and np.ptp(away) < SAME_RADIUS:
        return Circle(middle, float(away.mean()))
    start = int(np.linalg.norm(np.diff(corners, axis=0), axis=1).argmax())
    turned = np.roll(points, -start, axis=0)
    return pieces(np.concatenate([turned, turned[:1]]))


def _alike(one: Plate, other: Plate) -> bool:
    """Return whether two plates have the same outline."""
    if abs(one.thickness - other.thickness) > 1e-6 or len(one.outlines) != len(other.outlines):
        return False
    return all(
        _corners(a).shape == _corners(b).shape and np.abs(_corners(a) - _corners(b)).max() < 1e-6
        for a, b in zip(one.outlines, other.outlines, strict=True)
    )


def _corners(outline: Circle | list[OutlinePiece]) -> FloatArray:
    """Return points (n, 2), mm, that identify an outline, sorted."""
    if isinstance(outline, Circle):
        return np.array([outline.centre, (outline.radius, 0.0)])
    points = np.concatenate([piece.points for piece in outline])
    return points[np.lexsort(np.round(points, 5).T)]

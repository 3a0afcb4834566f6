"""Transforms of parts that were drawn in frames of their own into the frame of the sensor."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from optisense.array_types import FloatArray
from optisense.errors import DesignError
from optisense.geometry import TriangleMesh
from optisense.geometry.rotations import turn_about_axes
from optisense.sensors.from_meshes.directions import axis_of
from optisense.sensors.from_meshes.recipe_parts import PartChoice, ShapeReference

IN_PLANE = 1e-3
"""Largest distance of vertices from a part's outermost plane that count as on its face, mm."""


def posed(mesh: TriangleMesh, shape: ShapeReference) -> TriangleMesh:
    """Return a file's mesh, mirrored, turned and moved by the recipe, in this order.

    A part that lies on another one is moved from there; see `laid_on`.
    """
    if shape.mirror is not None:
        flip = np.ones(3)
        flip["xyz".index(shape.mirror)] = -1.0
        mesh = TriangleMesh(mesh.vertices * flip, mesh.faces[:, ::-1])
    if shape.turn is not None:
        mesh = mesh.with_vertices(mesh.vertices @ turn_about_axes(*shape.turn).T)
    if shape.move is not None and getattr(shape, "on", None) is None:
        mesh = mesh.with_vertices(mesh.vertices + np.array(shape.move))
    return mesh


def resting_order(parts: Mapping[str, PartChoice]) -> list[str]:
    """Return the parts that lie on others, each after the one that it lies on.

    Raises:
        DesignError: two parts lie on one another, or a part lies on faces of another.
    """
    order: list[str] = []
    for name in (each for each, part in parts.items() if part.on is not None):
        chain = [name]
        while (below := parts[chain[-1]].on) is not None:
            if below in chain:
                raise DesignError(
                    f"parts {' and '.join(sorted(set(chain)))} lie on one another"
                    if below != name or len(chain) > 1
                    else f"part '{name}' lies on itself",
                    where=f"parts.{name}.on",
                    hint="Remove on from one of them, and place it by its file or by move",
                )
            chain.append(below)
        if parts[chain[1]].file is None:
            raise DesignError(
                f"part '{name}' lies on '{chain[1]}', which consists of faces of another part",
                where=f"parts.{name}.on",
                hint="Name the part that has the file",
            )
        order += [each for each in reversed(chain) if parts[each].on and each not in order]
    return order


def laid_on(mesh: TriangleMesh, below: TriangleMesh, part: PartChoice) -> TriangleMesh:
    """Return a part moved onto the side of another one.

    Its flat face there (or its outermost points) meets that of the other part, at a distance of
    `gap` mm. In the plane of the side, the middles of the two faces agree, or their ends if `flush`
    names a side. `move` is added to this.
    """
    axis, sign = axis_of(part.side or "+z")
    own, other = _end(mesh, axis, -sign), _end(below, axis, sign)
    shift = other.mean(axis=0) - own.mean(axis=0)
    shift[axis] += sign * (part.gap or 0.0)
    for side in part.flush or ():
        across, way = axis_of(side)
        shift[across] = (other - own)[1 if way > 0 else 0, across]
    shift += np.zeros(3) if part.move is None else np.array(part.move)
    return mesh.with_vertices(mesh.vertices + shift)


def _end(mesh: TriangleMesh, axis: int, sign: float) -> FloatArray:
    """Return the box around the outermost face along an axis, (2, 3) mm; along the axis, both
    corners are at the end.

    It is the box of the whole part if the end is a point or an edge.
    """
    low, high = mesh.bounds
    end = high[axis] if sign > 0 else low[axis]
    near = mesh.vertices[np.abs(mesh.vertices[:, axis] - end) <= IN_PLANE]
    box = np.array([near.min(axis=0), near.max(axis=0)])
    if (np.delete(np.ptp(box, axis=0), axis) <= IN_PLANE).any():
        box = np.array([low, high])
    box[:, axis] = end
    return box

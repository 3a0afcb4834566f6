"""Linear elasticity of eight-node hexahedra that do not lock near incompressibility."""

from __future__ import annotations

import numpy as np

from optisense.array_types import FloatArray

CORNERS = np.array([(x, y, z) for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)], dtype=np.float64)
"""Corners (8, 3) of the reference cell, in the order of an element's nodes: x first, z last."""
GAUSS = CORNERS / np.sqrt(3.0)
"""Points (8, 3) of the Gauss rule of order 2 in each direction; all weights are 1."""
FACE_GAUSS = np.array([(x, y) for y in (-1, 1) for x in (-1, 1)]) / np.sqrt(3.0)
"""Points (4, 2) of the Gauss rule of order 2 on a face; all weights are 1."""


def _slopes_in_the_cell() -> FloatArray:
    """Return the derivatives (3, 8, 8) of the shape functions (last index) of the reference cell,
    by each of its axes, at the Gauss points.
    """
    found = np.empty((3, 8, 8))
    for axis in range(3):
        factor = np.ones((8, 8))
        for other in {0, 1, 2} - {axis}:
            factor *= 1.0 + GAUSS[:, None, other] * CORNERS[None, :, other]
        found[axis] = CORNERS[None, :, axis] * factor / 8.0
    return found


IN_THE_CELL = _slopes_in_the_cell()
"""Derivatives (3, 8, 8) of the shape functions of the reference cell at its Gauss points."""


def stiffnesses(corners: FloatArray, poisson_ratio: float) -> FloatArray:
    """Return stiffness matrices (m, 24, 24) of elements with corners (m, 8, 3), mm, for a shear
    modulus of 1; degrees of freedom are ordered node by node.

    The dilatation is the element's mean (Hughes, "Generalization of selective integration
    procedures to anisotropic and nonlinear media", Int. J. Numer. Methods Eng. 15, 1980).
    """
    count = len(corners)
    slopes, weights = _shape_slopes(corners)
    volume = weights.sum(axis=1)
    mean = np.einsum("mg,mgp->mp", weights, slopes) / volume[:, None]
    flat = slopes * np.sqrt(weights)[:, :, None]
    shape = count, 3, 8, 3, 8  # axis and node of the row, and of the column
    outer = (np.swapaxes(flat, 1, 2) @ flat).reshape(shape)
    bulk = 2.0 * (1.0 + poisson_ratio) / (3.0 * (1.0 - 2.0 * poisson_ratio))
    spread = mean * (bulk * volume)[:, None]
    result = (spread[:, :, None] @ mean[:, None, :]).reshape(shape)
    result -= (2.0 / 3.0) * outer
    result += np.swapaxes(outer, 1, 3)
    straight = outer[:, 0, :, 0] + outer[:, 1, :, 1] + outer[:, 2, :, 2]
    for axis in range(3):
        result[:, axis, :, axis] += straight
    return result.transpose(0, 2, 1, 4, 3).reshape(count, 24, 24)


def _shape_slopes(corners: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the derivatives (m, 8, 24) of the shape functions at the Gauss points, by x of all
    nodes first, then by y and by z; and the weights (m, 8) of these points.
    """
    count = len(corners)
    each_node = np.swapaxes(corners, 0, 1).reshape(8, 3 * count)
    jacobian = (IN_THE_CELL.reshape(24, 8) @ each_node).reshape(3, 8, count, 3)
    x, y, z = np.moveaxis(jacobian, 3, 0)
    cofactors = np.empty((3, 3, 8, count))
    for axis in range(3):
        j, k = (axis + 1) % 3, (axis + 2) % 3
        cofactors[axis, 0] = y[j] * z[k] - z[j] * y[k]
        cofactors[axis, 1] = z[j] * x[k] - x[j] * z[k]
        cofactors[axis, 2] = x[j] * y[k] - y[j] * x[k]
    weights = x[0] * cofactors[0, 0] + y[0] * cofactors[0, 1] + z[0] * cofactors[0, 2]
    inverse = (cofactors / weights).transpose(3, 2, 1, 0)
    slopes = inverse @ np.moveaxis(IN_THE_CELL, 0, 1)
    return slopes.reshape(count, 8, 24), weights.T


def face_points(corners: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the Gauss points (m, 4, 3), mm, of faces with corners (m, 4, 3), x first; normals (m,
    4, 3), x cross y, times each point's share of the area; and the weights (4, 4) of the corners
    (columns) at each point (rows).
    """
    x, y = FACE_GAUSS.T
    signs = np.array([(-1, -1), (1, -1), (-1, 1), (1, 1)])
    weights = (1.0 + x[:, None] * signs[:, 0]) * (1.0 + y[:, None] * signs[:, 1]) / 4.0
    by_x = signs[:, 0] * (1.0 + y[:, None] * signs[:, 1]) / 4.0
    by_y = signs[:, 1] * (1.0 + x[:, None] * signs[:, 0]) / 4.0
    points = np.einsum("ga,mai->mgi", weights, corners)
    along = np.einsum("ga,mai->mgi", by_x, corners)
    across = np.einsum("ga,mai->mgi", by_y, corners)
    return points, np.cross(along, across), weights

"""Linear elasticity of eight-node hexahedra that do not lock near incompressibility."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

CORNERS = np.array([(x, y, z) for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)], dtype=np.float64)
"""Corners (8, 3) of the reference cell, in the order of an element's nodes: x runs first, then y,
then z."""
GAUSS = CORNERS / np.sqrt(3.0)
"""Points (8, 3) of the Gauss rule of order 2 in each direction; all weights are 1."""
FACE_GAUSS = np.array([(x, y) for y in (-1, 1) for x in (-1, 1)]) / np.sqrt(3.0)
"""Points (4, 2) of the Gauss rule of order 2 on a face; all weights are 1."""


def stiffnesses(corners: FloatArray, poisson_ratio: float) -> FloatArray:
    """Return stiffness matrices (m, 24, 24) for a shear modulus of 1; degrees of freedom are
    ordered node by node.

    The dilatation is the element's mean (Hughes, "Generalization of selective integration
    procedures to anisotropic and nonlinear media", Int. J. Numer. Methods Eng. 15, 1980).

    Args:
        corners: (m, 8, 3) corners of each element, mm.
        poisson_ratio: Poisson's ratio, below 0.5.
    """
    count = len(corners)
    slopes, weights = _shape_slopes(corners)
    volume = weights.sum(axis=1)
    mean = np.einsum("mg,mgai->mai", weights, slopes) / volume[:, None, None]
    flat = (slopes * np.sqrt(weights)[:, :, None, None]).reshape(count, 8, 24)
    outer = np.einsum("mgp,mgq->mpq", flat, flat, optimize=True).reshape(count, 8, 3, 8, 3)
    straight = np.einsum("maibi->mab", outer)
    result = np.swapaxes(outer, 2, 4) - (2.0 / 3.0) * outer
    for axis in range(3):
        result[:, :, axis, :, axis] += straight
    bulk = 2.0 * (1.0 + poisson_ratio) / (3.0 * (1.0 - 2.0 * poisson_ratio))
    spread = mean.reshape(count, 24)
    return np.asarray(
        result.reshape(count, 24, 24)
        + (bulk * volume)[:, None, None] * spread[:, :, None] * spread[:, None, :]
    )


def _shape_slopes(corners: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the derivatives (m, 8, 8, 3) of the shape functions at the Gauss points, and the
    weights of these.
    """
    local = np.empty((8, 8, 3))
    for axis in range(3):
        others = [k for k in range(3) if k != axis]
        factor = np.ones((8, 8))
        for other in others:
            factor *= 1.0 + GAUSS[:, None, other] * CORNERS[None, :, other]
        local[:, :, axis] = CORNERS[None, :, axis] * factor / 8.0
    jacobian = np.einsum("gak,mai->mgik", local, corners)
    inverse = np.linalg.inv(jacobian)
    slopes = np.einsum("gak,mgki->mgai", local, inverse, optimize=True)
    return slopes, np.linalg.det(jacobian)


def face_points(corners: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the Gauss points of faces, at which loads are evaluated.

    Args:
        corners: (m, 4, 3) corners of each face (mm), x running first; the normal is that of x cross
            y.

    Returns:
        The points (m, 4, 3), mm; normals (m, 4, 3) times each point's share of the area; and the
        weights (4, 4) of the corners (columns) at each point (rows).
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

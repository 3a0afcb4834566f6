"""Linear finite elements of the gel around a contact, whose stiffness matrix is factorised once.

They are hexahedra with eight nodes that do not lock near incompressibility.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import FloatArray, IntArray
from optisense.errors import ContactError
from optisense.mechanics._gel_columns import LAYERS, GelColumns

AT_ONCE = 128
"""Number of elements whose matrices are computed at once: 4.6 kB each, for the cache."""
SIDES = ((0, 1, 1.0), (2, 3, -1.0), (0, 2, -1.0), (1, 3, 1.0))
"""Corners of each side of a cell along its run, and the sign that makes run x up point outward."""
OPPOSITE = ((2, 3), (0, 1), (1, 3), (0, 2))
"""Corners of the opposite side of a cell, in the order of `SIDES`."""
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


class GelElements:
    """Hexahedra between columns of a gel, for a shear modulus of 1 MPa.

    The base and the columns that are held are fixed; everything else is free.

    Attributes:
        rows, cols: (columns,) grid indices of each column.
        top: (columns, 3) points of the skin, mm.
        inward: (columns, 3) unit normals of the skin, into the gel.
        fixed: (f, 3) nodes that are fixed, mm.
        points: (faces, 4, 3) Gauss points of the skin and of the free sides, mm.
        normals: (faces, 4, 3) outward normals there, times each point's share of the area.
        supports: (s, 4, 3) Gauss points of the base and of sides beyond which the gel goes on, mm.
        support_normals: (s, 4, 3) outward normals there, times each point's share of the area.
        size: number of free displacements.
    """

    def __init__(self, columns: GelColumns, poisson_ratio: float) -> None:
        """Set up the elements between columns."""
        self._nu = poisson_ratio
        solid = columns.solid
        # Neighbours along the shorter side get consecutive numbers, so that the matrix has a
        # narrow band.
        if solid.shape[0] < solid.shape[1]:
            self.cols, self.rows = np.nonzero(solid.T)
        else:
            self.rows, self.cols = np.nonzero(solid)
        count = len(self.rows)
        number = np.full(solid.shape, -1)
        number[self.rows, self.cols] = np.arange(count)
        self.top = columns.top[self.rows, self.cols]
        self.inward = columns.inward[self.rows, self.cols]
        share = np.arange(LAYERS + 1) / LAYERS
        length = columns.length[self.rows, self.cols]
        down = share[None, :, None] * length[:, None, None] * self.inward[:, None]
        self._nodes = (self.top[:, None] + down).reshape(-1, 3)
        free = np.ones((count, LAYERS + 1), dtype=bool)
        free[:, -1] = False
        free[columns.held[self.rows, self.cols]] = False
        self.size = 3 * int(free.sum())
        self._freedom = np.full((free.size, 3), -1)
        self._freedom[free.ravel()] = np.arange(self.size).reshape(-1, 3)
        self._fixed = np.flatnonzero(~free.ravel())
        self.fixed = self._nodes[self._fixed]
        corners = np.stack(
            [number[:-1, :-1], number[:-1, 1:], number[1:, :-1], number[1:, 1:]], axis=2
        )
        self._cells = corners[columns.cells]
        faces, signs, free_ones = self._outer_faces()
        points, normals, self._weights = face_points(self._nodes[faces])
        normals = normals * signs[:, None, None]
        self._faces = faces[free_ones]
        self.points, self.normals = points[free_ones], normals[free_ones]
        self.supports, self.support_normals = points[~free_ones], normals[~free_ones]

    @cached_property
    def _elements(self) -> IntArray:
        """Return the nodes (elements, 8) of each element: the lower four, then the upper four."""
        base = self._cells[:, None, :] * (LAYERS + 1) + np.arange(LAYERS)[None, :, None]
        return np.concatenate([base + 1, base], axis=2).reshape(-1, 8)

    @cached_property
    def _stiffness(self) -> FloatArray:
        """Return the stiffness matrices (elements, 24, 24)."""
        corners = self._nodes[self._elements]
        found = np.empty((len(corners), 24, 24))
        for first in range(0, len(corners), AT_ONCE):
            some = slice(first, first + AT_ONCE)
            found[some] = stiffnesses(corners[some], self._nu)
        return found

    @cached_property
    def _factor(self) -> FloatArray:
        """Return the banded Cholesky factor (band, free) of the free displacements."""
        from scipy.linalg import LinAlgError, cholesky_banded  # slow to import

        freedom = self._freedom[self._elements].reshape(-1, 24)
        least = np.where(freedom < 0, self.size, freedom).min(axis=1)
        width = int(np.maximum(freedom.max(axis=1) - least, 0).max(initial=0)) + 1
        band = np.zeros(self.size * width)
        for first in range(0, len(freedom), AT_ONCE):
            some = slice(first, first + AT_ONCE)
            row, column = freedom[some, :, None], freedom[some, None, :]
            lower = (row >= column) & (column >= 0)
            place = (column * (width - 1) + row)[lower]
            np.add.at(band, place, self._stiffness[some][lower])
        try:
            return np.asarray(
                cholesky_banded(
                    band.reshape(self.size, width).T,
                    overwrite_ab=True,
                    lower=True,
                    check_finite=False,
                )
            )
        except LinAlgError:
            raise ContactError(
                "the gel around a contact cannot be divided into elements",
                hint="Press elsewhere, or check the meshes of the skin and of the gel for folds",
            ) from None

    def moved(self, right_side: FloatArray) -> FloatArray:
        """Return the displacements (columns, 3) of the skin by forces (free,); 0 for columns that
        are fixed.

        Raises:
            ContactError: the elements are folded.
        """
        from scipy.linalg import cho_solve_banded

        found = cho_solve_banded((self._factor, True), right_side, check_finite=False)
        freedom = self._freedom.reshape(-1, LAYERS + 1, 3)[:, 0]
        return np.where(freedom < 0, 0.0, found[freedom])

    def held_back(self, displacement: FloatArray) -> FloatArray:
        """Return the forces (free, sources) by which displacements (sources, f, 3) of the fixed
        nodes pull at the free ones.
        """
        count = len(displacement)
        given = np.zeros((len(self._freedom), 3, count))
        given[self._fixed] = np.moveaxis(displacement, 0, -1)
        freedom = self._freedom[self._elements].reshape(-1, 24)
        some = (freedom < 0).any(axis=1)
        forces = self._stiffness[some] @ given[self._elements[some]].reshape(-1, 24, count)
        return self._summed(freedom[some], forces)

    def pushed(self, push: FloatArray) -> FloatArray:
        """Return the forces (free, sources) of tractions (sources, faces, 4, 3), times each point's
        share of the area, at the Gauss points of free faces.
        """
        shared = np.einsum("sfgi,ga->fais", push, self._weights, optimize=True)
        return self._summed(
            self._freedom[self._faces].reshape(len(shared), 12),
            shared.reshape(len(shared), 12, -1),
        )

    def _summed(self, freedom: IntArray, values: FloatArray) -> FloatArray:
        """Add values (n, m, sources) of free displacements (n, m); -1 is left out."""
        count = values.shape[-1]
        free = freedom >= 0
        place = freedom[free][:, None] * count + np.arange(count)
        total = np.bincount(place.ravel(), values[free].ravel(), minlength=self.size * count)
        return np.asarray(total.reshape(self.size, count))

    def at_skin(self, columns: IntArray, force: FloatArray) -> FloatArray:
        """Return the forces (free, sources) of forces (sources, 3), each at the skin's node of its
        column; those at fixed nodes are left out.
        """
        result = np.zeros((self.size, len(columns)))
        freedom = self._freedom.reshape(-1, LAYERS + 1, 3)[columns, 0]
        free = freedom >= 0
        result[freedom[free], np.nonzero(free)[0]] = force[free]
        return result

    def _outer_faces(self) -> tuple[IntArray, FloatArray, NDArray[np.bool_]]:
        """Return the nodes (faces, 4) of all outer faces of the elements, the signs that turn their
        normals outward, and a mask of those on the skin and on free sides.
        """
        cells, count = self._cells, len(self.top)
        base = cells * (LAYERS + 1)
        nodes = [base, base + LAYERS]
        signs = [np.ones(len(cells)), -np.ones(len(cells))]
        free = [np.ones(len(cells), dtype=bool), np.zeros(len(cells), dtype=bool)]
        held = (self._freedom.reshape(-1, LAYERS + 1, 3)[:, 0, 0]) < 0
        for (one, other, sign), (third, fourth) in zip(SIDES, OPPOSITE, strict=True):
            ends = cells[:, one], cells[:, other]
            beyond = cells[:, third] * count + cells[:, fourth]
            outer = ~np.isin(ends[0] * count + ends[1], beyond)
            run = np.stack(ends, axis=1)[outer]
            base = run[:, None, :] * (LAYERS + 1) + np.arange(LAYERS)[None, :, None]
            nodes.append(np.concatenate([base + 1, base], axis=2).reshape(-1, 4))
            signs.append(np.full(len(nodes[-1]), sign))
            free.append(np.repeat(~held[run].all(axis=1), LAYERS))
        return np.concatenate(nodes), np.concatenate(signs), np.concatenate(free)


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

"""Corrections of a flat layer's response for the shape of the gel, by finite elements around a
contact.

A flat layer's response (`layer`) is exact if the gel is flat, of uniform thickness, and wide. For
other gels the response is the sum of that of a half-space in the tangent plane of each load, which
contains the singularity, and a smooth remainder. The remainder is a displacement field of the gel
without a load on the contact: it cancels the half-space's displacements on the base, and its
stresses on free faces. Linear hexahedra with few elements through the thickness resolve it.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, partial
from typing import TYPE_CHECKING

import numpy as np
from scipy import ndimage

from optisense.array_types import FloatArray, IntArray
from optisense.mechanics import _point_load as point_load
from optisense.mechanics._gel_columns import GelColumns
from optisense.mechanics._gel_elements import GelElements
from optisense.mechanics._layer import FARTHEST, layer_correction, surface_displacement
from optisense.mechanics._point_load import INTO

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

TAPER = 1.0
"""Distance, in thicknesses, over which the correction falls to 0 at the rim of the modelled region:
a third of the distance between the loads and the rim."""
BLIND = 0.5
"""Distance from a load, in pitches, below which its stresses on the skin are neglected: half of a
facet, as the skin's shape is not known more finely."""


class _BySource:
    """Arrays (..., sources) whose last index is a source, computed when the source is loaded."""

    def __init__(self, compute: Callable[[IntArray], FloatArray], count: int) -> None:
        """Set the function that returns the values of given sources, and their number."""
        self._compute, self._known = compute, np.zeros(count, dtype=bool)
        self._values: FloatArray | None = None

    def total(self, loads: FloatArray) -> FloatArray:
        """Return the values (...) summed over all sources with weights (sources,)."""
        some = np.flatnonzero(loads)
        new = some[~self._known[some]]
        if len(new) or self._values is None:
            values = self._compute(new)
            if self._values is None:
                self._values = np.zeros((*values.shape[:-1], len(loads)))
            self._values[..., new] = values
            self._known[new] = True
        return np.asarray(self._values[..., some] @ loads[some])


class GelPatch:
    """The difference of the response of the gel around one contact from that of a flat layer.

    The stiffness matrix is factorised once; each pressure then takes one solution. What depends on
    the place of a load is computed when a load lies there for the first time.

    Attributes:
        columns: the columns of the gel.
        thickness: thickness (mm) of the flat layer.
        x, y: (columns,) and (rows,) coordinates (mm) of a regular grid, on which forces are given
            and displacements returned; its pitch is that of the columns under the contact.
    """

    def __init__(
        self,
        columns: GelColumns,
        loaded: tuple[float, float],
        thickness: float,
        poisson_ratio: float,
        share: float = 1.0,
    ) -> None:
        """Set up the elements for loads in a rectangle with half sides ``loaded`` (mm); a share
        (0 to 1) of the difference is returned.
        """
        self.columns, self.thickness, self._nu = columns, thickness, poisson_ratio
        self._share = share
        self._elements = GelElements(columns, poisson_ratio)
        self._top, self._inward = self._elements.top, self._elements.inward
        self.x, self.y = (
            np.linspace(at[0], at[-1], round((at[-1] - at[0]) / columns.pitch) + 1)
            for at in (columns.x, columns.y)
        )
        room = np.array(loaded) + columns.pitch
        self._sources = np.flatnonzero((np.abs(self._top[:, :2]) <= room).all(axis=1))
        count = len(self._sources)
        self._right_sides = [_BySource(partial(self._right_side, axis), count) for axis in range(3)]
        self._beside = _BySource(self._beside_into, count)
        self._beside_along = [
            _BySource(partial(self._beside_tangential, axis), count) for axis in range(3)
        ]

    def correction(self, force: FloatArray) -> FloatArray:
        """Return the displacement (rows, columns), mm, into the gel, along the normal of the
        tangent plane, beyond that of a flat layer by forces (rows, columns) along this normal, N
        over the shear modulus in MPa.
        """
        if not force.any():
            return np.zeros(self.shape)
        loads = self._on_sources(force[None])[0] / -self._inward[self._sources, 2]
        rest = self._elements.moved(self._right_sides[INTO].total(loads))
        upright = -self._inward[:, 2]
        inside = np.einsum("ci,ci->c", rest, self._inward) / upright
        return self._on_grid(inside + self._beside.total(loads))

    def tangential(self, force: FloatArray) -> FloatArray:
        """Return the displacement (2, rows, columns), mm, along x and y of the tangent plane beyond
        that of a flat layer.

        Forces (3, rows, columns), N over the shear modulus in MPa, are those along x and y, which
        act along the skin, and into the gel, along its normals.
        """
        given = self._on_sources(force)
        normals = self._inward[self._sources]
        along = np.column_stack([given[0], given[1], np.zeros(len(normals))])
        along[:, 2] = -(along * normals).sum(axis=1) / normals[:, 2]
        loads = np.einsum("si,sik->ks", along, self._frames)
        loads[INTO] = given[2] / -normals[:, 2]
        axes = [axis for axis in range(3) if loads[axis].any()]
        if not axes:
            return np.zeros((2, *self.shape))
        rest = self._elements.moved(
            np.sum([self._right_sides[a].total(loads[a]) for a in axes], axis=0)
        )
        beside = np.sum([self._beside_along[a].total(loads[a]) for a in axes], axis=0)
        return np.stack([self._on_grid(each) for each in rest[:, :2].T + beside])

    def _beside_tangential(self, axis: int, new: IntArray) -> FloatArray:
        """Return the displacement (2, columns, new) along x and y of the half-spaces of new sources
        by forces along an axis of their frames, minus that of the flat layer.
        """
        frames = self._frames[new]
        moved = self._in_frame(
            point_load.displacements(self._offsets(self._top, new), self._nu, axis), new
        )
        x, y = np.moveaxis(self._apart(new), 2, 0) / self.thickness
        moved[((x == 0.0) & (y == 0.0)).T] = 0.0
        # The flat layer is loaded with the components of the forces along its own normal.
        share = frames[:, :, axis].T.copy()
        share[slice(0, 2) if axis == INTO else 2] = 0.0
        share[2] = -share[2]
        flat = surface_displacement(x, y, self._nu) / self.thickness
        into = np.einsum("kacs,as->kcs", flat, share)
        return np.transpose(moved[:, :, :2], (2, 1, 0)) - into

    def _on_grid(self, values: FloatArray) -> FloatArray:
        """Return values (columns,) on the grid (rows, columns): the nearest column's where there is
        none, and 0 at the rim.
        """
        result = np.zeros(self.columns.solid.shape)
        result[self._elements.rows, self._elements.cols] = self._shares @ values
        nearest = ndimage.distance_transform_edt(
            ~self.columns.solid, return_distances=False, return_indices=True
        )
        across, along = self._between
        return np.asarray(along @ result[tuple(nearest)] @ across.T * self._fade)

    def _on_sources(self, force: FloatArray) -> FloatArray:
        """Return forces (n, rows, columns) on the sources (n, sources); forces beside columns act
        on the nearest.
        """
        from scipy.spatial import cKDTree

        rows, cols = np.nonzero(force.any(axis=0))
        points = np.column_stack([self.x[cols], self.y[rows]])
        _, nearest = cKDTree(self._home[self._sources]).query(points)
        loads = np.zeros((len(force), len(self._top)))
        for one, given in zip(loads, force, strict=True):
            np.add.at(one, self._sources[nearest], given[rows, cols])
        return np.asarray((self._shares.T @ loads.T).T[:, self._sources])

    @cached_property
    def _home(self) -> FloatArray:
        """Return the points (columns, 2) of the grid to which the columns belong."""
        return np.column_stack(
            [self.columns.x[self._elements.cols], self.columns.y[self._elements.rows]]
        )

    @cached_property
    def _shares(self) -> csr_matrix:
        """Return the matrix (columns, columns) that interpolates from the columns to their points
        of the grid, which columns at the border of the gel have left.
        """
        from scipy.sparse import csr_matrix

        elements, count = self._elements, len(self._top)
        number = np.full(self.columns.solid.shape, -1)
        number[elements.rows, elements.cols] = np.arange(count)
        number = np.pad(number, 1, constant_values=-1)
        itself = np.arange(count)
        moved = self._top[:, :2] - self._home
        own, parts = np.ones(count), []
        for axis in (0, 1):
            back = -np.sign(moved[:, axis]).astype(np.int64)
            row = elements.rows + 1 + (back if axis == 1 else 0)
            beside = number[row, elements.cols + 1 + (back if axis == 0 else 0)]
            some = (beside >= 0) & (back != 0)
            apart = np.abs(self._top[beside[some], axis] - self._top[some, axis])
            share = np.abs(moved[some, axis]) / apart
            own[some] -= share
            parts.append((share, itself[some], beside[some]))
        parts.append((own, itself, itself))
        values, rows, columns = (np.concatenate(each) for each in zip(*parts, strict=True))
        return csr_matrix((values, (rows, columns)), shape=(count, count))

    @property
    def shape(self) -> tuple[int, int]:
        """Number of rows and columns of the grid."""
        return len(self.y), len(self.x)

    @cached_property
    def _between(self) -> tuple[FloatArray, FloatArray]:
        """Return matrices (points, columns) of the cubic splines along x and y through values at
        the columns, at the points of the grid.
        """
        from scipy.interpolate import CubicSpline  # slow to import

        along_x, along_y = (
            CubicSpline(nodes, np.eye(len(nodes)))(points)
            for nodes, points in ((self.columns.x, self.x), (self.columns.y, self.y))
        )
        return along_x, along_y

    @cached_property
    def _fade(self) -> FloatArray:
        """Return weights (rows, columns), the share of the difference inside and falling to 0 at
        the rim of the grid.
        """
        width = max(TAPER * self.thickness / self.columns.pitch, 1.0)
        shares = [
            np.clip(np.minimum(np.arange(n), n - 1 - np.arange(n)) / width, 0.0, 1.0)
            for n in self.shape
        ]
        smooth = [s * s * (3.0 - 2.0 * s) for s in shares]
        return np.asarray(self._share * smooth[0][:, None] * smooth[1])

    def _beside_into(self, new: IntArray) -> FloatArray:
        """Return the normal displacement (columns, new) by new sources, minus the flat layer's."""
        moved = self._in_frame(
            point_load.displacements(self._offsets(self._top, new), self._nu), new
        )
        upright = -self._inward[:, 2]
        into = np.einsum("sni,ni->ns", moved, self._inward) / upright[:, None]
        source = self._sources[new]
        apart = np.hypot(*np.moveaxis(self._apart(new), 2, 0))
        itself = np.arange(len(self._top))[:, None] == source
        flat = (1.0 - self._nu) / (2.0 * np.pi) / np.where(itself, np.inf, apart)
        far = np.minimum(apart / self.thickness, FARTHEST)
        flat = flat + layer_correction(far, self._nu) / self.thickness
        # The layer is loaded with the component of the force along its own normal.
        return np.asarray(np.where(itself, 0.0, into) - flat * upright[source])

    def _apart(self, new: IntArray) -> FloatArray:
        """Return vectors (columns, new, 2), mm, from sources to columns in the tangent plane."""
        at = self._top[:, :2]
        return np.asarray(at[:, None] - at[None, self._sources[new]])

    def _offsets(self, points: FloatArray, new: IntArray) -> FloatArray:
        """Return points (new, n, 3), mm, in the frame of each source's half-space."""
        return (points - self._top[self._sources[new]][:, None]) @ self._frames[new]

    def _in_frame(self, vectors: FloatArray, new: IntArray) -> FloatArray:
        """Transform vectors (new, n, 3) from the frames of the sources to the contact's frame."""
        return np.asarray(vectors @ np.swapaxes(self._frames[new], 1, 2))

    @cached_property
    def _frames(self) -> FloatArray:
        """Return the axes (sources, 3, 3) of the half-spaces as columns: two along, one inward."""
        z = self._inward[self._sources]
        x = np.array([1.0, 0.0, 0.0]) - z[:, :1] * z
        x /= np.linalg.norm(x, axis=1, keepdims=True)
        return np.stack([x, np.cross(z, x), z], axis=2)

    def _right_side(self, axis: int, new: IntArray) -> FloatArray:
        """Return the right sides (free, new) that cancel the half-spaces' displacements on the
        base, and their stresses on free faces, by forces along an axis of new sources' frames.
        """
        elements = self._elements
        moved = point_load.displacements(self._offsets(elements.fixed, new), self._nu, axis)
        push = self._tractions(axis, new, elements.points, elements.normals)
        kept = self._tractions(axis, new, elements.supports, elements.support_normals)
        missing = self._frames[new, :, axis] + push.sum(axis=1) + kept.sum(axis=1)
        return (
            elements.held_back(self._in_frame(moved, new))
            - elements.pushed(push.reshape(len(push), -1, 4, 3))
            + elements.at_skin(self._sources[new], missing)
        )

    def _tractions(
        self, axis: int, new: IntArray, points: FloatArray, normals: FloatArray
    ) -> FloatArray:
        """Return the forces (new, n, 3) of the half-spaces on Gauss points (faces, 4, 3) of faces,
        with outward normals (faces, 4, 3) times each point's share of the area.
        """
        offsets = self._offsets(points.reshape(-1, 3), new)
        out = normals.reshape(-1, 3) @ self._frames[new]
        push = self._in_frame(point_load.tractions(offsets, out, self._nu, axis), new)
        push[(offsets**2).sum(axis=2) < (BLIND * self.columns.pitch) ** 2] = 0.0
        return push

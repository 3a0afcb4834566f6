"""Corrections of a flat layer's response for the shape of the gel, by finite elements around a
contact.

A flat layer's response (`layer`) is exact if the gel is flat, of uniform thickness, and wide. For
other gels the response is the sum of that of a half-space in the tangent plane of each load, which
contains the singularity, and a smooth remainder. The remainder is a displacement field of the gel
without a load on the contact: it cancels the half-space's displacements on the base, and its
stresses on free faces. Linear hexahedra with few elements through the thickness resolve it.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from optisense.mechanics import point_load
from optisense.mechanics.gel_columns import LAYERS, GelColumns
from optisense.mechanics.hexahedra import face_points, stiffnesses
from optisense.mechanics.layer import FARTHEST, layer_correction, surface_displacement
from optisense.mechanics.point_load import INTO

if TYPE_CHECKING:
    from scipy.sparse import csc_matrix

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

TAPER = 1.0
"""Distance, in thicknesses, over which the correction falls to 0 at the rim of the modelled
region."""
BLIND = 0.5
"""Distance from a load, in pitches, below which its stresses on the skin are neglected, as the
facets are not known more finely."""


class GelPatch:
    """The difference of the response of the gel around one contact from that of a flat layer.

    The stiffness matrix is factorised once; each pressure then takes one solution.
    """

    def __init__(
        self,
        columns: GelColumns,
        loaded: tuple[float, float],
        thickness: float,
        poisson_ratio: float,
    ) -> None:
        """Set up the elements.

        Args:
            columns: the columns of the gel.
            loaded: half sides (mm) of the rectangle in which loads lie.
            thickness: thickness (mm) of the flat layer to which the response is compared.
            poisson_ratio: Poisson's ratio of the gel.
        """
        self.columns, self._thickness, self._nu = columns, thickness, poisson_ratio
        rows, cols = np.nonzero(columns.solid)
        self._number = np.full(columns.solid.shape, -1)
        self._number[rows, cols] = np.arange(len(rows))
        share = np.arange(LAYERS + 1) / LAYERS
        self._top = columns.top[rows, cols]
        self._inward = columns.inward[rows, cols]
        length = columns.length[rows, cols]
        down = share[None, :, None] * length[:, None, None] * self._inward[:, None]
        self._nodes = (self._top[:, None] + down).reshape(-1, 3)
        self._fixed = np.zeros((len(rows), LAYERS + 1), dtype=bool)
        self._fixed[:, -1] = True
        self._fixed[columns.held[rows, cols]] = True
        room = np.array(loaded) + columns.pitch
        self._sources = np.flatnonzero((np.abs(self._top[:, :2]) <= room).all(axis=1))
        self._known_sides: dict[int, FloatArray] = {}
        self._known_beside: dict[int, FloatArray] = {}

    def correction(self, force: FloatArray) -> FloatArray:
        """Return the displacement beyond that of a flat layer, along the normal of the tangent
        plane.

        Args:
            force: (rows, columns) force on each column along this normal, N over the shear modulus
                in MPa.

        Returns:
            The displacement (rows, columns) into the gel, mm.
        """
        loads = self._on_sources(force[None])[0] / -self._inward[self._sources, 2]
        rest = self._solve(self._right_sides(INTO) @ loads)
        upright = -self._inward[:, 2]
        inside = np.einsum("ci,ci->c", rest, self._inward) / upright
        return self._on_grid(inside + self._beside @ loads)

    def sideways(self, force: FloatArray) -> FloatArray:
        """Return the displacement beyond that of a flat layer, along the tangent plane.

        Args:
            force: (3, rows, columns) forces on each column along x and y of the contact's frame and
                into the gel, N over the shear modulus in MPa. The forces along x and y act along
                the skin, the others along its normals.

        Returns:
            The displacement (2, rows, columns) along x and y, mm.
        """
        given = self._on_sources(force)
        normals = self._inward[self._sources]
        along = np.column_stack([given[0], given[1], np.zeros(len(normals))])
        along[:, 2] = -(along * normals).sum(axis=1) / normals[:, 2]
        loads = np.einsum("si,sik->ks", along, self._frames)
        loads[INTO] = given[2] / -normals[:, 2]
        axes = [axis for axis in range(3) if loads[axis].any()]
        if not axes:
            return np.zeros((2, *self.columns.solid.shape))
        rest = self._solve(np.sum([self._right_sides(a) @ loads[a] for a in axes], axis=0))
        beside = np.sum([self._beside_along(a) @ loads[a] for a in axes], axis=0)
        return np.stack([self._on_grid(each) for each in rest[:, :2].T + beside])

    def _beside_along(self, axis: int) -> FloatArray:
        """Return the displacement (2, columns, sources) along x and y of the half-spaces minus that
        of the flat layer.

        Args:
            axis: axis of the forces in the frames of the sources.
        """
        if axis not in self._known_beside:
            moved = self._in_frame(
                point_load.displacements(self._offsets(self._top), self._nu, axis)
            )
            x, y = np.moveaxis(self._apart, 2, 0) / self._thickness
            moved[((x == 0.0) & (y == 0.0)).T] = 0.0
            # The flat layer is loaded with the components of the forces along its own normal.
            share = self._frames[:, :, axis].T.copy()
            share[slice(0, 2) if axis == INTO else 2] = 0.0
            share[2] = -share[2]
            flat = surface_displacement(x, y, self._nu) / self._thickness
            into = np.einsum("kacs,as->kcs", flat, share)
            self._known_beside[axis] = np.transpose(moved[:, :, :2], (2, 1, 0)) - into
        return self._known_beside[axis]

    def _on_grid(self, values: FloatArray) -> FloatArray:
        """Return values (columns,) on the grid (rows, columns): the nearest column's where there is
        none, and 0 at the rim.
        """
        result = np.zeros(self.columns.solid.shape)
        result[self.columns.solid] = values
        nearest = ndimage.distance_transform_edt(
            ~self.columns.solid, return_distances=False, return_indices=True
        )
        return np.asarray(result[tuple(nearest)] * self._fade)

    def _on_sources(self, force: FloatArray) -> FloatArray:
        """Return forces (n, rows, columns) on the sources (n, sources); forces beside columns act
        on the nearest.
        """
        from scipy.spatial import cKDTree

        rows, cols = np.nonzero(force.any(axis=0))
        points = np.column_stack([self.columns.x[cols], self.columns.y[rows]])
        _, nearest = cKDTree(self._top[self._sources, :2]).query(points)
        loads = np.zeros((len(force), len(self._sources)))
        for one, given in zip(loads, force, strict=True):
            np.add.at(one, nearest, given[rows, cols])
        return loads

    @cached_property
    def _fade(self) -> FloatArray:
        """Return weights (rows, columns), 1 inside and falling to 0 at the rim of the grid."""
        width = max(TAPER * self._thickness / self.columns.pitch, 1.0)
        shares = [
            np.clip(np.minimum(np.arange(n), n - 1 - np.arange(n)) / width, 0.0, 1.0)
            for n in self.columns.solid.shape
        ]
        smooth = [s * s * (3.0 - 2.0 * s) for s in shares]
        return np.asarray(smooth[0][:, None] * smooth[1])

    @cached_property
    def _beside(self) -> FloatArray:
        """Return the normal displacement (columns, sources) of the half-spaces minus that of the
        flat layer.
        """
        offsets = self._offsets(self._top)
        moved = self._in_frame(point_load.displacements(offsets, self._nu))
        upright = -self._inward[:, 2]
        into = np.einsum("sni,ni->ns", moved, self._inward) / upright[:, None]
        source = self._sources
        apart = np.hypot(*np.moveaxis(self._apart, 2, 0))
        itself = np.arange(len(self._top))[:, None] == source
        flat = (1.0 - self._nu) / (2.0 * np.pi) / np.where(itself, np.inf, apart)
        far = np.minimum(apart / self._thickness, FARTHEST)
        flat = flat + layer_correction(far, self._nu) / self._thickness
        # The layer is loaded with the component of the force along its own normal.
        return np.asarray(np.where(itself, 0.0, into) - flat * upright[source])

    @property
    def _apart(self) -> FloatArray:
        """Return vectors (columns, sources, 2), mm, from sources to columns in the tangent
        plane.
        """
        at = self._top[:, :2]
        return np.asarray(at[:, None] - at[None, self._sources])

    def _offsets(self, points: FloatArray) -> FloatArray:
        """Return points (sources, n, 3), mm, in the frame of each source's half-space."""
        return np.einsum(
            "snk,ski->sni", points[None] - self._top[self._sources][:, None], self._frames
        )

    def _in_frame(self, vectors: FloatArray) -> FloatArray:
        """Transform vectors (sources, n, 3) from the frames of the sources' half-spaces to the
        contact's frame.
        """
        return np.einsum("sni,ski->snk", vectors, self._frames)

    @cached_property
    def _frames(self) -> FloatArray:
        """Return the axes (sources, 3, 3) of the half-spaces, as columns: two along the skin, and
        one into the gel.
        """
        z = self._inward[self._sources]
        x = np.array([1.0, 0.0, 0.0]) - z[:, :1] * z
        x /= np.linalg.norm(x, axis=1, keepdims=True)
        return np.stack([x, np.cross(z, x), z], axis=2)

    @cached_property
    def _cells(self) -> IntArray:
        """Return the columns (cells, 4) at the corners of each cell, x running first."""
        n = self._number
        corners = np.stack([n[:-1, :-1], n[:-1, 1:], n[1:, :-1], n[1:, 1:]], axis=2)
        return corners[self.columns.cells]

    @cached_property
    def _elements(self) -> IntArray:
        """Return the nodes (elements, 8) of each element: the lower four, then the upper four."""
        base = self._cells[:, None, :] * (LAYERS + 1) + np.arange(LAYERS)[None, :, None]
        return np.concatenate([base + 1, base], axis=2).reshape(-1, 8)

    @cached_property
    def _matrix(self) -> csc_matrix:
        from scipy.sparse import coo_matrix

        elements = self._elements
        values = stiffnesses(self._nodes[elements], self._nu)
        freedom = (3 * elements[:, :, None] + np.arange(3)).reshape(-1, 24)
        rows, columns = np.repeat(freedom, 24, axis=1), np.tile(freedom, (1, 24))
        size = 3 * len(self._nodes)
        return coo_matrix(
            (values.ravel(), (rows.ravel(), columns.ravel())), shape=(size, size)
        ).tocsc()

    @cached_property
    def _free(self) -> IntArray:
        return np.flatnonzero(np.repeat(~self._fixed.ravel(), 3))

    @cached_property
    def _factor(self) -> Any:
        from scipy.sparse.linalg import splu

        inner = self._matrix[self._free][:, self._free].tocsc()
        return splu(
            inner,
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )

    def _solve(self, right_side: FloatArray) -> FloatArray:
        """Return the displacements (columns, 3) of the skin; 0 for columns that are fixed."""
        moved = np.zeros(3 * len(self._nodes))
        moved[self._free] = self._factor.solve(right_side)
        return np.asarray(moved.reshape(-1, LAYERS + 1, 3)[:, 0])

    def _right_sides(self, axis: int) -> FloatArray:
        """Return the right sides (free, sources) that cancel the half-spaces' fields on the base
        and on free faces.

        Args:
            axis: axis of the forces in the frames of the sources.
        """
        if axis in self._known_sides:
            return self._known_sides[axis]
        fixed = np.flatnonzero(self._fixed.ravel())
        moved = self._in_frame(
            point_load.displacements(self._offsets(self._nodes[fixed]), self._nu, axis)
        )
        columns = (3 * fixed[:, None] + np.arange(3)).ravel()
        coupling = self._matrix[self._free][:, columns]
        result = coupling @ moved.reshape(len(moved), -1).T
        loads = np.zeros((3 * len(self._nodes), len(self._sources)))
        for corners, outward_sign in (self._skin_faces(), self._side_faces()):
            self._cancel(loads, corners, outward_sign, axis)
        self._known_sides[axis] = np.asarray(result + loads[self._free])
        return self._known_sides[axis]

    def _skin_faces(self) -> tuple[IntArray, FloatArray]:
        """Return the nodes (faces, 4) of the skin's faces, and the signs that turn their normals
        outward.
        """
        return self._cells * (LAYERS + 1), np.ones(len(self._cells))

    def _side_faces(self) -> tuple[IntArray, FloatArray]:
        """Return the nodes (faces, 4) of the free sides of the gel, and the signs that turn their
        normals outward.
        """
        cells = self._cells
        held = self._fixed[:, 0]
        found, signs = [], []
        # Corners of a side along its run, and the sign that makes run x up point outward.
        for one, other, sign in ((0, 1, 1.0), (2, 3, -1.0), (0, 2, -1.0), (1, 3, 1.0)):
            pairs = cells[:, [one, other]]
            opposite = {(0, 1): (2, 3), (2, 3): (0, 1), (0, 2): (1, 3), (1, 3): (0, 2)}[one, other]
            beyond = set(map(tuple, cells[:, list(opposite)].tolist()))
            free = [
                k
                for k, pair in enumerate(map(tuple, pairs.tolist()))
                if pair not in beyond and not held[list(pair)].all()
            ]
            found.append(pairs[free])
            signs.append(np.full(len(free), sign))
        runs, sign_of = np.concatenate(found), np.concatenate(signs)
        base = runs[:, None, :] * (LAYERS + 1) + np.arange(LAYERS)[None, :, None]
        nodes = np.concatenate([base + 1, base], axis=2).reshape(-1, 4)
        return nodes, np.repeat(sign_of, LAYERS)

    def _cancel(self, loads: FloatArray, faces: IntArray, signs: FloatArray, axis: int) -> None:
        """Add the forces that cancel the half-spaces' stresses on faces."""
        if not len(faces):
            return
        points, normals, weights = face_points(self._nodes[faces])
        normals = normals * signs[:, None, None]
        offsets = self._offsets(points.reshape(-1, 3))
        stress = point_load.stresses(offsets, self._nu, axis)
        out = np.einsum("nk,ski->sni", normals.reshape(-1, 3), self._frames)
        push = self._in_frame(np.einsum("snij,snj->sni", stress, out))
        blind = np.linalg.norm(offsets, axis=2) < BLIND * self.columns.pitch
        push[blind] = 0.0
        shared = np.einsum(
            "sfgi,ga->fasi", push.reshape(len(push), len(faces), 4, 3), weights, optimize=True
        )
        for axis in range(3):
            np.add.at(loads, 3 * faces.ravel() + axis, -shared[..., axis].reshape(-1, len(push)))

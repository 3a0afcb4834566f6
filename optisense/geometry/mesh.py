"""Triangle meshes, the shape type of all other packages."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from optisense.array_types import FloatArray
from optisense.errors import MeshError
from optisense.geometry._grid_welding import WELD_DISTANCE, welded
from optisense.geometry.mesh_files import obj_text, read_mesh

IntArray = NDArray[np.int32]

_BOX_SIDES = (  # (axis across the side, the two axes in it, which end of the axis)
    (2, 0, 1, 1), (2, 1, 0, 0), (0, 1, 2, 1), (0, 2, 1, 0), (1, 2, 0, 1), (1, 0, 2, 0),
)  # fmt: skip
"""The six sides of a box: the axis across the side, the two axes in it, and the end of the axis at
which it lies."""

_ROWS = {
    "vertices": "Give x, y and z of a vertex in each row",
    "faces": "Give the numbers of three vertices in each row; split quads into triangles",
    "normals": "Give x, y and z of a normal in each row",
}
"""The remedy for an array of a mesh that has not three numbers in each row."""


@dataclass(frozen=True, eq=False)
class TriangleMesh:
    """An indexed triangle mesh, open or closed, in mm.

    Faces wind counter-clockwise seen from the side their normal points to. Nothing is
    checked on construction beyond the shapes of the arrays and that faces are whole numbers; see
    `validate`. A mesh never changes: its arrays are read-only, and arrays that can be written to
    are copied when it is made.

    Attributes:
        vertices: (n, 3) float64, mm.
        faces: (m, 3) int32, rows of `vertices`.
        normals: (n, 3) float64 unit shading normals of the vertices, or None.
        rest: the same faces before they were deformed, whose creases remain sharp; None if they
            were not. It is not compared.

    Raises:
        MeshError: an array has another shape (one without elements may have any), or a face is not
            of whole numbers.
    """

    vertices: FloatArray
    faces: IntArray
    normals: FloatArray | None = None
    rest: TriangleMesh | None = None

    def __post_init__(self) -> None:
        self._fix("vertices", np.float64)
        self._fix("faces", np.int32)
        if self.normals is not None:
            self._fix("normals", np.float64)
            if len(self.normals) != len(self.vertices):
                raise MeshError(
                    f"a mesh has {len(self.vertices)} vertices but {len(self.normals)} normals",
                    hint="Give one normal for each vertex, or none",
                )

    def _fix(self, name: str, dtype: type[np.generic]) -> None:
        """Make a field a read-only array (n, 3), which is a copy unless it can't be written to;
        raise MeshError if it has another shape or is not of whole numbers for a `dtype` of these.
        """
        try:
            given = np.asarray(getattr(self, name))
            with np.errstate(invalid="ignore"):
                array = given.astype(dtype, copy=not _is_fixed(given))
        except (TypeError, ValueError, OverflowError):  # rows of different lengths, or no numbers
            problem = "are not rows of numbers"
        else:
            array.setflags(write=False)
            if array.size and array.shape[1:] != (3,):
                problem = f"have the shape {array.shape}, not (n, 3)"
            elif dtype is np.int32 and not np.array_equal(array, given):
                problem = "are not whole numbers"
            else:
                object.__setattr__(self, name, array.reshape(-1, 3))
                return
        raise MeshError(f"the {name} of a mesh {problem}", hint=_ROWS[name])

    def __deepcopy__(self, memo: object) -> TriangleMesh:
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the arrays alone; they are read-only again when the mesh is made of them."""
        return TriangleMesh, (self.vertices, self.faces, self.normals, self.rest)

    # ---- making

    @staticmethod
    def load(path: str | Path) -> TriangleMesh:
        """Read an OBJ, STL or PLY file (its numbers are taken as mm).

        Raises:
            MeshError: the file is missing, of another format, or malformed.
        """
        return TriangleMesh(*read_mesh(Path(path)))

    @staticmethod
    def box(
        lower: ArrayLike, upper: ArrayLike, divisions: tuple[int, int, int] = (1, 1, 1)
    ) -> TriangleMesh:
        """Return a closed box, each side of which is divided into a grid.

        Args:
            lower, upper: (3,) corners of the box, mm.
            divisions: number of cells along x, y and z.
        """
        corners = np.array([lower, upper], dtype=np.float64)
        sides = []
        for across, first, second, end in _BOX_SIDES:
            side = TriangleMesh.grid((1.0, 1.0), (divisions[first], divisions[second]))
            points = np.empty_like(side.vertices)
            points[:, across] = corners[end, across]
            for axis, column in ((first, 0), (second, 1)):
                fraction = side.vertices[:, column] + 0.5
                points[:, axis] = (1.0 - fraction) * corners[0, axis] + fraction * corners[1, axis]
            sides.append(TriangleMesh(points, side.faces))
        return TriangleMesh.joined(sides).welded()

    @staticmethod
    def grid(
        size: tuple[float, float], divisions: tuple[int, int] = (1, 1), height: float = 0.0
    ) -> TriangleMesh:
        """Return a flat rectangle around the z axis whose normal is +z.

        Args:
            size: sides along x and y, mm.
            divisions: number of cells along x and y.
            height: z of the rectangle, mm.
        """
        nx, ny = divisions
        x = np.linspace(-0.5, 0.5, nx + 1) * size[0]
        y = np.linspace(-0.5, 0.5, ny + 1) * size[1]
        xx, yy = np.meshgrid(x, y, indexing="ij")
        vertices = np.column_stack([xx.ravel(), yy.ravel(), np.full(xx.size, height)])
        return TriangleMesh(vertices, grid_faces(nx + 1, ny + 1))

    @staticmethod
    def joined(meshes: list[TriangleMesh]) -> TriangleMesh:
        """Return all meshes as one, without welding; normals are kept if every mesh has them."""
        offsets = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes[:-1]])
        normals = [mesh.normals for mesh in meshes if mesh.normals is not None]
        return TriangleMesh(
            np.concatenate([mesh.vertices for mesh in meshes]),
            np.concatenate([m.faces + o for m, o in zip(meshes, offsets, strict=True)]),
            np.concatenate(normals) if len(normals) == len(meshes) else None,
            None
            if all(mesh.rest is None for mesh in meshes)
            else TriangleMesh.joined([mesh.rest or mesh for mesh in meshes]),
        )

    def save_obj(self, path: str | Path) -> None:
        """Write a Wavefront OBJ file; every coordinate survives the round trip."""
        Path(path).write_text(obj_text(self), encoding="ascii")

    # ---- measuring

    @cached_property
    def bounds(self) -> FloatArray:
        """Lowest and highest corner (2, 3) float64, mm."""
        return np.array([self.vertices.min(axis=0), self.vertices.max(axis=0)])

    @cached_property
    def triangles(self) -> FloatArray:
        """Corners of the faces (m, 3, 3) float64, mm: face, corner, coordinate."""
        return self.vertices[self.faces]

    @cached_property
    def face_bounds(self) -> tuple[FloatArray, FloatArray]:
        """Lowest and highest corners of the faces' boxes, (m, 3) float64 each, mm."""
        a, b, c = (self.vertices[self.faces[:, corner]] for corner in range(3))
        return np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)

    @cached_property
    def face_spheres(self) -> tuple[FloatArray, FloatArray]:
        """Centres (m, 3), mm, and squares of the radii (m,), mm^2, of spheres around the faces."""
        a, b, c = (self.vertices[self.faces[:, corner]] for corner in range(3))
        middle = (a + b + c) / 3.0
        square = [np.einsum("mi,mi->m", each - middle, each - middle) for each in (a, b, c)]
        return middle, np.maximum(np.maximum(square[0], square[1]), square[2])

    @cached_property
    def face_vectors(self) -> FloatArray:
        """Face normals times twice the face areas, (m, 3) float64, mm^2."""
        a, b, c = self.triangles[:, 0], self.triangles[:, 1], self.triangles[:, 2]
        return np.cross(b - a, c - a)

    @cached_property
    def face_areas(self) -> FloatArray:
        """Face areas (m,) float64, mm^2."""
        areas: FloatArray = 0.5 * np.linalg.norm(self.face_vectors, axis=1)
        return areas

    @cached_property
    def face_normals(self) -> FloatArray:
        """Unit face normals (m, 3) float64; zero for a degenerate face."""
        length = np.linalg.norm(self.face_vectors, axis=1, keepdims=True)
        return np.divide(
            self.face_vectors, length, out=np.zeros_like(self.face_vectors), where=length > 0
        )

    @cached_property
    def area(self) -> float:
        """The surface area, mm^2."""
        return float(self.face_areas.sum())

    @cached_property
    def volume(self) -> float:
        """The signed volume (mm^3) of a closed mesh; positive when its faces look outward."""
        corners = self.triangles
        return float(np.einsum("ij,ij->", corners[:, 0], self.face_vectors) / 6.0)

    @cached_property
    def edges(self) -> tuple[IntArray, NDArray[np.int64]]:
        """The edges (n, 2) by their vertices, ascending, and the number (n,) of faces of each."""
        sides, order = self._sorted_sides
        ascending = sides[order]
        first = np.flatnonzero(np.diff(ascending, prepend=-1) != 0)
        ends = np.divmod(ascending[first], len(self.vertices))
        return np.column_stack(ends).astype(np.int32), np.diff(first, append=len(ascending))

    @cached_property
    def _sorted_sides(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """A number (3 m,) for the side after each corner of the faces, the lower of its vertices
        times n plus the higher one, and the order (3 m,) of these numbers.
        """
        # Single numbers sort ten times faster than pairs.
        starts, ends = self.faces.ravel().astype(np.int64), self.faces[:, [1, 2, 0]].ravel()
        sides = np.minimum(starts, ends) * len(self.vertices) + np.maximum(starts, ends)
        return sides, np.argsort(sides, kind="stable")

    @cached_property
    def open_edges(self) -> IntArray:
        """The edges (n, 2) that belong to a single face, by their vertices."""
        edges, times = self.edges
        return edges[times == 1]

    @cached_property
    def is_closed(self) -> bool:
        """Whether each edge is traversed equally often in both directions."""
        from optisense.geometry._mesh_checks import unmatched_edges

        return len(self.faces) > 0 and len(unmatched_edges(self.welded())) == 0

    def equals(self, other: TriangleMesh) -> bool:
        """Return whether two meshes have equal arrays; `==` asks whether they are one object."""
        arrays = ((each.vertices, each.faces, each.normals) for each in (self, other))
        return self is other or all(map(_equal, *arrays))

    def validate(self, name: str, closed: bool) -> TriangleMesh:
        """Check the mesh of part `name` and return it, turned outward when `closed`.

        Raises:
            MeshError: no triangles, a coordinate that is not finite, a face that names a
                missing vertex, or (`closed`) an open edge; the message says where.
        """
        from optisense.geometry._mesh_checks import validate

        return validate(self, name, closed)

    # ---- changing

    def transformed(self, matrix: ArrayLike) -> TriangleMesh:
        """Return the mesh after a (4, 4) or (3, 3) matrix, mm; a mirroring one turns faces over."""
        full = np.eye(4)
        given = np.asarray(matrix, dtype=np.float64)
        full[: given.shape[0], : given.shape[1]] = given
        linear = full[:3, :3]
        same = self if np.linalg.det(linear) > 0 else replace(self, normals=None).flipped()
        normals = None
        if self.normals is not None:
            normals = self.normals @ np.linalg.inv(linear)
            normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        return replace(same, vertices=self.vertices @ linear.T + full[:3, 3], normals=normals)

    def with_vertices(self, vertices: FloatArray) -> TriangleMesh:
        """Return a new shape of the same faces, with vertices (n, 3), mm; shading normals are
        dropped.
        """
        return TriangleMesh(vertices, self.faces)

    def deformed(self, vertices: FloatArray) -> TriangleMesh:
        """Return the mesh with its vertices moved to (n, 3), mm; shading normals are dropped, and
        edges at which they differ, or else creases, remain sharp however the faces beside them
        bend.
        """
        return TriangleMesh(vertices, self.faces, rest=self.rest or self._as_rest)

    def with_faces(self, faces: NDArray[Any]) -> TriangleMesh:
        """Return other faces (k, 3) with the same vertices and normals."""
        rest = None if self.rest is None else self.rest.with_faces(faces)
        return replace(self, faces=faces, rest=rest)

    def compacted(self) -> TriangleMesh:
        """Return the mesh without unused vertices."""
        used, inverse = np.unique(self.faces, return_inverse=True)
        faces = inverse.reshape(-1, 3).astype(np.int32)
        normals = None if self.normals is None else self.normals[used]
        rest = None if self.rest is None else self.rest.compacted()
        return TriangleMesh(self.vertices[used], faces, normals, rest)

    def flipped(self) -> TriangleMesh:
        """Return the same surface with opposite face normals."""
        normals = None if self.normals is None else -self.normals
        return replace(self.with_faces(self.faces[:, ::-1]), normals=normals)

    def welded(self, distance: float = WELD_DISTANCE) -> TriangleMesh:
        """Return the mesh with vertices that agree to `distance` (mm) merged, and without faces
        that collapse.

        Shading normals are dropped; `rest` is welded alike.
        """
        kept, faces = welded(self.vertices, self.faces, distance)
        rest = None if self.rest is None else TriangleMesh(self.rest.vertices[kept], faces)
        return TriangleMesh(self.vertices[kept], faces, rest=rest)

    def with_winding_from_normals(self) -> TriangleMesh:
        """Return the mesh with the faces reversed whose normals oppose their shading normals."""
        if self.normals is None:
            return self
        shading = self.normals[self.faces].sum(axis=1)
        wrong = np.einsum("ij,ij->i", shading, self.face_vectors) < 0.0
        return self.with_faces(np.where(wrong[:, None], self.faces[:, ::-1], self.faces))

    def vertex_normals(self) -> TriangleMesh:
        """Return the mesh with smooth shading normals, kept apart across edges of more than 40
        degrees and across creases: edges at which its own normals differ or, without these, bends
        between flat faces; see `_creases`.

        Vertices are split where their corners disagree; see `shading_normals`.
        """
        return self._smooth

    @cached_property
    def _as_rest(self) -> TriangleMesh:
        """A copy, so that deformed meshes keep no reference to a mesh that is no longer used:
        caches by mesh, which hold deformed ones, would never be freed.
        """
        return replace(self)

    @cached_property
    def _divided(self) -> tuple[NDArray[np.integer], NDArray[np.integer]]:
        """Faces (m, 3) whose vertices are divided along creases, and the number (k,) in `vertices`
        of each of these. With shading normals, creases are where these differ.
        """
        from optisense.geometry._creases import divided_at_creases, divided_by_normals

        if self.rest is not None:
            return self.rest._divided
        return divided_at_creases(self) if self.normals is None else divided_by_normals(self)

    @cached_property
    def _smooth(self) -> TriangleMesh:
        from optisense.geometry.shading_normals import smooth_corners

        vertex, faces, normals = smooth_corners(self)
        return TriangleMesh(self.vertices[vertex], faces, normals)


def _is_fixed(array: NDArray[Any]) -> bool:
    """Return whether neither an array nor one that it is a view of can be written to."""
    if array.flags.writeable:
        return False
    return array.base is None or (isinstance(array.base, np.ndarray) and _is_fixed(array.base))


def _equal(one: NDArray[Any] | None, other: NDArray[Any] | None) -> bool:
    return one is other or (one is not None and other is not None and np.array_equal(one, other))


def grid_faces(rows: int, columns: int) -> IntArray:
    """Return two triangles for each cell of a grid of vertices that are numbered row by row, as an
    array (m, 3) int32 with m = 2 (rows - 1) (columns - 1).

    Face normals point along (row direction) x (column direction).
    """
    index = np.arange(rows * columns, dtype=np.int32).reshape(rows, columns)
    a, b = index[:-1, :-1].ravel(), index[1:, :-1].ravel()
    c, d = index[1:, 1:].ravel(), index[:-1, 1:].ravel()
    return np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])

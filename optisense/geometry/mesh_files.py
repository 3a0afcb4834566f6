"""Reading OBJ, STL and PLY files; writing OBJ.

OBJ is parsed here (positions, faces and per-vertex normals only), so that line numbers can be
named and material files are never opened; STL and PLY go through trimesh.
"""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from optisense.errors import MeshError
from optisense.geometry._grid_welding import WELD_DISTANCE, first_faces, welded
from optisense.untrusted_files import MOST_MESH, read_bytes

if TYPE_CHECKING:
    from optisense.geometry.mesh import TriangleMesh

FORMATS = (".obj", ".stl", ".ply")

FARTHEST = 1e9
"""Largest coordinate in a file, in any unit: a kilometre in micrometres."""

MOST_TRIANGLES = 1_000_000
"""Largest number of triangles of one file; the built-in sensors have at most 25,000 in a part."""

MOST_TWICE = 1000
"""Largest number of duplicate faces in a file. Some programs write a few; rays meet each of them,
so that more are an error of the export."""

MOST_CORNERS = 10_000
"""Largest number of corners of one face in a file, so that a malformed one is not triangulated for
minutes; CAD programs write faces of a few hundred."""


class MeshArrays(NamedTuple):
    """The content of a mesh file, from which `TriangleMesh.load` makes a mesh.

    Attributes:
        vertices: (n, 3) float64, in the unit of the file.
        faces: (m, 3) rows of `vertices`.
        normals: (n, 3) normals of the vertices, or None.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    normals: NDArray[np.float64] | None = None


def read_mesh(path: Path) -> MeshArrays:
    """Return the vertices (n, 3), faces (m, 3) and normals of a mesh file.

    Raises:
        MeshError: the file is missing, of another format, or malformed.
    """
    suffix = path.suffix.lower()
    if suffix not in FORMATS:
        raise MeshError(
            f"a mesh of type '{suffix or 'unknown'}' cannot be read",
            where=str(path),
            hint="Use one of " + ", ".join(FORMATS),
        )
    data = read_bytes(path, MOST_MESH, MeshError, "the mesh file")
    if suffix == ".obj":
        _refuse_many(data.count(b"\nf "), path)  # each face has at least one triangle
        mesh = _parse_plain_obj(data) or _parse_obj(data, path)
    else:
        if suffix == ".stl":
            _refuse_cut_off_stl(data, path)
        mesh = _load_with_trimesh(data, path, suffix)
    _refuse_many(len(mesh.faces), path)
    _refuse_unknown_vertices(mesh.faces, len(mesh.vertices), path)
    far = np.abs(mesh.vertices).max(axis=1, initial=0.0)
    if (far[np.isfinite(far)] > FARTHEST).any():
        number = int(np.flatnonzero((far > FARTHEST) & np.isfinite(far))[0])
        raise MeshError(
            f"vertex {number + 1} is {far[number]:g} away from the origin",
            where=str(path),
            hint="Check the unit of the file, or export it again",
        )
    apart = mesh.normals is None and len(mesh.vertices) == 3 * len(mesh.faces)
    if apart and np.isfinite(far).all():  # as in all STL files, which have no common vertices
        kept, faces = welded(mesh.vertices, mesh.faces, WELD_DISTANCE)
        if len(mesh.faces) and not len(faces):
            raise MeshError(
                f"all triangles of the mesh collapse: they are smaller than {WELD_DISTANCE:g}",
                where=str(path),
                hint="Check the unit of the file, or export it again",
            )
        mesh = MeshArrays(mesh.vertices[kept], faces)
    if len(mesh.faces) == 0:
        raise MeshError(
            "the mesh file has no triangles", where=str(path), hint="Export a surface, not points"
        )
    twice = len(mesh.faces) - len(first_faces(mesh.faces, len(mesh.vertices)))
    if twice > MOST_TWICE:
        raise MeshError(
            f"{twice:,} faces of the mesh occur more than once",
            where=str(path),
            hint="Merge duplicate faces in your modelling program and export again",
        )
    return mesh


def _refuse_many(triangles: int, path: Path) -> None:
    if triangles > MOST_TRIANGLES:
        raise MeshError(
            f"the mesh has {triangles:,} triangles; at most {MOST_TRIANGLES:,} are read",
            where=str(path),
            hint="Export it with a larger deviation, or simplify it in a modelling program",
        )


def _refuse_unknown_vertices(corners: NDArray[np.integer], count: int, path: Path) -> None:
    unknown = corners[(corners < 0) | (corners >= count)]
    if unknown.size:
        raise MeshError(
            f"a face names vertex {unknown[0] + 1}, but there are {count}",
            where=str(path),
            hint="Export the mesh again",
        )


def obj_text(mesh: TriangleMesh, name: str | None = None) -> str:
    """Return a mesh as the text of an OBJ file; every coordinate keeps all its digits.

    Args:
        mesh: the mesh, mm; its normals are written if it has any.
    """
    lines = ["# millimetres"] + ([] if name is None else [f"o {name}"])
    lines += [f"v {x!r} {y!r} {z!r}" for x, y, z in mesh.vertices.tolist()]
    faces = (mesh.faces + 1).tolist()
    if mesh.normals is None:
        lines += [f"f {a} {b} {c}" for a, b, c in faces]
    else:
        lines += [f"vn {x!r} {y!r} {z!r}" for x, y, z in mesh.normals.tolist()]
        lines += [f"f {a}//{a} {b}//{b} {c}//{c}" for a, b, c in faces]
    return "\n".join(lines) + "\n"


def _refuse_cut_off_stl(data: bytes, path: Path) -> None:
    """Refuse a truncated STL file: binary ones have 84 bytes + 50 a triangle, text endsolid."""
    ended = b"endsolid" in data.lower()
    text = data.lstrip()[:5].lower() == b"solid" and (ended or b"facet" in data[:2000].lower())
    if text:
        if not ended:
            raise MeshError(
                "the mesh file is cut off: it ends without 'endsolid'",
                where=str(path),
                hint="Export or copy it again",
            )
        _refuse_many(data.count(b"endfacet"), path)
        return
    count = int.from_bytes(data[80:84], "little") if len(data) >= 84 else 0
    if len(data) < 84 + 50 * count:
        raise MeshError(
            f"the mesh file is cut off, or is no STL file: it announces {count} triangles and has "
            f"the length of {max(len(data) - 84, 0) // 50}",
            where=str(path),
            hint="Export or copy it again",
        )
    _refuse_many(count, path)


def _load_with_trimesh(data: bytes, path: Path, suffix: str) -> MeshArrays:
    import io

    import trimesh

    try:
        loaded = trimesh.load_mesh(io.BytesIO(data), file_type=suffix[1:], process=False)
        vertices = np.asarray(loaded.vertices, dtype=np.float64).reshape(-1, 3)
        faces = np.asarray(loaded.faces, dtype=np.int32).reshape(-1, 3)
    except Exception as error:  # trimesh raises many kinds on malformed files
        raise MeshError(
            f"the mesh file is malformed: {error}", where=str(path), hint="Export it again"
        ) from error
    return MeshArrays(vertices, faces)


def _parse_plain_obj(data: bytes) -> MeshArrays | None:
    """Read a file of triangles in the form that `obj_text` and most programs write, many times
    faster than line by line.

    The result is None for any other file, which is then read line by line.
    """
    lines = data.splitlines()
    kept: dict[bytes, list[bytes]] = {b"v ": [], b"vn": [], b"f ": []}
    for line in lines:
        if (group := kept.get(line[:2])) is not None:
            group.append(line[2:])
        elif line[:1] not in (b"", b"#", b"o", b"g", b"s", b"u", b"m") and line[:3] != b"vt ":
            return None
    positions, normals, faces = kept.values()
    corners = b" ".join(faces)
    apart = b"//" in corners
    if b"\\" in data or any(b"#" in line for group in kept.values() for line in group):
        return None
    if any(len(line.split()) != 3 for group in kept.values() for line in group):
        return None
    if (
        corners.count(b"/") != 6 * len(faces) * apart
        or corners.count(b"//") != 3 * len(faces) * apart
    ):
        return None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # text that is not a number only gives a warning
            vertices, directions = (
                np.fromstring(b" ".join(rows).decode("ascii"), sep=" ").reshape(-1, 3)
                for rows in (positions, normals)
            )
            numbers = np.fromstring(
                corners.replace(b"//", b" ").decode("ascii"), dtype=np.int64, sep=" "
            ).reshape(len(faces), 3, -1)
    except (ValueError, DeprecationWarning):
        return None
    wrong = len(vertices) != len(positions) or len(directions) != len(normals) or not len(faces)
    if wrong or numbers.shape[2] != 1 + apart:
        return None
    triangles = numbers[:, :, 0]
    if triangles.min() < 1 or triangles.max() > len(vertices) or (numbers < 1).any():
        return None
    own = apart and len(normals) == len(vertices) and bool((numbers[:, :, 1] == triangles).all())
    return MeshArrays(vertices, (triangles - 1).astype(np.int32), directions if own else None)


def _parse_obj(data: bytes, path: Path) -> MeshArrays:
    positions: list[list[float]] = []
    normals: list[list[float]] = []
    polygons: list[list[int]] = []
    own_normals = True  # every corner's normal has the number of its vertex
    text = data.decode("utf-8", errors="replace")
    for number, line in enumerate(text.replace("\\\n", "  ").splitlines(), start=1):
        words = line.split("#", 1)[0].split()
        if not words or words[0] not in ("v", "vn", "f"):
            continue
        try:
            if words[0] == "f":
                corners = [_corner(word, len(positions), len(normals)) for word in words[1:]]
                own_normals &= all(vertex == normal for vertex, normal in corners)
                if len(corners) < 3:
                    raise ValueError("a face needs three corners")
                if len(corners) > MOST_CORNERS:
                    raise ValueError(f"a face of {len(corners):,} corners is not read")
                polygons.append([vertex for vertex, _ in corners])
            else:
                values = [float(word) for word in words[1:4]]
                if len(values) != 3:
                    raise ValueError("three numbers are needed")
                (positions if words[0] == "v" else normals).append(values)
        except (ValueError, IndexError) as error:
            raise MeshError(
                f"malformed line '{line.strip()[:60]}': {error}",
                where=f"{path}:{number}",
                hint="Export the mesh again",
            ) from error
    vertices = np.array(positions, dtype=np.float64).reshape(-1, 3)
    named = np.array([vertex for polygon in polygons for vertex in polygon], dtype=np.int64)
    _refuse_unknown_vertices(named, len(vertices), path)
    faces = _triangulated(polygons, vertices)
    keep_normals = own_normals and len(normals) == len(vertices) > 0
    return MeshArrays(vertices, faces, np.array(normals) if keep_normals else None)


def _corner(word: str, n_vertices: int, n_normals: int) -> tuple[int, int]:
    """Return the zero-based (vertex, normal) of 'v', 'v/t', 'v//n' or 'v/t/n'; -1 for no normal."""
    fields = word.split("/")
    vertex = _index(fields[0], n_vertices)
    normal = _index(fields[2], n_normals) if len(fields) > 2 and fields[2] else -1
    return vertex, normal


def _index(field: str, count: int) -> int:
    given = int(field)
    index = given - 1 if given > 0 else count + given
    if given == 0 or index < 0:
        raise ValueError(f"index {given} is out of range")
    return index


def _triangulated(polygons: list[list[int]], vertices: NDArray[np.float64]) -> NDArray[np.int32]:
    faces: list[list[int]] = []
    for polygon in polygons:
        if len(polygon) == 3:
            faces.append(polygon)
        else:
            faces.extend(_triangulated_polygon(polygon, vertices[polygon]))
    return np.array(faces, dtype=np.int32).reshape(-1, 3)


def _triangulated_polygon(polygon: list[int], corners: NDArray[np.float64]) -> list[list[int]]:
    """Triangulate a polygon: a fan if it is convex, otherwise by manifold3d in its plane."""
    fan = [[0, i, i + 1] for i in range(1, len(polygon) - 1)]
    normal = np.cross(corners, np.roll(corners, -1, axis=0)).sum(axis=0)  # Newell's method
    edges = np.roll(corners, -1, axis=0) - corners
    turns = np.cross(np.roll(edges, 1, axis=0), edges) @ normal
    if (turns < -1e-12).any():
        import manifold3d

        axis = int(np.argmax(np.abs(normal)))
        flat = np.roll(corners, -axis - 1, axis=1)[:, :2] * [np.sign(normal[axis]), 1.0]
        fan = np.asarray(manifold3d.triangulate([flat])).tolist()
    return [[polygon[i] for i in triangle] for triangle in fan]

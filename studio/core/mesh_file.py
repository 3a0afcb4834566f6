"""Triangle meshes as the engine writes and reads them: OBJ files with v, vn and f only."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray


@dataclass
class Mesh:
    """Triangle mesh.

    Attributes:
        vertices: positions, (n, 3) float64, mm.
        faces: indices of vertices, (m, 3) int32, counter-clockwise seen from outside.
        normals: shading normals at the vertices, (n, 3) float64, or None.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    normals: NDArray[np.float64] | None = None


def read(path: Path) -> Mesh:
    """Read an OBJ file of triangles whose corners refer to the normal of their own vertex, if any.

    Raises:
        ValueError: the file holds anything else.
        OSError: the file can't be read.
    """
    rows: dict[str, list[str]] = {"v": [], "vn": [], "f": []}
    for line in path.read_text(encoding="utf-8").splitlines():
        key, _, rest = line.partition(" ")
        if key in rows:
            rows[key].append(rest)
    vertices = np.array(" ".join(rows["v"]).split(), dtype=np.float64).reshape(-1, 3)
    normals = np.array(" ".join(rows["vn"]).split(), dtype=np.float64).reshape(-1, 3)
    corners = [word.split("/")[0] for row in rows["f"] for word in row.split()]
    faces = np.array(corners, dtype=np.int32).reshape(-1, 3) - 1
    if len(corners) != 3 * len(rows["f"]) or (faces.size and faces.max() >= len(vertices)):
        raise ValueError(f"{path.name} is not a mesh of triangles")
    return Mesh(vertices, faces, normals if len(normals) == len(vertices) else None)


def write(mesh: Mesh, path: Path) -> None:
    """Write a mesh to an OBJ file; coordinates read back bit for bit."""
    lines = ["# millimetres"]
    lines += [f"v {x!r} {y!r} {z!r}" for x, y, z in mesh.vertices.tolist()]
    faces = (mesh.faces + 1).tolist()
    if mesh.normals is None:
        lines += [f"f {a} {b} {c}" for a, b, c in faces]
    else:
        lines += [f"vn {x!r} {y!r} {z!r}" for x, y, z in mesh.normals.tolist()]
        lines += [f"f {a}//{a} {b}//{b} {c}//{c}" for a, b, c in faces]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(lines) + "\n", encoding="ascii")

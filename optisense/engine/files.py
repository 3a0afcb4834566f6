"""Files that a request writes: pictures, arrays and meshes, each written whole."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optisense.errors import OutputError
from optisense.geometry import TriangleMesh
from optisense.text import brief
from optisense.untrusted_files import is_folder
from optisense.writing import written_whole

LONGEST_NAME = 150
"""Largest length of the common prefix of a request's files, bytes; file systems allow names of 255
bytes, and endings follow.
"""


class Files:
    """Files of one request: in its folder, with its name as prefix."""

    def __init__(self, folder: Path, name: str) -> None:
        """Prepare files `NAME.*` in a folder.

        Raises:
            OutputError: there is no such folder, or the name can't be part of a file name.
        """
        if not is_folder(folder):
            raise OutputError(
                "there is no such folder", where=str(folder), hint="Make it before it is named"
            )
        if name != Path(name).name or name in ("", ".", "..") or not name.isprintable():
            raise OutputError(
                f"'{brief(name)}' can't be the beginning of a file's name",
                hint="Use letters, digits, '-' and '_'",
            )
        if len(name.encode("utf-8", "replace")) > LONGEST_NAME:
            raise OutputError(
                f"'{brief(name)}' is too long for the name of a file",
                hint=f"Use at most {LONGEST_NAME} bytes",
            )
        self.folder = folder
        self.name = name

    def path(self, rest: str) -> Path:
        """Return the path of the file with an ending."""
        return self.folder / f"{self.name}.{rest}"

    def picture(self, rest: str, picture: NDArray[np.uint8]) -> str:
        """Write a picture (h, w, 3) uint8 as a PNG file, and return its path."""
        from optisense.picture_files import write_picture

        return self._write(rest, lambda path: write_picture(path, picture))

    def array(self, rest: str, values: NDArray[Any]) -> str:
        """Write an array of any shape as a NumPy file, and return its path."""
        whole = np.ascontiguousarray(values)

        def write(path: Path) -> None:
            with path.open("wb") as file:
                np.save(file, whole)

        return self._write(rest, write)

    def mesh(self, rest: str, mesh: TriangleMesh) -> dict[str, str]:
        """Write a mesh as float32 vertices and int32 faces, and return their paths."""
        return {
            "vertices": self.array(f"{rest}.vertices.npy", mesh.vertices.astype(np.float32)),
            "faces": self.array(f"{rest}.faces.npy", mesh.faces.astype(np.int32)),
        }

    def meshes(
        self, meshes: Mapping[str, TriangleMesh], before: str = ""
    ) -> dict[str, dict[str, str]]:
        """Write several meshes, and return their paths by name."""
        return {name: self.mesh(f"{before}{name}", mesh) for name, mesh in meshes.items()}

    def _write(self, rest: str, write: Callable[[Path], object]) -> str:
        path = self.path(rest)
        with written_whole(path) as temporary:
            write(temporary)
        return str(path)

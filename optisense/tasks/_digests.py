"""Digests that identify designs and meshes when a dataset is continued."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

from optisense.design import SensorDesign
from optisense.errors import TaskError
from optisense.untrusted_files import MOST_MESH, MOST_STEP, read_bytes


def design_values(design: SensorDesign) -> dict[str, Any]:
    """Return the values that determine a design's pictures, without file names and sources."""
    values = design.model_dump(mode="json", exclude={"provenance", "description", "name"})
    for part in values["parts"].values():
        part.pop("mesh", None)
    return values


def mesh_digests(design: SensorDesign) -> dict[str, str]:
    """Return digests that distinguish meshes of the same name."""
    return {
        name: _digest(mesh.vertices.tobytes(), mesh.faces.tobytes())
        for name, mesh in design.meshes.items()
    }


def _digest(*contents: bytes) -> str:
    total = hashlib.sha256()
    for content in contents:
        total.update(content)
    return total.hexdigest()


def file_digest(path: Path) -> str:
    """Return the digest of a file's content.

    Raises:
        TaskError: the file cannot be read.
    """
    return _digest(read_bytes(path, max(MOST_MESH, MOST_STEP), TaskError, "the mesh"))

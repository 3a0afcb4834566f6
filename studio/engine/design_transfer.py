"""Transfer of the scene's design to the engine: a folder of meshes, and the rest as JSON."""

from __future__ import annotations

import hashlib
import shutil
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ..core import mesh_file, schema
from ..core.engine import EngineError
from ..core.errors import SceneError
from ..core.mesh_file import Mesh
from ..scene.contacts import contact_list, pressing
from ..scene.gather import caged_parts, gather_document, part_names
from ..scene.meshes import REST, corners_of, part_mesh, shown_vertices
from ..scene.paths import absolute
from ..scene.world import world_matrix
from . import catalogue, session

_written: dict[str, bytes] = {}
"""Digest of the mesh in each file of the present design, by the path of the file."""


def design(scene: bpy.types.Scene) -> dict[str, Any]:
    """Return the scene's design as a field of requests to the engine; only changed meshes are
    written.

    Raises:
        EngineError: there is no engine, or the scene does not form a design.
    """
    folder = Path(session.folder()) / "design"
    try:
        document = gather_document(scene)
        _write_meshes(scene, document, folder)
    except SceneError as error:
        row = {"kind": "DesignError", "message": str(error), "path": error.path}
        raise EngineError(row) from error
    catalogue.learn_kinds()
    _copy_lamp_files(document, Path(scene.optisense.folder), folder)
    return {"data": document, "folder": str(folder)}


def _write_meshes(scene: bpy.types.Scene, document: dict[str, Any], folder: Path) -> None:
    """Write the meshes of the parts that have changed."""
    caged = caged_parts(document)
    present = {str(folder / part["mesh"]) for part in document["parts"].values()}
    for gone in _written.keys() - present:
        del _written[gone]
    for name, part in part_names(scene).items():
        path = folder / document["parts"][name]["mesh"]
        digest = _digest(part, caged=name in caged)
        if _written.get(str(path)) != digest or not path.is_file():
            mesh_file.write(part_mesh(part, caged=name in caged), path)
            _written[str(path)] = digest


def contents(given: dict[str, Any]) -> tuple[dict[str, Any], dict[str, str]]:
    """Return a design without its meshes, and the digest of each part's mesh by name.

    Args:
        given: what `design` has just returned.
    """
    parts, place = given["data"]["parts"], Path(given["folder"])
    digests = {name: _written[str(place / part["mesh"])].hex() for name, part in parts.items()}
    return given["data"], digests


def contacts(scene: bpy.types.Scene) -> list[dict[str, Any]]:
    """Return the scene's active contacts as a field of requests to the engine.

    Raises:
        EngineError: there is no engine, or a contact has no indenter.
    """
    folder = Path(session.folder()) / "indenters"
    for number, contact in enumerate(pressing(scene)):
        values = contact.optisense
        if values.indenter == "mesh" and not values.file.strip() and values.shape is None:
            raise EngineError(
                {
                    "kind": "ContactError",
                    "message": f"'{contact.name}' presses with the mesh of a file, and names none",
                    "hint": "Choose the file of the indenter under Mesh",
                    "contact": number,
                }
            )

    def write(mesh: Mesh) -> str:
        text = hashlib.blake2b(mesh.vertices.tobytes() + mesh.faces.tobytes(), digest_size=16)
        path = folder / f"{text.hexdigest()}.obj"
        if not path.is_file():
            mesh_file.write(mesh, path)
        return str(path)

    return contact_list(scene, bpy.context.evaluated_depsgraph_get(), write)


def _digest(part: bpy.types.Object, *, caged: bool) -> bytes:
    """Return a digest of a part's mesh at rest, to detect changes."""
    if part.mode == "EDIT":
        part.update_from_editmode()
    mesh = part.data
    text = hashlib.blake2b(digest_size=16)
    if part.modifiers and not caged:
        made = part_mesh(part, caged=False)
        text.update(made.vertices.tobytes() + made.faces.tobytes())
        return text.digest()
    attribute = mesh.attributes.get(f"{REST}_0") if caged else None
    if attribute is not None:
        rest = np.empty(3 * len(mesh.vertices), dtype=np.float32)
        attribute.data.foreach_get("vector", rest)
        text.update(rest.tobytes())
    else:
        text.update(shown_vertices(mesh).tobytes())
    text.update(corners_of(mesh).tobytes())
    text.update(np.array(world_matrix(part), dtype=np.float64).tobytes())
    return text.digest()


def _copy_lamp_files(document: dict[str, Any], source: Path, folder: Path) -> None:
    """Copy the files of lamps into the folder; those from elsewhere get their bare file name."""
    for group in document["lights"].values():
        emitter = group.get("emitter") or {"kind": "library"}
        for field in schema.file_fields("emitter", emitter["kind"]):
            if emitter.get(field):
                emitter[field] = _copy_file(emitter[field], source, folder)


def _copy_file(file: str, source: Path, folder: Path) -> str:
    """Copy a lamp's file into the folder, and return its name there."""
    origin, name = source / file, file
    if file.startswith("//") or Path(file).is_absolute() or ".." in Path(file).parts:
        origin = absolute(file)
        name = origin.name
    inside = folder / name
    if not origin.is_file():
        origin = source / origin.name  # it joined the design when that was saved
    if origin.is_file() and origin != inside:
        inside.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(origin, inside)
    return name


def without_nulls(values: Any) -> Any:
    """Remove entries with the value None from nested dictionaries, as in design files."""
    if isinstance(values, dict):
        return {key: without_nulls(each) for key, each in values.items() if each is not None}
    if isinstance(values, list):
        return [without_nulls(each) for each in values]
    return values

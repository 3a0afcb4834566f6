"""Sensor designs on disk: a folder with `design.yaml` and the meshes it names."""

from __future__ import annotations

import contextlib
import hashlib
import os
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from optisense.design.limits import unit_slips
from optisense.design.parts import TRANSPARENT_SOLIDS
from optisense.design.problems import design_error, raise_problems
from optisense.design.sensor_design import SCHEMA_VERSION, SensorDesign, dotted
from optisense.design.yaml_reader import Lines, read_yaml
from optisense.design.yaml_writer import to_yaml, with_comments
from optisense.errors import DesignError, MeshError, OutputError
from optisense.folders import begun, held
from optisense.geometry import TriangleMesh
from optisense.near import near_match
from optisense.text import brief
from optisense.untrusted_files import (
    MOST_MESH,
    MOST_TEXT,
    is_file,
    is_folder,
    read_bytes,
    read_text,
)
from optisense.untrusted_files import inside as inside_folder
from optisense.writing import inside, written_together

DESIGN_FILE = "design.yaml"
MOST_TRIANGLES = 3_000_000
"""Largest number of triangles of a design's parts; the largest built-in sensor has 53,000."""

HEAD = "Sensor design. Lengths in mm, angles in degrees, powers in mW."


def load_design(path: str | Path) -> SensorDesign:
    """Read a design folder (or its design.yaml) and the meshes it names.

    Raises:
        DesignError: a file is missing, a field is missing, misspelt or out of range, a mesh path
            leaves the folder, or the sizes suggest another unit than mm; the message names file and
            line.
        MeshError: a mesh can't be read, has no triangles, holds numbers that are not finite, or
            is not closed though it is an elastomer or a support.
    """
    path = Path(path)
    file = path / DESIGN_FILE if is_folder(path) else path
    if not is_file(file):
        raise DesignError(
            "no sensor design is at this place",
            where=str(file),
            hint="Name a folder that holds a design.yaml",
        )
    data, lines = read_yaml(file)
    _check_version(data, lines, str(file))
    try:
        design = SensorDesign.model_validate(data)
    except ValidationError as error:
        raise design_error(error, data, where=str(file), lines=lines) from None
    design._source, design._lines = file, lines
    folder = file.parent
    triangles = 0
    for name, part in design.parts.items():
        mesh_path = file_inside(folder, part.mesh, design.where("parts", name, "mesh"))
        design.meshes[name] = _load_mesh(mesh_path, name, design)
        triangles += len(design.meshes[name].faces)
        if triangles > MOST_TRIANGLES:
            raise DesignError(
                f"the meshes have more than {MOST_TRIANGLES:,} triangles together",
                where=design.where("parts", name, "mesh"),
                hint="Simplify the largest of them in a modelling program",
            )
    for place, value in design.values_of_kinds().items():
        for field, named in value.located(folder).files().items():
            file_inside(folder, named, design.where(*place, field))
    raise_problems(unit_slips(design, design.meshes), str(file))
    return design


def save_design(
    design: SensorDesign, folder: str | Path, *, new: bool = False, digest: str | None = None
) -> None:
    """Write a design folder: design.yaml with a comment on each unit, meshes as OBJ.

    Each file is written whole under a temporary name; only when all exist are they renamed,
    design.yaml last. Other files in the folder are not touched. If the design was read from this
    folder, comments that the user has written into its design.yaml are kept.

    Args:
        design: design to write.
        folder: folder, created if needed.
        new: whether the folder must be empty or absent; if the design can't be written, the folder
            is left empty, and files that a killed process has left are removed first.
        digest: `digest_of` the folder before the design was read from it, if this changes a design
            in place: a change by another program since then is not overwritten.

    Raises:
        DesignError: a value does not fit, a part has no mesh, or two parts with different meshes
            (or two lamps or materials with different files) share a file.
        MeshError: a mesh could not be loaded again; see `SensorDesign.valid_mesh`.
        FolderInUseError: another process is writing to the folder.
        OutputError: the folder can't be written, is not empty though it must be, or does not have
            the digest.
    """
    folder = Path(folder)
    if new:
        with begun(folder, files_of(design)):
            save_design(design, folder)
        return
    saved = design.copy()
    meshes = {name: _as_obj(part.mesh) for name, part in design.parts.items()}
    _check_saveable(saved, meshes)
    for name, file in meshes.items():
        saved.parts[name].mesh = file
    with held(folder), written_together("the design") as stage:
        if digest is not None and digest_of(folder) not in ("", digest):
            raise OutputError(
                "the design was changed on disk since it was opened here",
                where=str(folder),
                hint="Repeat the command; in the studio, open the design again or use Save As",
            )
        for file, name in {file: name for name, file in meshes.items()}.items():
            design.meshes[name].save_obj(stage(inside(folder, file)))
        for file, data in _named_files(design).items():
            stage(inside(folder, file)).write_bytes(data)
        place, text = inside(folder, DESIGN_FILE), to_yaml(saved, HEAD)
        if digest is not None or _is_read_from(saved, place):
            text = _with_comments(text, place)
        stage(place).write_text(text, encoding="utf-8")


def digest_of(folder: str | Path) -> str:
    """Return a digest of a folder's design.yaml and of the meshes that it names, by which a change
    of them is noticed; empty if there is no design.yaml.

    Files that can't be read count as absent, so that a damaged design has a digest, too.
    """
    folder = Path(folder)
    file = folder / DESIGN_FILE
    if not is_file(file):
        return ""
    found = hashlib.blake2b(digest_size=16)
    with contextlib.suppress(DesignError):
        found.update(read_bytes(file, MOST_TEXT, DesignError))
        parts = read_yaml(file)[0].get("parts")
        values = parts.values() if isinstance(parts, dict) else ()
        names = (value.get("mesh") for value in values if isinstance(value, dict))
        for name in sorted({name for name in names if isinstance(name, str)}):
            path = inside_folder(folder, name)
            if path is not None and is_file(path):
                found.update(read_bytes(path, MOST_MESH, DesignError))
    return found.hexdigest()


def _is_read_from(design: SensorDesign, file: Path) -> bool:
    source = design._source
    return source is not None and os.path.realpath(source) == os.path.realpath(file)


def _with_comments(text: str, file: Path) -> str:
    """Return the text of a design with the user's comments from the file that it replaces, if that
    can be read.
    """
    with contextlib.suppress(DesignError, ValidationError):
        before = read_text(file, MOST_TEXT, DesignError)
        return with_comments(
            text, before, lambda data: to_yaml(SensorDesign.model_validate(data), HEAD)
        )
    return text


def files_of(design: SensorDesign) -> list[str]:
    """Return the files that `save_design` writes, relative to the folder."""
    meshes = dict.fromkeys(_as_obj(part.mesh) for part in design.parts.values())
    return [*meshes, *_named_files(design), DESIGN_FILE]


def _check_version(data: dict[str, Any], lines: Lines, source: str) -> None:
    version = data.get("schema_version")
    if "schema_version" not in data:
        near = near_match("schema_version", [str(key) for key in data])
        line = lines.get((near,), 1) if near else 1
        add = f"Add: schema_version: {SCHEMA_VERSION}"
        raise DesignError(
            "'schema_version' is missing",
            where=f"{source}:{line}",
            hint=f"Is '{near}' meant to be it?" if near else add,
        )
    if version != SCHEMA_VERSION or isinstance(version, bool):
        newer = isinstance(version, int) and version > SCHEMA_VERSION
        raise DesignError(
            f"schema_version {version!r} can't be read; this release reads {SCHEMA_VERSION}",
            where=f"{source}:{lines[('schema_version',)]}",
            hint="A newer release wrote it: update OptiSense Studio" if newer else None,
        )


def file_inside(folder: Path, relative: str, where: str) -> Path:
    """Return the file at a path, which must not leave the design's folder after links are resolved.

    Raises:
        DesignError: the path leads out of the folder, or to no file.
    """
    path = inside_folder(folder, relative)
    if path is None:
        raise DesignError(
            f"'{brief(relative)}' leads out of the design folder",
            where=where,
            hint="Copy the file into the folder and name it there",
        )
    if not is_file(path):
        raise DesignError(
            f"there is no file '{brief(relative)}' in the design folder",
            where=where,
            hint=_hint_of_siblings(path),
        )
    return path


def _hint_of_siblings(path: Path) -> str:
    if os.path.lexists(path):
        return "A folder or another special file has this name: remove or rename it"
    try:
        near = near_match(path.name, [sibling.name for sibling in path.parent.iterdir()])
    except OSError:
        near = None
    return f"Did you mean '{near}'?" if near else "Add the file or correct its path"


def _load_mesh(path: Path, name: str, design: SensorDesign) -> TriangleMesh:
    try:
        closed = design.parts[name].role in TRANSPARENT_SOLIDS
        return TriangleMesh.load(path).validate(name, closed=closed)
    except MeshError as error:
        in_file = error.where is not None and error.where.startswith(str(path))
        where = error.where if in_file else design.where("parts", name, "mesh")
        raise MeshError(f"part '{name}': {error.message}", where=where, hint=error.hint) from error


def _as_obj(file: str) -> str:
    return str(Path(file).with_suffix(".obj").as_posix())


def _check_saveable(design: SensorDesign, files: dict[str, str]) -> None:
    owner: dict[str, str] = {}
    for name, file in files.items():
        design.valid_mesh(name)
        first = owner.setdefault(file.casefold(), name)
        if not design.meshes[first].equals(design.meshes[name]):
            raise DesignError(
                f"parts '{first}' and '{name}' have different meshes but one file '{file}'",
                where=f"parts.{name}.mesh",
                hint="Give each its own file",
            )


def _named_files(design: SensorDesign) -> dict[str, bytes]:
    """Return the contents of the files of lamps and materials, by their paths in the folder."""
    files: dict[str, bytes] = {}
    owner: dict[str, str] = {}
    for path, value in design.values_of_kinds().items():
        for file, data in value.contents().items():
            first = owner.setdefault(file, dotted(path))
            if files.setdefault(file, data) != data:
                raise DesignError(
                    f"'{first}' and '{dotted(path)}' have different files but one name '{file}'",
                    where=dotted(path),
                    hint="Give each its own file",
                )
    return files

"""Designs that requests name, read again only where a file has changed."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from optisense.design import SensorDesign, check_design, load_design, set_value
from optisense.design.parts import TRANSPARENT_SOLIDS, Role
from optisense.design.problems import Diagnostic, design_error, validation_problems
from optisense.design.sensor_design import dotted
from optisense.design.storage import DESIGN_FILE, file_inside
from optisense.engine.failures import InvalidDesignError, ProtocolError
from optisense.errors import DesignError, MeshError
from optisense.geometry import TriangleMesh
from optisense.library import names
from optisense.near import near_match
from optisense.sensors import load
from optisense.sensors.registry import find_problems
from optisense.untrusted_arrays import read_array
from optisense.untrusted_files import Stamp, file_stamp, is_folder

MOST_MESHES = 200
"""Largest number of mesh files that are kept: those of some twenty designs. The one
not used for longest is dropped first.
"""

MOST_FOLDERS = 20
"""Largest number of folders of designs that are kept, more than a user goes back and forth between;
the one not used for longest is dropped first.
"""


class DesignReference(BaseModel):
    """Design that is not given by a name only; see docs/engine.md."""

    model_config = ConfigDict(extra="forbid", populate_by_name=True)

    source: str | None = Field(default=None, alias="from")
    data: dict[str, Any] | None = None
    folder: str | None = None
    set: dict[str, Any] = Field(default_factory=dict)


AnyDesign = str | DesignReference
"""Value of the field `design` of a request."""


class MeshFile(BaseModel):
    """Mesh given by two NumPy files."""

    model_config = ConfigDict(extra="forbid")

    vertices: str
    faces: str


AnyMesh = str | MeshFile
"""Path of a mesh file, or of the two arrays of a mesh."""


class Designs:
    """Reader of designs with a cache.

    The same file gives the same mesh object, by which an `OpticalModel` recognises what has
    changed.
    """

    def __init__(self) -> None:
        """Start with an empty cache."""
        self._built: dict[str, SensorDesign] = {}
        self._folders: dict[str, tuple[list[Stamp], SensorDesign]] = {}
        self._meshes: dict[tuple[Stamp, ...], TriangleMesh] = {}
        self._valid: WeakKeyDictionary[TriangleMesh, dict[bool, TriangleMesh]] = WeakKeyDictionary()
        self._sound: tuple[SensorDesign, list[Diagnostic]] | None = None

    def read(self, given: AnyDesign, meshes: Mapping[str, AnyMesh] | None = None) -> SensorDesign:
        """Return the design that a request names.

        Args:
            given: a name, a folder, or values.
            meshes: mesh files that replace the design's own, by part.

        Raises:
            DesignError, MeshError, LibraryError: the design can't be read.
            ProtocolError: the fields of the reference contradict each other.
        """
        if isinstance(given, str):
            design = self._named(given)
        elif given.data is not None:
            if given.source is not None:
                raise ProtocolError(
                    "a design has both 'from' and 'data'", where="design", hint="Give one of them"
                )
            design = self._from_data(given.data, given.folder, meshes or {})
        elif given.source is not None:
            design = self._named(given.source)
        else:
            raise ProtocolError(
                "the design has neither 'from' nor 'data'", where="design",
                hint='Write a name, a folder, {"from": ...} or {"data": ..., "folder": ...}',
            )  # fmt: skip
        if meshes:
            design = self._with_meshes(design, meshes)
        if not isinstance(given, str):
            for path, value in given.set.items():
                design = set_value(design, path, value)
        return design

    def problems(self, design: SensorDesign) -> list[Diagnostic]:
        """Return all problems that `check` finds."""
        return find_problems(design, self._without_lights(design))

    def _without_lights(self, design: SensorDesign) -> list[Diagnostic]:
        """Return the problems of `check_design`; the answer for the last design is cached."""
        if self._sound is not None and _same(self._sound[0], design):
            return self._sound[1]
        found = check_design(design, light_names=names("light"))
        self._sound = design, found
        return found

    def require_valid(self, design: SensorDesign) -> list[Diagnostic]:
        """Return the warnings about a design, without those about where its lights are, which take
        as long as a draft.

        Raises:
            InvalidDesignError: the design can't be simulated, or its simulation would be wrong.
        """
        found = self._without_lights(design)
        if any(problem.severity == "error" for problem in found):
            raise InvalidDesignError(found, f"design '{design.name}'")
        return found

    def mesh(self, given: AnyMesh, scale: float = 1.0) -> TriangleMesh:
        """Return the mesh in a file, or in two arrays; it is not checked.

        Raises:
            MeshError: the mesh can't be read.
        """
        paths = [given] if isinstance(given, str) else [given.vertices, given.faces]
        key = tuple(file_stamp(Path(path)) for path in paths)
        mesh = self._meshes.pop(key, None)
        if mesh is None:
            mesh = TriangleMesh.load(given) if isinstance(given, str) else _mesh_of_arrays(given)
        self._meshes[key] = mesh
        while len(self._meshes) > MOST_MESHES:
            del self._meshes[next(iter(self._meshes))]
        return mesh if scale == 1.0 else mesh.transformed(np.diag([scale, scale, scale]))

    def _named(self, name: str) -> SensorDesign:
        path = Path(name)
        if not path.is_absolute():
            if name not in self._built:
                self._built[name] = load(name if name.startswith("builtin:") else f"builtin:{name}")
            return self._built[name]
        file = path / DESIGN_FILE if is_folder(path) else path
        kept = self._folders.pop(name, None)
        if kept is not None and _stamps(kept[1], file) == kept[0]:
            self._folders[name] = kept
            return kept[1]
        design = load_design(file)
        for part, value in design.parts.items():  # the same file is the same mesh
            mesh = self.mesh(os.path.realpath(file.parent / value.mesh))
            design.meshes[part] = self._checked(mesh, part, value.role)
        design._source, design._lines = None, {}  # from here on a place is a dotted path
        self._folders[name] = _stamps(design, file), design
        while len(self._folders) > MOST_FOLDERS:
            del self._folders[next(iter(self._folders))]
        return design

    def _from_data(
        self, data: dict[str, Any], folder: str | None, elsewhere: Mapping[str, AnyMesh]
    ) -> SensorDesign:
        try:
            design = SensorDesign.model_validate(data)
        except ValidationError as error:
            found = design_error(error, data)
            first = validation_problems(error, data)[0]
            raise DesignError(found.message, where=first.where, hint=found.hint) from None
        base = None if folder is None else Path(folder)
        for name, part in design.parts.items():
            if name not in elsewhere:
                path = _inside(base, part.mesh, f"parts.{name}.mesh")
                with _errors_of_part(name):
                    mesh = self.mesh(str(path))
                design.meshes[name] = self._checked(mesh, name, part.role)
        for place, value in design.values_of_kinds().items():
            for field, named in value.located(base).files().items():
                _inside(base, named, dotted((*place, field)))
        return design

    def _with_meshes(self, design: SensorDesign, meshes: Mapping[str, AnyMesh]) -> SensorDesign:
        design = design.copy()
        for name, given in meshes.items():
            if name not in design.parts:
                near = near_match(name, list(design.parts))
                raise DesignError(
                    f"there is a mesh for a part '{name}', which the design does not have",
                    where="meshes",
                    hint=f"Did you mean '{near}'?" if near else None,
                )
            design.meshes[name] = self._checked(self.mesh(given), name, design.parts[name].role)
        return design

    def _checked(self, mesh: TriangleMesh, name: str, role: Role) -> TriangleMesh:
        """Return the checked mesh, turned outward if it must be closed; one object for one mesh."""
        closed = role in TRANSPARENT_SOLIDS
        kept = self._valid.setdefault(mesh, {})
        if closed not in kept:
            with _errors_of_part(name):
                kept[closed] = mesh.validate(name, closed=closed)
        return kept[closed]


@contextmanager
def _errors_of_part(name: str) -> Iterator[None]:
    """Context in which errors about a mesh name the part."""
    try:
        yield
    except MeshError as error:
        raise MeshError(
            f"part '{name}': {error.message}", where=f"parts.{name}.mesh", hint=error.hint
        ) from error


def _same(one: SensorDesign, other: SensorDesign) -> bool:
    return one is other or (one == other and one.meshes == other.meshes)


def _stamps(design: SensorDesign, file: Path) -> list[Stamp]:
    """Return a value that changes if any file of a design changes."""
    meshes = [file.parent / part.mesh for part in design.parts.values()]
    kinds = design.values_of_kinds().values()
    others = [file.parent / name for each in kinds for name in each.files().values()]
    return [file_stamp(path) for path in (file, *meshes, *others)]


def _mesh_of_arrays(given: MeshFile) -> TriangleMesh:
    """Return the mesh of two NumPy files; pickled objects in them are refused."""
    vertices, faces = (read_array(Path(path), MeshError) for path in (given.vertices, given.faces))
    for array, path, kinds in ((vertices, given.vertices, "fiu"), (faces, given.faces, "iu")):
        if array.ndim != 2 or array.shape[1] != 3 or array.dtype.kind not in kinds:
            raise MeshError(
                f"the array is of {array.dtype} and has the shape {array.shape}",
                where=path,
                hint="Give vertices as (n, 3) float32 and faces as (m, 3) int32",
            )
    return TriangleMesh(vertices, faces)


def _inside(folder: Path | None, relative: str, where: str) -> Path:
    """Return the file of a design; see `file_inside`."""
    if folder is None:
        raise DesignError(
            f"the file '{relative}' can't be found, as the design has no folder",
            where=where,
            hint="Name the design's folder",
        )
    return file_inside(folder, relative, where)

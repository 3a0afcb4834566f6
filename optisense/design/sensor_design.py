"""The sensor design: all that is needed to simulate a sensor, except the objects that touch it."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any, Literal, Self, cast, get_args

import numpy as np
from numpy.typing import NDArray
from pydantic import (
    Field,
    PrivateAttr,
    StringConstraints,
    ValidationError,
    ValidationInfo,
    field_validator,
    model_validator,
)
from pydantic_core import PydanticSerializationError

from optisense.design._components import Components
from optisense.design.cage import Cage
from optisense.design.camera import Camera
from optisense.design.fields import InconsistentValueError, Model, Name, Steps, is_left_out
from optisense.design.kinds import KindModel
from optisense.design.lights import LightGroup
from optisense.design.markers import Markers
from optisense.design.materials import CoatingModel, Material, kinds_for
from optisense.design.part_faces import check_finishes
from optisense.design.parts import TRANSPARENT_SOLIDS, Part, Role
from optisense.errors import DesignError, MeshError
from optisense.geometry import TriangleMesh
from optisense.near import suggestion
from optisense.text import to_html

SCHEMA_VERSION = 1
"""Version of the design file's format; it grows when older files have to be converted."""

MOST_OF_A_KIND = 1000
"""Largest number of materials, parts, light groups or cages of one design; the built-in sensors
have at most some dozens, and checks of parts against each other take time that grows with their
square."""

MOST_NOTES = 20_000
"""Largest number of values of one design with a source, each in three lines of the file."""

MATERIAL_REQUIRED = frozenset({Role.ELASTOMER, Role.SUPPORT, Role.INTERFACE, Role.MIRROR})

Meshes = dict[str, TriangleMesh]
"""Meshes of a design's parts, mm, by part. Checks of a design get them as its cages deform them."""


class Status(StrEnum):
    """Kind of evidence for a number."""

    MEASURED = "measured"
    CALIBRATED = "calibrated"
    """Fitted to photographs of a real sensor."""
    DATASHEET = "datasheet"
    SOURCED = "sourced"
    DERIVED = "derived"
    ASSUMED = "assumed"


class Provenance(Model):
    """Source of a number of the design."""

    status: Status = Field(description="; ".join(status.value for status in Status))
    source: str = Field(description="origin of the number, or its derivation")


class SensorDesign(Model):
    """Camera-based tactile sensor. Lengths in mm, angles in degrees, powers in mW.

    `design.meshes` holds the undeformed mesh of each part by name; it is not part of the design
    file but stored next to it. Meshes never change: assign another one, such as
    ``mesh.with_vertices(...)``. Changing a field checks it; see also `set_value`. A dict that is
    set as a material, part, light group or cage (``design.materials["gel"] = {...}``) becomes the
    object that it describes.
    """

    schema_version: Literal[1] = Field(default=1, description="version of this file format")
    name: Annotated[str, StringConstraints(min_length=1, max_length=200)]
    description: str = ""
    coating: CoatingModel = Field(description="coating of the sensing surface")
    materials: dict[Name, Material] = Field(
        max_length=MOST_OF_A_KIND, description="optical materials, by name"
    )
    parts: Annotated[dict[Name, Part], Field(min_length=1, max_length=MOST_OF_A_KIND)] = Field(
        description="solids and surfaces; lengths in mm"
    )
    lights: dict[Name, LightGroup] = Field(max_length=MOST_OF_A_KIND, description="light groups")
    camera: Camera
    cages: dict[Name, Cage] = Field(
        default_factory=dict,
        max_length=MOST_OF_A_KIND,
        validate_default=True,
        description="control points that deform parts",
    )
    dispersion: bool | None = Field(
        default=None,
        exclude_if=is_left_out,
        description="whether R, G and B are refracted by indices of their own",
    )
    markers: Markers | None = Field(
        default=None, exclude_if=is_left_out, description="dots printed on the sensing surface"
    )
    provenance: dict[str, Provenance] = Field(
        default_factory=dict,
        max_length=MOST_NOTES,
        description="sources of the numbers, by dotted path",
    )

    _meshes: dict[str, TriangleMesh] = PrivateAttr(default_factory=dict)
    _source: Path | None = PrivateAttr(default=None)
    _lines: dict[Steps, int] = PrivateAttr(default_factory=dict)

    @field_validator("materials", "parts", "lights", "cages")
    @classmethod
    def _as_components(cls, given: dict[str, Any], info: ValidationInfo) -> Components:
        section = str(info.field_name)
        return Components(section, get_args(cls.model_fields[section].annotation)[1], given)

    @model_validator(mode="after")
    def _references_hold(self) -> SensorDesign:
        for name, part in self.parts.items():
            self._check_material(name, part)
        for name, part in self.parts.items():
            check_finishes(name, part, self.materials)
        if not any(part.role is Role.SENSING_SURFACE for part in self.parts.values()):
            raise InconsistentValueError(
                "no part is a sensing_surface",
                ("parts",),
                "Give one part this role; the studio makes it by Make Sensing Surface",
            )
        caged: dict[str, str] = {}
        for cage_name, cage in self.cages.items():
            for index, part_name in enumerate(cage.parts):
                path = ("cages", cage_name, "parts", index)
                if part_name not in self.parts:
                    raise InconsistentValueError(
                        f"cage '{cage_name}' deforms an unknown part '{part_name}'",
                        path,
                        suggestion(part_name, self.parts),
                    )
                if part_name in caged:
                    raise InconsistentValueError(
                        f"part '{part_name}' is in two cages, or twice in one "
                        f"('{caged[part_name]}', '{cage_name}')",
                        path,
                        "Name each part in one cage only",
                    )
                caged[part_name] = cage_name
        return self

    def _check_material(self, name: str, part: Part) -> None:
        path: tuple[str | int, ...] = ("parts", name, "material")
        if part.material is None:
            if part.role in MATERIAL_REQUIRED:
                kinds = kinds_for(part.role)
                fit = [name for name, material in self.materials.items() if material.kind in kinds]
                raise InconsistentValueError(
                    f"part '{name}' ({part.role.value}) has no material",
                    path,
                    f"Name one of: {', '.join(fit)}"
                    if fit
                    else f"Add one of kind {' or '.join(kinds)} under 'materials', and name it",
                )
            return
        if part.role is Role.SENSING_SURFACE:
            raise InconsistentValueError(
                f"part '{name}' is a sensing_surface: it has the coating, and no material",
                path,
                "Remove its material",
            )
        if part.material not in self.materials:
            raise InconsistentValueError(
                f"part '{name}' is made of an unknown material '{part.material}'",
                path,
                suggestion(part.material, self.materials),
            )
        material = self.materials[part.material]
        if part.role not in material.roles:
            raise InconsistentValueError(
                f"part '{name}' ({part.role.value}) can't be made of '{part.material}', "
                f"which is a {material.kind}",
                path,
                "Use a material of kind " + " or ".join(kinds_for(part.role)),
            )

    @property
    def meshes(self) -> dict[str, TriangleMesh]:
        """Undeformed mesh of each part, by part name."""
        return self._meshes

    @property
    def sensing_area(self) -> float:
        """Area of the undeformed sensing surfaces, mm2."""
        skins = [self._meshes.get(name) for name in self.parts_of(Role.SENSING_SURFACE)]
        return float(sum(skin.face_areas.sum() for skin in skins if skin is not None))

    def valid_mesh(self, name: str) -> TriangleMesh:
        """Return the undeformed mesh of a part, with outward faces if it is a transparent solid.

        Raises:
            DesignError: the part has no mesh, or an object of another type.
            MeshError: the mesh has no triangles, a coordinate that is not finite, a face that names
                a missing vertex, or, if it is a transparent solid, an open edge.
        """
        mesh, where = self._meshes.get(name), self.where("parts", name, "mesh")
        if mesh is None:
            hint = "Set design.meshes[name]"
            raise DesignError(f"part '{name}' has no mesh", where=where, hint=hint)
        if not isinstance(mesh, TriangleMesh):
            raise DesignError(
                f"the mesh of part '{name}' is of type {type(mesh).__name__}",
                where=where,
                hint="Set design.meshes[name] to TriangleMesh(mesh.vertices, mesh.faces)",
            )
        try:
            return mesh.validate(name, closed=self.parts[name].role in TRANSPARENT_SOLIDS)
        except MeshError as error:
            message = f"part '{name}': {error.message}"
            raise MeshError(message, where=where, hint=error.hint) from error

    def deformed_meshes(self) -> dict[str, TriangleMesh]:
        """Return the mesh of each part in its current shape: as stored, then deformed by its cage.

        Raises:
            DesignError: a vertex of a caged part lies outside the cage's box, or a mesh is an
                object of another type.
            MeshError: a mesh has no vertices or no triangles.
        """
        from optisense.geometry.cage import deformed

        for name in self.parts.keys() & self._meshes.keys():
            mesh = self._meshes[name]
            if not isinstance(mesh, TriangleMesh) or not len(mesh.vertices) or not len(mesh.faces):
                self.valid_mesh(name)  # raises the error; a full check here would be slow
        result = dict(self._meshes)
        for cage_name, cage in self.cages.items():
            box = np.array(cage.box, dtype=np.float64)
            points = cage.current_points()
            for name in cage.parts:
                if name in result:
                    try:
                        result[name] = deformed(result[name], box, cage.resolution, points)
                    except DesignError as error:
                        message = f"cage '{cage_name}', part '{name}': {error.message}"
                        where = self.where("cages", cage_name, "box")
                        raise DesignError(message, where=where, hint=error.hint) from error
        return result

    def values_of_kinds(self) -> dict[Steps, KindModel]:
        """Return all components that come in kinds and may name files, by path: coating, materials,
        emitters, and the effects of the camera's lens and sensor.
        """
        found: dict[Steps, KindModel] = {("coating",): self.coating}
        for name, material in self.materials.items():
            found["materials", name] = material
        for name, group in self.lights.items():
            if group.emitter is not None:
                found["lights", name, "emitter"] = group.emitter
        for name, value in self.camera.kinds_of_imaging().items():
            found["camera", name] = value
        return found

    def parts_of(self, *roles: Role) -> list[str]:
        """Return the names of the parts that have one of the roles, in file order."""
        return [name for name, part in self.parts.items() if part.role in roles]

    def bounds(self) -> NDArray[np.float64]:
        """Return the bounding box of all undeformed meshes without indenters, (2, 3) mm.

        Raises:
            ValueError: there are no meshes.
        """
        boxes = [
            mesh.bounds
            for name, mesh in self._meshes.items()
            if self.parts[name].role is not Role.INDENTER
        ]
        if not boxes:
            raise ValueError("the design has no meshes")
        corners = np.array(boxes)
        return np.array([corners[:, 0].min(axis=0), corners[:, 1].max(axis=0)])

    def copy(self) -> SensorDesign:  # type: ignore[override]
        """Return an independent design; the meshes, which never change, are shared.

        Raises:
            DesignError: a value that was edited inside a list or a section does not fit.
        """
        return self._replaced(self._data())

    def __copy__(self) -> SensorDesign:
        return self.copy()

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """Return an independent design; see `copy`. With an `update`, its values are not checked,
        and the other fields are shared, except for the dictionary of meshes.
        """
        if update is None:
            return cast("Self", self.copy())
        changed = self.__deepcopy__() if deep else super().__copy__()
        changed.__dict__.update(update)
        changed._meshes = dict(self._meshes)
        return changed

    def __eq__(self, other: object) -> bool:
        """Return whether two designs have equal values and meshes; where their files are, and where
        they were read from, makes no difference.
        """
        if not isinstance(other, SensorDesign):
            return NotImplemented
        return (
            type(self) is type(other)
            and self.__dict__ == other.__dict__
            and self._meshes.keys() == other._meshes.keys()
            and all(same_mesh(mesh, other._meshes[name]) for name, mesh in self._meshes.items())
        )

    def _repr_html_(self) -> str:
        """Return a labelled section, for notebooks."""

        from optisense.design.section_drawing import section_svg

        try:
            drawing = section_svg(self)
        except (DesignError, KeyError, ValueError):  # incomplete: parts without meshes
            drawing = to_html(", ".join(f"{n} ({p.role.value})" for n, p in self.parts.items()))
        return f"<div><b>{to_html(self.name)}</b><br>{drawing}</div>"

    def where(self, *path: str | int) -> str:
        """Return file and line of a value of a design read from a file, else its dotted path."""
        return place_of(path, "" if self._source is None else str(self._source), self._lines)

    def _data(self) -> dict[str, Any]:
        """Return the values as in a design file, which must have the types that it holds."""
        try:
            return self.model_dump(mode="json", warnings=False)
        except PydanticSerializationError as error:
            raise DesignError(f"the design has a value of a wrong type: {error}") from None

    def _replaced(self, data: dict[str, Any], where: str = "") -> SensorDesign:
        """Return a design of these values with this one's meshes and files.

        Errors name the place `where`, or else the lines of this design's file or the dotted paths.
        """
        try:
            design = type(self).model_validate(data)
        except ValidationError as error:
            if where or self._source is None:
                raise Model.error_in_words(error, data, where=where) from None
            raise Model.error_in_words(
                error, data, where=str(self._source), lines=self._lines
            ) from None
        design._meshes = {n: m for n, m in self._meshes.items() if n in design.parts}
        design._source = self._source
        design._lines = self._lines
        before = self.values_of_kinds()
        for path, value in design.values_of_kinds().items():
            if path in before:
                value.located(before[path].folder)
        return design


def same_mesh(one: TriangleMesh | None, other: TriangleMesh | None) -> bool:
    """Return whether two meshes of a design are equal; objects of other types, which users may have
    set, are equal if they are the same object.
    """
    return one is other or (
        isinstance(one, TriangleMesh) and isinstance(other, TriangleMesh) and one.equals(other)
    )


def refuse_no_design(given: object) -> None:
    """Raise DesignError if an argument is no `SensorDesign`, such as the name of one."""
    if isinstance(given, SensorDesign):
        return
    named = repr(str(given)) if isinstance(given, str | Path) else "FOLDER_OR_NAME"
    raise DesignError(
        f"a design is needed, not {type(given).__name__} {given!r:.60}",
        hint=f"Load one with optisense.load({named})",
    )


def refuse_design(given: object) -> None:
    """Raise DesignError if an argument is a design, or the name of one, and no optical model."""
    if isinstance(given, SensorDesign | str | Path):
        raise DesignError(
            f"an optical model is needed, not {type(given).__name__} {given!r:.60}",
            hint="Make one with optisense.OpticalModel(design)",
        )


def place_of(path: Steps, source: str, lines: Mapping[Steps, int]) -> str:
    """Return file and line of a value, or of the innermost one around it that has a line.

    Args:
        source: the file, or another source of the values; empty for the dotted path.
        lines: line of each path in the file, if there is one.
    """
    if not lines:
        return source or dotted(path)
    for length in range(len(path), -1, -1):
        if path[:length] in lines:
            return f"{source}:{lines[path[:length]]}"
    return source


def dotted(path: Steps) -> str:
    """Return keys and indices as a dotted path such as 'lights.red.lights[0].position'."""
    text = ""
    for step in path:
        text += f"[{step}]" if isinstance(step, int) else f".{step}" if text else step
    return text

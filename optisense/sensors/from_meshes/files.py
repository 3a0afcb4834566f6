"""CAD files as meshes in millimetres, each read once, with the uses of their bodies and a check of
their units.
"""

from __future__ import annotations

import os
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from optisense.design import Role
from optisense.errors import DesignError, MeshError
from optisense.geometry import TriangleMesh
from optisense.geometry.mesh_files import FORMATS
from optisense.geometry.step import SUFFIXES as STEP_FORMATS
from optisense.geometry.step import read_step
from optisense.length_units import MM_PER, Units
from optisense.near import near_match
from optisense.sensors.from_meshes.directions import nearest_side
from optisense.sensors.from_meshes.recipe_parts import ShapeReference
from optisense.text import brief
from optisense.untrusted_files import is_file, is_folder

ALL_FORMATS = (*FORMATS, *STEP_FORMATS)

OTHER_FORMATS = (
    ".3mf", ".amf", ".f3d", ".glb", ".gltf", ".iges", ".igs", ".ipt", ".sldprt", ".x_b", ".x_t",
)  # fmt: skip
"""Formats of shapes that are not read."""

SMALLEST, LARGEST = 4.0, 400.0
"""Range of the largest dimension of a tactile sensor, mm; other sizes come from a wrong unit."""

ODD_PART = 200.0
"""Ratio of sizes from which on a part that is smaller or larger than the others is taken to be in
another unit."""

SMALL_PART = 15.0
"""Ratio of sizes from which on a part that is smaller or larger than the others is reported, since
it may be in another unit."""


COMMON_UNITS = tuple(unit for unit in MM_PER if unit != "mil")
"""Units that are guessed; boards are drawn in mils, but hardly any shape is exported in them."""


Use = Role | Literal["lights", "camera", "nothing"]
"""Use of a body: a part of some role, a reference for lights or the camera, or none."""


@dataclass(frozen=True)
class Body:
    """Body in a CAD file.

    Attributes:
        file: path as it was given.
        name: name of the body in a STEP file, else None.
        mesh: mesh in the file's own units; STEP files are in mm.
        own_units: whether the file states its units.
        kind: number that bodies of one name in one assembly of a STEP file share, else None.
    """

    file: str
    name: str | None
    mesh: TriangleMesh
    own_units: bool
    kind: int | None = None


class CadFiles:
    """CAD files of a recipe."""

    def __init__(self, folder: Path) -> None:
        """Store `folder`, the base of the files' paths."""
        self._folder = folder
        self._read: dict[Path, list[Body]] = {}

    def bodies(self, file: str) -> list[Body]:
        """Return all bodies in a file; STEP files may contain several, others contain one.

        Raises:
            SetupError: the file is a STEP file, but the extra for it is missing.
            MeshError: the file is missing, of another format, malformed or empty.
        """
        path = self._folder / file
        if path not in self._read:
            self._check_exists(path, file)
            if path.suffix.lower() in STEP_FORMATS:
                self._read[path] = [
                    Body(file, each.name, each.mesh, True, each.kind) for each in read_step(path)
                ]
            else:
                self._read[path] = [Body(file, None, _mesh(path), False)]
        return self._read[path]

    def load(self, shape: ShapeReference, units: str, where: str) -> TriangleMesh:
        """Return the mesh of a shape that comes from a file, mm; `units` are those of files that
        state none, and `where` is a name for messages, such as 'part gel (gel.stl)'.

        Raises:
            OptiSenseError: see `bodies`; or a STEP file lacks one of the bodies, or it has several
                and none is named.
        """
        assert shape.file is not None
        bodies = self.bodies(shape.file)
        body = bodies[0]
        if not body.own_units and shape.solid is not None:
            raise DesignError(
                "solid names a body of a STEP file, but this file is no STEP file",
                where=where,
                hint="Leave solid out",
            )
        if body.own_units:
            names = shape.solids or (None,)
            named = [_named(bodies, name, where) for name in names]
            if shape.units is not None:
                raise DesignError(
                    "a STEP file states its units", where=where, hint="Leave units out"
                )
            return joined(named)
        scale = MM_PER[shape.units or units]
        return body.mesh.with_vertices(scale * body.mesh.vertices) if scale != 1.0 else body.mesh

    def _check_exists(self, path: Path, file: str) -> None:
        if is_file(path):
            return
        siblings = path.parent.iterdir() if is_folder(path.parent) else ()
        near = near_match(path.name, [sibling.name for sibling in siblings])
        hint = f"Correct the path; it starts from the folder {self._folder}"
        if near is not None:
            hint = f"Did you mean '{Path(file).with_name(near).as_posix()}'?"
        looked_for = os.path.normpath(Path(os.path.realpath(self._folder)) / file)
        raise MeshError(f"there is no file '{brief(file)}'", where=looked_for, hint=hint)


def _mesh(path: Path) -> TriangleMesh:
    """Return the mesh of a file that is no STEP file, in the file's unit.

    Raises:
        MeshError: the file has another format, is malformed, or has no faces.
    """
    if path.suffix.lower() not in FORMATS:
        raise MeshError(
            f"a file of type '{path.suffix or 'unknown'}' can't be read",
            where=str(path),
            hint="In the CAD tool: export STL, OBJ, PLY or STEP",
        )
    try:
        return TriangleMesh.load(path)
    except MeshError as error:
        if "no triangles" not in error.message:
            raise
        raise MeshError(
            "the file has no faces",
            where=error.where,
            hint="In the CAD tool: show the body, select it, and export a solid or a surface as "
            "a mesh; sketches, points and hidden bodies have no faces",
        ) from None


def unread_files(folder: Path) -> list[str]:
    """Return a sentence that names the files of shapes in a folder which are not read; [] if there
    are none, or if `folder` is a file.
    """
    files = sorted(folder.iterdir()) if is_folder(folder) else []
    names = [file.name for file in files if file.suffix.lower() in OTHER_FORMATS]
    told = f"not read: {brief(', '.join(names))} (export as STL, OBJ, PLY or STEP)"
    return [told] if names else []


def obj_objects(path: Path) -> list[str]:
    """Return the names of the objects in an OBJ file, which are read as one body; [] for other
    files.
    """
    if path.suffix.lower() != ".obj":
        return []
    lines = path.read_bytes().splitlines()
    return [line[2:].strip().decode(errors="replace") for line in lines if line[:2] == b"o "]


def joined(bodies: Sequence[Body]) -> TriangleMesh:
    """Return the mesh of one or several bodies."""
    meshes = [body.mesh for body in bodies]
    return meshes[0] if len(meshes) == 1 else TriangleMesh.joined(meshes)


def _named(bodies: list[Body], name: str | None, where: str) -> Body:
    """Return the body of a name, or the only body if no name is given.

    Raises:
        DesignError: no body has this name, or there are several and none is named.
    """
    if name is None and len(bodies) == 1:
        return bodies[0]
    known = [body.name or "" for body in bodies]
    if name in known:
        return bodies[known.index(name)]
    listed = ", ".join(known[:20])
    raise DesignError(
        f"the STEP file has no body '{name}'"
        if name
        else f"the STEP file holds {len(bodies)} bodies; solid must name one of them",
        where=where,
        hint=f"Set solid to one of {listed}",
    )


def largest_dimension(meshes: Iterable[TriangleMesh]) -> float:
    """Return the longest side of the bounding box of all meshes, mm."""
    corners = np.array([mesh.bounds for mesh in meshes])
    return float((corners[:, 1].max(axis=0) - corners[:, 0].min(axis=0)).max())


def likely_units(size: float) -> list[str]:
    """Return the units in which the number `size` is a plausible size of a sensor."""
    return [unit for unit in COMMON_UNITS if SMALLEST <= size * MM_PER[unit] <= LARGEST]


def refuse_odd_units(
    meshes: dict[str, TriangleMesh], units: str | None, gels: Collection[str] = ()
) -> list[str]:
    """Return what is unusual about the sizes (mm) of parts, one sentence each.

    Args:
        meshes: meshes by their origin, such as 'part gel (gel.stl)', of files without units.
        units: units that were given; None if mm was assumed.
        gels: names in `meshes` of the elastomers, which are nearly as large as the sensor.

    Raises:
        MeshError: the whole is too small or too large for a tactile sensor, or one part is far
            smaller or larger than the others; the message says which units would be plausible.
    """
    if not meshes:
        return []
    notes = _odd_parts(meshes, MM_PER[units or "mm"], gels) if len(meshes) > 1 else []
    whole = largest_dimension(meshes.values())
    if SMALLEST <= whole <= LARGEST or (units is not None and 0.5 <= whole <= 1000.0):
        return notes
    given = units or "mm"
    number = whole / MM_PER[given]
    likely = likely_units(number)
    fitting = [f"{unit} (then it is {number * MM_PER[unit]:.3g} mm)" for unit in likely]
    large = f"{whole:.4g} mm" if whole < 1e4 else f"{whole / 1000:.4g} m"
    raise MeshError(
        f"the sensor would be {large} large if its files are in {given}",
        where=", ".join(meshes),
        hint=("The files look as if they were in " + " or ".join(fitting) + ": give --units "
              + " or ".join(likely) + ", or units: in the recipe")
        if fitting
        else "Look up the export units in the CAD tool, and give them with --units",
    )  # fmt: skip


def _odd_parts(meshes: dict[str, TriangleMesh], scale: float, gels: Collection[str]) -> list[str]:
    """Return notes on parts that are much smaller or larger than the others, and refuse obvious
    errors; `scale` is the length of the files' unit, mm.
    """
    notes = []
    sizes = {where: float(np.ptp(mesh.bounds, axis=0).max()) for where, mesh in meshes.items()}
    fair = [size for size in sizes.values() if 1.0 <= size <= LARGEST]
    typical = float(np.median(fair or list(sizes.values())))
    for where, size in sizes.items():
        ratio = max(size / typical, typical / size)
        if ratio <= SMALL_PART:
            continue
        others = [
            u for u in MM_PER if u != "mil" and 0.1 < size / scale * MM_PER[u] / typical < 10.0
        ]
        unit = f"units: {others[-1] if ratio <= ODD_PART else others[0]}" if others else "units:"
        if ratio > ODD_PART or (where in gels and size < SMALLEST):
            raise MeshError(
                f"the part is {size:.4g} mm large, the other parts are {typical:.4g} mm: its "
                "file is in another unit",
                where=where,
                hint=f"Export it in the unit of the others, or give this part its own {unit}",
            )
        notes.append(
            f"{where} is {size:.3g} mm large, the other parts about {typical:.3g} mm: if its file "
            f"is in another unit, give it its own {unit}"
        )
    return notes


@dataclass(frozen=True)
class CadBody:
    """Body in the user's CAD files.

    Attributes:
        name: name for a part of the design, made of the body's or file's name.
        file: path of the file from the folder of the recipe.
        body: body that was read; its mesh is in the file's own units.
        use: probable use.
        copies: further lights of its name on the same side of the gel, which count as one with it.
    """

    name: str
    file: str
    body: Body
    use: Use
    copies: tuple[Body, ...] = ()

    @property
    def solid(self) -> str | list[str] | None:
        """Name of the body in a STEP file, or names of it and its copies."""
        names = [each.name for each in (self.body, *self.copies) if each.name is not None]
        return names if self.copies else self.body.name

    @property
    def shape(self) -> ShapeReference:
        """Reference to the body in a recipe."""
        return ShapeReference(file=self.file, solid=self.solid)

    def mesh(self, units: Units | None) -> TriangleMesh:
        """Return its mesh in mm; `units` is that of files that don't state theirs (mm if None)."""
        if self.body.own_units:
            return joined((self.body, *self.copies))
        scale = MM_PER[units or "mm"]
        return self.body.mesh.with_vertices(scale * self.body.mesh.vertices)


def with_copies(found: list[CadBody]) -> list[CadBody]:
    """Return the bodies, with lights of one kind on one side of the gel taken together."""
    carrier = carrier_of({each.name: each.use for each in found})
    gel = next((each.body.mesh.bounds for each in found if each.name == carrier), np.zeros((2, 3)))
    groups: dict[tuple[object, ...], CadBody] = {}
    for each in found:
        key: tuple[object, ...] = (each.name,)
        if each.use == "lights" and each.body.kind is not None:
            side = nearest_side((gel - each.body.mesh.bounds).mean(axis=0))
            key = (each.file, each.body.kind, side)
        first = groups.setdefault(key, each)
        if first is not each:
            groups[key] = replace(first, copies=(*first.copies, each.body))
    return list(groups.values())


def carrier_of(uses: Mapping[str, Use]) -> str | None:
    """Return the name of the body that carries the coating: the first gel, else the first support,
    else the sensing surface itself; None if there is none of them.
    """
    roles = (Role.ELASTOMER, Role.SUPPORT, Role.SENSING_SURFACE)
    return next((name for role in roles for name, use in uses.items() if use is role), None)

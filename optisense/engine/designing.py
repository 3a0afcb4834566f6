"""Requests about designs that need no renderer: opening, saving, checking, cages, the workshop."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import Field

from optisense.commands.options import MOST_MARGIN
from optisense.design import (
    Role,
    SensorDesign,
    add_cage,
    refine_cage,
    remove_cage,
    save_design,
    set_range,
    settle_cage,
)
from optisense.design.parts import TRANSPARENT_SOLIDS
from optisense.design.storage import digest_of
from optisense.engine.designs import AnyMesh
from optisense.engine.failures import ProtocolError, problem_row
from optisense.engine.jobs import Job
from optisense.engine.protocol import Fields
from optisense.engine.rendering import DesignFields, blender_pixels, design_of
from optisense.engine.requests import Lane, handles, listed
from optisense.engine.session import Files, Session
from optisense.errors import DesignError, MeshError
from optisense.geometry import TriangleMesh, cage_weights
from optisense.library import with_own_lights
from optisense.near import suggestion
from optisense.sensors.registry import SENSORS
from optisense.sensors.stored_drafts import stored_draft

SAME_PLACE = 1e-6
"""Largest distance, mm, between a vertex of a bent part and its place at rest that counts as rest:
the rounding of coordinates in float32.
"""

Resolution = tuple[int, int, int]
Place = tuple[float, float, float]


class Save(DesignFields):
    """Fields of the request "save"; see docs/engine.md."""

    to: str
    only_new: bool = False
    digest: str | None = None


class Mesh(Fields):
    """Fields of the request "mesh"; see docs/engine.md."""

    file: AnyMesh
    role: Role | None = None
    scale: float = Field(default=1.0, ge=1e-9, le=1e6)


class ChangeCage(DesignFields):
    """Fields of the request "cage"; see docs/engine.md."""

    action: Literal["add", "remove", "refine", "range", "settle"]
    cage: str
    parts: list[str] = Field(default_factory=list)
    resolution: Resolution = (3, 3, 3)
    margin: float = Field(default=0.0, ge=0.0, le=MOST_MARGIN)
    c_min: list[Place] | None = None
    c_max: list[Place] | None = None
    blend: float | None = Field(default=0.0, ge=0.0, le=1.0)


class CageWeights(DesignFields):
    """Fields of the request "cage_weights"; see docs/engine.md."""

    cage: str


class Export(DesignFields):
    """Fields of the request "export"; see docs/engine.md."""

    to: str
    formats: list[str] = Field(default=["stl"])
    moulds: bool = False


class ExportRobot(DesignFields):
    """Fields of the request "export_robot"; see docs/engine.md."""

    to: str
    formats: list[str] = Field(default=["mujoco"])
    mass: float | None = Field(default=None, gt=0.0)
    densities: dict[str, float] = Field(default_factory=dict)


@handles("sensors", Fields, Lane.QUICK)
def sensors(session: Session, fields: Fields, job: Job) -> dict[str, Any]:
    """Return the names and descriptions of the built-in sensors."""

    def row(name: str, builder: object) -> dict[str, Any]:
        job.check()
        return {"name": name, "description": session.designs.read(name).description}

    rows, failed = listed(SENSORS, row)
    return {"sensors": rows, "unavailable": failed}


@handles("open", DesignFields, Lane.QUICK)
def open_design(session: Session, fields: DesignFields, job: Job) -> dict[str, Any]:
    """Return a design as JSON, with its meshes."""
    files = session.files(fields, job.id)
    design = design_of(session, fields, job)
    warnings = [p for p in session.designs.problems(design) if p.severity == "warning"]
    draft = stored_draft(design)
    return {
        "data": design.model_dump(mode="json"),
        "meshes": files.meshes(design.meshes),
        "shapes": bent_shapes(design, files),
        "warnings": [problem_row(each, design) for each in warnings],
        "draft": None if draft is None else files.array("draft.npy", blender_pixels(draft)),
    }


@handles("save", Save, Lane.QUICK)
def save(session: Session, fields: Save, job: Job) -> dict[str, Any]:
    """Write a design folder.

    Raises:
        DesignError: a part does not lie in its cage, so that the folder could not be opened again.
        OutputError: another program has changed the folder.
    """
    folder = Path(fields.to)
    named = fields.design if isinstance(fields.design, str) else fields.design.source
    # Before the files are read: a change meanwhile is noticed by the next save.
    source = digest_of(named) if named is not None and Path(named).is_absolute() else None
    design = design_of(session, fields, job)
    design.deformed_meshes()  # raises for a part outside its cage
    save_design(with_own_lights(design), folder, new=fields.only_new, digest=fields.digest)
    return {"folder": str(folder), "digest": digest_of(folder), "source_digest": source}


@handles("mesh", Mesh, Lane.QUICK)
def mesh(session: Session, fields: Mesh, job: Job) -> dict[str, Any]:
    """Read a mesh file, and report the problems that it has for a part with a role."""
    files = session.files(fields, job.id)
    found = session.designs.mesh(fields.file, fields.scale)
    problem = None
    try:
        found = found.validate("mesh", closed=fields.role in TRANSPARENT_SOLIDS)
    except MeshError as error:
        problem = {"message": error.message, "where": error.where, "hint": error.hint}
    return {
        "mesh": files.mesh("mesh", found),
        "closed": found.is_closed if problem is None else None,
        "bounds": found.bounds,
        "problem": problem,
    }


@handles("check", DesignFields, Lane.QUICK)
def check(session: Session, fields: DesignFields, job: Job) -> dict[str, Any]:
    """Return all problems of a design that can be found without tracing light."""
    design = design_of(session, fields, job)
    found = session.designs.problems(design)
    return {"problems": [problem_row(each, design) for each in found]}


@handles("cage", ChangeCage, Lane.QUICK)
def cage(session: Session, fields: ChangeCage, job: Job) -> dict[str, Any]:
    """Return a design with a cage added, removed or changed."""
    design = design_of(session, fields, job)
    if fields.action == "add":
        changed = add_cage(design, fields.cage, fields.parts, fields.resolution, fields.margin)
    elif fields.action == "remove":
        changed = remove_cage(design, fields.cage)
    elif fields.action == "refine":
        changed = refine_cage(design, fields.cage, fields.resolution)
    elif fields.action == "range":
        for name in ("c_min", "c_max"):
            _check_count(design, fields, name)
        changed = set_range(design, fields.cage, fields.c_min, fields.c_max, fields.blend)
    else:
        changed = settle_cage(design, fields.cage)
    return {"cages": changed.model_dump(mode="json", include={"cages"})["cages"]}


@handles("cage_weights", CageWeights, Lane.QUICK)
def weights(session: Session, fields: CageWeights, job: Job) -> dict[str, Any]:
    """Return the weights of the control points of a cage for the vertices of its parts."""
    files = session.files(fields, job.id)
    design = design_of(session, fields, job)
    if fields.cage not in design.cages:
        hint = suggestion(fields.cage, design.cages, limit=20)
        raise DesignError(f"there is no cage '{fields.cage}'", where="cages", hint=hint)
    chosen = design.cages[fields.cage]
    written = {}
    for part in chosen.parts:
        job.check()
        values = cage_weights(design.meshes[part].vertices, chosen.box, chosen.resolution)
        written[part] = files.array(f"{part}.weights.npy", values.astype(np.float32))
    return {"weights": written, "points": int(np.prod(chosen.resolution))}


@handles("export", Export, Lane.QUICK)
def export(session: Session, fields: Export, job: Job) -> dict[str, Any]:
    """Write files for the workshop."""
    from optisense.workshop import export as write

    design = design_of(session, fields, job)
    notes: list[str] = []
    written = write(design, fields.to, fields.formats, notes, with_moulds=fields.moulds)
    return {"files": [str(path) for path in written], "notes": notes}


@handles("export_robot", ExportRobot, Lane.QUICK)
def export_robot(session: Session, fields: ExportRobot, job: Job) -> dict[str, Any]:
    """Write files for robot simulators."""
    from optisense.robots import export_robot as write

    design = design_of(session, fields, job)
    notes: list[str] = []
    written = write(
        design,
        fields.to,
        fields.formats,
        notes,
        mass=fields.mass,
        densities=fields.densities,
    )
    return {"files": [str(path) for path in written], "notes": notes}


def bent_shapes(
    design: SensorDesign, files: Files, before: SensorDesign | None = None
) -> dict[str, dict[str, str]]:
    """Write the parts whose present shape differs from their mesh at rest, or from `before`."""
    shapes = design.deformed_meshes()
    others = design.meshes if before is None else before.deformed_meshes()
    bent = {name: mesh for name, mesh in shapes.items() if not _alike(mesh, others.get(name))}
    return files.meshes(bent, "shape.")


def _alike(one: TriangleMesh, other: TriangleMesh | None) -> bool:
    return other is not None and (
        one is other
        or (
            one.vertices.shape == other.vertices.shape
            and bool((abs(one.vertices - other.vertices) < SAME_PLACE).all())
        )
    )


def _check_count(design: SensorDesign, fields: ChangeCage, name: str) -> None:
    given = getattr(fields, name)
    known = design.cages.get(fields.cage)
    if given is not None and known is not None and len(given) != np.prod(known.resolution):
        raise ProtocolError(
            f"{name} has {len(given)} points, the cage {int(np.prod(known.resolution))}",
            where=name,
            hint="Give one point for each control point of the cage",
        )

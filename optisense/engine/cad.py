"""Requests that make a sensor from the user's CAD files, or an empty one."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

from pydantic import Field

from optisense.design.sensor_design import SCHEMA_VERSION
from optisense.engine.failures import ProtocolError
from optisense.engine.jobs import Job
from optisense.engine.protocol import Fields
from optisense.engine.requests import Lane, handles
from optisense.engine.session import Session
from optisense.length_units import Units
from optisense.near import suggestion
from optisense.sensors.registry import save_design

AnyUse = Literal[
    "sensing_surface", "elastomer", "support", "mirror", "blocker", "interface", "indenter",
    "lights", "camera", "nothing",
]  # fmt: skip

COATING = "diffuse-grey"
"""Coating of the library that an empty sensor has."""


class Cad(Fields):
    """Fields of the request "cad"; see docs/engine.md."""

    files: list[str] = Field(min_length=1)
    units: Units | None = None


class FromCad(Cad):
    """Fields of the request "from_cad"; see docs/engine.md."""

    uses: dict[str, AnyUse] = Field(default_factory=dict)
    to: str


@handles("cad", Cad, Lane.QUICK)
def cad(session: Session, fields: Cad, job: Job) -> dict[str, Any]:
    """Return the bodies of CAD files, the probable use of each, and the unit of their lengths."""
    from optisense.sensors.from_meshes import guessing

    files = session.files(fields, job.id)
    bodies = _bodies(fields.files)
    units = fields.units or guessing.guess_units(bodies)
    rows = []
    for each in bodies:
        job.check()
        mesh = each.mesh(units)
        rows.append(
            {
                "name": each.name,
                "file": each.file,
                "solid": each.solid,
                "use": str(getattr(each.use, "value", each.use)),
                "own_units": each.body.own_units,
                "closed": mesh.welded().is_closed,
                "size": (mesh.bounds[1] - mesh.bounds[0]).tolist(),
                "mesh": files.mesh(each.name, mesh),
            }
        )
    return {"bodies": rows, "units": units or "mm"}


@handles("from_cad", FromCad, Lane.QUICK)
def from_cad(session: Session, fields: FromCad, job: Job) -> dict[str, Any]:
    """Write a design folder made of CAD files, with default lights and a default camera."""
    from optisense.design import Role
    from optisense.sensors.from_meshes import design_from_meshes
    from optisense.sensors.from_meshes.guessing import recipe_of

    bodies = _bodies(fields.files)
    uses = {
        name: use if use in ("lights", "camera", "nothing") else Role(use)
        for name, use in fields.uses.items()
    }
    unknown = sorted(set(uses) - {each.name for each in bodies})
    if unknown:
        raise ProtocolError(
            f"the files have no body '{unknown[0]}'",
            where="uses",
            hint=suggestion(unknown[0], [each.name for each in bodies], limit=20),
        )
    source = Path(fields.files[0])
    recipe = recipe_of(
        bodies, source if len(fields.files) == 1 else source.parent, fields.units, uses
    )
    made = design_from_meshes(recipe)
    save_design(made.design, Path(fields.to), new=True)
    return {"folder": fields.to, "notes": list(made.notes)}


@handles("empty", Fields, Lane.QUICK)
def empty(session: Session, fields: Fields, job: Job) -> dict[str, Any]:
    """Return the data of a sensor that has no part, no light and no camera yet."""
    from optisense import library

    coating = library.coating(COATING)
    return {
        "data": {
            "schema_version": SCHEMA_VERSION,
            "name": "my-sensor",
            "description": "",
            "coating": coating.model_dump(mode="json") | {"library": COATING},
            "materials": {},
            "parts": {},
            "lights": {},
            "cages": {},
            "provenance": {},
        }
    }


def _bodies(files: list[str]) -> list[Any]:
    from optisense.sensors.from_meshes.guessing import find_bodies

    paths = [Path(file) for file in files]
    for path in paths:
        if not path.is_absolute() or path.parent != paths[0].parent:
            raise ProtocolError(
                f"'{path}' is not in the folder of the first file",
                where="files",
                hint="Give absolute paths of files in one folder, or one folder",
            )
    if len(paths) == 1:
        return find_bodies(paths[0])
    return find_bodies(paths[0].parent, [path.name for path in paths])

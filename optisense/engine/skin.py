"""Requests about the skin: contacts on it, the area that the camera sees, and markers."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from pydantic import Field

from optisense.engine.contacts import (
    AnyContact,
    GivenIndenter,
    contacts_of,
    errors_naming_contact,
    plain_contact,
)
from optisense.engine.jobs import Job
from optisense.engine.rendering import DesignFields, design_of
from optisense.engine.requests import Lane, handles
from optisense.engine.session import Session
from optisense.geometry import locate
from optisense.geometry.indenter_kinds import indenter_from_plain


class Place(DesignFields):
    """Fields of the request "place"; see docs/engine.md."""

    contacts: list[AnyContact]


class NinePlaces(DesignFields):
    """Fields of the request "nine_places"; see docs/engine.md."""

    indenter: GivenIndenter
    depth: float = 0.5
    rotation: float = 0.0


@handles("place", Place, Lane.RENDER)
def place(session: Session, fields: Place, job: Job) -> dict[str, Any]:
    """Write the meshes of contacts in their positions on the surface."""
    files = session.files(fields, job.id)
    model = session.renderer.model(design_of(session, fields, job))
    rows = []
    contacts = contacts_of(fields.contacts)
    with errors_naming_contact(contacts, model.place):
        for number, contact in enumerate(contacts):
            spot = locate(contact, model.surface)
            rows.append(
                {
                    "point": spot.point,
                    "inward": spot.inward,
                    "mesh": files.mesh(f"contact{number}", model.place(contact)),
                }
            )
    return {"contacts": rows}


@handles("nine_places", NinePlaces, Lane.RENDER)
def nine_places(session: Session, fields: NinePlaces, job: Job) -> dict[str, Any]:
    """Return nine contacts that cover the area that the camera sees."""
    model = session.renderer.model(design_of(session, fields, job))
    found = model.nine_contacts(indenter_from_plain(fields.indenter), fields.depth)
    turned = [replace(contact, rotation=fields.rotation) for contact in found]
    return {"contacts": [plain_contact(contact, fields.indenter) for contact in turned]}


WIDTH = 96
"""Default number of columns of the grid of chief rays: it locates the border of the footprint to a
hundredth of the picture, in some milliseconds.
"""

MOST = 640
"""Largest number of columns or rows of the grid, the number of pixels across a usual picture."""


class FootprintGrid(DesignFields):
    """Fields of the request "footprint"; see docs/engine.md."""

    columns: int = Field(default=WIDTH, ge=2, le=MOST)


@handles("footprint", FootprintGrid, Lane.RENDER)
def footprint(session: Session, fields: FootprintGrid, job: Job) -> dict[str, Any]:
    """Write the points where a grid of chief rays meets the sensing surface, and return the share
    of the surface that they see.
    """
    from optisense.objectives.view import view_of

    files = session.files(fields, job.id)
    design = design_of(session, fields, job)
    rows = min(max(2, design.camera.size_at(fields.columns)[1]), MOST)
    # The model for drafts follows the edits; that for whole pictures keeps its light.
    model = session.renderer.draft_model(design)
    rays = model.chief_rays((fields.columns, rows))
    view = view_of(rays, model.sensing)
    return {
        "files": {
            "points": files.array("footprint.points.npy", rays.points.astype(np.float32)),
            "normals": files.array("footprint.normals.npy", rays.normals.astype(np.float32)),
            "hit": files.array("footprint.hit.npy", rays.hit.astype(np.uint8)),
        },
        "size": [fields.columns, rows],
        "skin": view.skin,
        "picture": view.picture,
    }


@handles("markers", DesignFields, Lane.RENDER)
def markers(session: Session, fields: DesignFields, job: Job) -> dict[str, Any]:
    """Write the positions of the dots that are printed on the skin."""
    from optisense.optics.imaging.markers import MarkerDots

    files = session.files(fields, job.id)
    design = design_of(session, fields, job)
    if design.markers is None:
        return {"files": {}, "count": 0, "radius": 0.0}
    model = session.renderer.draft_model(design)
    dots = MarkerDots.on(design.markers, model.surface)
    return {
        "files": {
            "points": files.array("markers.points.npy", dots.points.astype(np.float32)),
            "normals": files.array("markers.normals.npy", dots.normals.astype(np.float32)),
        },
        "count": len(dots.points),
        "radius": dots.radius,
    }

"""Requests that place contacts on the sensing surface."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

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

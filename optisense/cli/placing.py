"""Contacts as the command line needs them: tried on the surface, and as shapes for the report."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from optisense.errors import ContactError

if TYPE_CHECKING:
    from optisense.geometry import Contact, TriangleMesh
    from optisense.optics import OpticalModel


def place_contacts(model: OpticalModel, contacts: Sequence[Contact]) -> dict[str, TriangleMesh]:
    """Place contacts on a model's sensing surface.

    Returns:
        The indenters' meshes in the design's frame (mm), by a name to show.

    Raises:
        ContactError: one is off the surface or deeper than the gel.
    """
    placed = {}
    for number, contact in enumerate(contacts, 1):
        kind = type(contact.indenter).__name__.removesuffix("Indenter").lower()
        placed[f"{kind} {number}"] = _place(model, contact)
    return placed


def _place(model: OpticalModel, contact: Contact) -> TriangleMesh:
    from optisense.geometry import place

    failure: ContactError | None = None
    gels: list[TriangleMesh | None] = [*model.gels]
    for gel in gels or [None]:
        try:
            return place(contact, model.surface, gel)
        except ContactError as error:
            failure = failure or error
    assert failure is not None
    raise failure

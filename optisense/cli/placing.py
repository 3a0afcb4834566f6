"""Contacts as the command line needs them: tried on the surface, and as shapes for the report."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

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
        placed[f"{kind} {number}"] = model.place(contact)
    return placed

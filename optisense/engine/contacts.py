"""Contacts in requests."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict

from optisense.array_types import FloatingArray
from optisense.engine.failures import WrongContactError
from optisense.errors import ContactError, MeshError, OptiSenseError
from optisense.geometry import Contact, TriangleMesh
from optisense.geometry.contact_text import parse_contact
from optisense.geometry.indenter_kinds import indenter_from_plain

FLOAT32_TOLERANCE = 1e-3
"""Tolerance, mm, for the distance between a point that a pixel sees and the mesh: far above the
rounding of 30 mm to float32 (2e-6 mm), and far below a pixel.
"""


Place = Callable[[Contact], TriangleMesh]
"""Function that presses a contact in: `OpticalModel.place`."""


GivenIndenter = dict[str, Any]
"""Indenter as an object: its kind, and the parameters of the kind by name."""


class GivenContact(BaseModel):
    """Contact as an object."""

    model_config = ConfigDict(extra="forbid")

    indenter: GivenIndenter
    at: tuple[float, float] | None = None
    point: tuple[float, float, float] | None = None
    depth: float = 0.5
    rotation: float = 0.0
    along: tuple[float, float, float] | None = None
    force: float | None = None
    shift: tuple[float, float] | None = None
    twist: float | None = None


AnyContact = str | GivenContact
"""Contact in a request's `contacts`: a text or an object."""


def contact_of(given: AnyContact) -> Contact:
    """Return the contact that a request gives.

    Raises:
        ContactError: the contact can't be read, or a number is out of its range.
    """
    if isinstance(given, str):
        return parse_contact(given)
    # Front ends send the depth of their control with a force, too, which then determines the depth.
    left_out = {"indenter"} if given.force is None else {"indenter", "depth"}
    numbers = given.model_dump(exclude=left_out, exclude_none=True)
    return Contact(indenter_from_plain(given.indenter), **numbers)


def contacts_of(given: list[AnyContact]) -> list[Contact]:
    """Return the contacts that a request gives; an error names the contact.

    Raises:
        WrongContactError: a contact can't be read; see `contact_of`.
    """
    found = []
    for number, each in enumerate(given):
        try:
            found.append(contact_of(each))
        except OptiSenseError as error:
            raise WrongContactError(error, number) from None
    return found


@contextmanager
def errors_naming_contact(contacts: Sequence[Contact], place: Place) -> Iterator[None]:
    """Context in which an error about one of several contacts names that contact.

    Args:
        place: function that presses one contact in, and raises an error if it can't.

    Raises:
        WrongContactError: a contact causes the error by itself.
    """
    try:
        yield
    except (ContactError, MeshError):
        for number, each in enumerate(contacts):
            try:
                place(each)
            except OptiSenseError as error:
                raise WrongContactError(error, number) from None
        raise


def unseen(
    placed: Iterable[TriangleMesh], points: FloatingArray, touched: NDArray[np.bool_]
) -> list[int]:
    """Return the indices, from 0, of the contacts that no pixel sees, so that a picture does not
    show them.

    Args:
        placed: mesh of each contact in its pressed position.
        points: points (h, w, 3), mm, that the pixels see.
        touched: mask (h, w), true where a pixel sees an indenter.
    """
    seen = points[touched]
    found = []
    for number, mesh in enumerate(placed):
        lower, upper = (
            mesh.vertices.min(axis=0) - FLOAT32_TOLERANCE,
            mesh.vertices.max(axis=0) + FLOAT32_TOLERANCE,
        )
        if not ((seen >= lower) & (seen <= upper)).all(axis=1).any():
            found.append(number)
    return found


def plain_contact(contact: Contact, indenter: GivenIndenter) -> dict[str, Any]:
    """Return a contact as data that a request can give again."""
    names = set(GivenContact.model_fields) - {"indenter"}
    given = {name: getattr(contact, name) for name in names}
    changed = {name: value for name, value in given.items() if value != getattr(Contact, name)}
    return GivenContact(indenter=indenter, **changed).model_dump(exclude_none=True)

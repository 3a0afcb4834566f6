"""Contacts as requests write them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict

from optisense.engine.failures import WrongContactError
from optisense.errors import ContactError, MeshError, OptiSenseError
from optisense.geometry import Contact, TriangleMesh
from optisense.geometry.contact_text import parse_contact
from optisense.geometry.indenter_kinds import indenter_from_plain

ROUNDED = 1e-3
"""mm by which a point that a pixel sees may lie beside the mesh that it sees."""

FloatArray = NDArray[np.float32] | NDArray[np.float64]

Place = Callable[[Contact], TriangleMesh]
"""Presses a contact in: `OpticalModel.place`."""


GivenIndenter = dict[str, Any]
"""An indenter as an object: its kind, and the numbers of the kind by name."""


class GivenContact(BaseModel):
    """A contact as an object."""

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
"""A contact in a request's `contacts`."""


def contact_of(given: AnyContact) -> Contact:
    """The contact.

    Raises:
        ContactError: it can't be read, or its numbers make no sense.
    """
    if isinstance(given, str):
        return parse_contact(given)
    return Contact(
        indenter_from_plain(given.indenter),
        at=given.at,
        point=given.point,
        depth=given.depth,
        rotation=given.rotation,
        along=given.along,
        force=given.force,
        shift=given.shift or Contact.shift,
        twist=given.twist or Contact.twist,
    )


def contacts_of(given: list[AnyContact]) -> list[Contact]:
    """The contacts; an error says which one it is.

    Raises:
        WrongContactError: as of `contact_of`.
    """
    found = []
    for number, each in enumerate(given):
        try:
            found.append(contact_of(each))
        except OptiSenseError as error:
            raise WrongContactError(error, number) from None
    return found


@contextmanager
def telling_which(contacts: Sequence[Contact], place: Place) -> Iterator[None]:
    """What is done with all contacts at once: an error about one of them says which one.

    Args:
        contacts: all.
        place: presses one in, and raises what is wrong with it.

    Raises:
        WrongContactError: in place of the error that one of them causes by itself.
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
    placed: Iterable[TriangleMesh], points: FloatArray, touched: NDArray[np.bool_]
) -> list[int]:
    """Which contacts no pixel sees, so that a picture does not show them; the first is 0.

    Args:
        placed: the mesh of each where it presses.
        points: (h, w, 3) mm, what each pixel sees.
        touched: (h, w) where a pixel sees an indenter.
    """
    seen = points[touched]
    found = []
    for number, mesh in enumerate(placed):
        lower, upper = mesh.vertices.min(axis=0) - ROUNDED, mesh.vertices.max(axis=0) + ROUNDED
        if not ((seen >= lower) & (seen <= upper)).all(axis=1).any():
            found.append(number)
    return found


def plain_contact(contact: Contact, indenter: GivenIndenter) -> dict[str, Any]:
    """A contact as a request can give it again."""
    given = GivenContact(
        indenter=indenter,
        at=contact.at,
        point=contact.point,
        depth=contact.depth,
        rotation=contact.rotation,
        along=contact.along,
        force=contact.force,
        shift=None if contact.shift == Contact.shift else contact.shift,
        twist=contact.twist or None,
    )
    return given.model_dump(exclude_none=True)

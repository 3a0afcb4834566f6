"""The two models of a skin under contacts."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from optisense.errors import ContactError

if TYPE_CHECKING:
    from optisense.geometry import Contact

CONFORMING = "conforming"
"""The model in which the skin takes an indenter's shape where they overlap, and rests elsewhere."""
ELASTIC = "elastic"
"""The model in which the skin deforms like an elastic layer on a rigid base, also around a
contact."""
SKINS = ELASTIC, CONFORMING


def refuse_drags(contacts: Iterable[Contact], skin: str) -> None:
    """Refuse dragged and turned contacts on a conforming skin, which has no friction.

    Raises:
        ContactError: a contact has a shift or a twist, and the skin is conforming.
    """
    if skin == CONFORMING and any(any(each.shift) or each.twist for each in contacts):
        raise ContactError(
            "a contact has a shift or a twist, which move no conforming skin",
            hint=f"Take the {ELASTIC} skin, or leave them out",
        )

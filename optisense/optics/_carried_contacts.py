"""Contacts that follow a skin while it is bent."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from optisense.geometry import Contact, TriangleMesh
from optisense.geometry.mesh_points import anchored
from optisense.optics.scene.media import same_faces

ON_SKIN = 1e-3
"""Largest distance of a contact's point from the skin, mm; it covers rounding to float32."""

PLACE_ERROR = 0.15
"""Largest distance between a contact and the point to which the skin carried it, mm: about a pixel
of a draft, which shows some 20 mm of skin with 160 pixels."""

TURN_ERROR = 0.05
"""Largest angle between the directions of a contact's x axis before and after, radians: 3 degrees
move the rim of a contact of 3 mm by 0.15 mm, see `PLACE_ERROR`."""


@dataclass(frozen=True)
class PressedContacts:
    """Contacts, and the undeformed skin into which they were pressed.

    Attributes:
        contacts: contacts.
        skin: undeformed skin.
    """

    contacts: tuple[Contact, ...]
    skin: TriangleMesh

    def carried_to(self, contacts: Sequence[Contact], skin: TriangleMesh) -> bool:
        """Return whether other contacts are these ones, carried along by the skin.

        Args:
            contacts: contacts on the skin in its new shape.
            skin: undeformed skin in its new shape.
        """
        if len(contacts) != len(self.contacts) or not same_faces(self.skin, skin):
            return False
        starts, ends = [], []
        for old, new in zip(self.contacts, contacts, strict=True):
            if replace(old, point=new.point, along=new.along, at=new.at) != new or old.at != new.at:
                return False
            if old.point == new.point and old.along == new.along:
                continue
            if old.point is None or new.point is None or _turn(old, new) > TURN_ERROR:
                return False
            starts.append(old.point)
            ends.append(new.point)
        if not starts:
            return True
        anchors, found = anchored(np.array(starts), self.skin, ON_SKIN)
        away = np.linalg.norm(anchors.on(skin.vertices) - np.array(ends), axis=1)
        return bool(found.all() and (away <= PLACE_ERROR).all())


def _turn(one: Contact, other: Contact) -> float:
    """Return the angle between the directions of the x axes of two contacts, radians."""
    if one.along is None or other.along is None:
        return 0.0 if one.along is other.along else np.pi
    a, b = np.asarray(one.along), np.asarray(other.along)
    cosine = a @ b / (np.linalg.norm(a) * np.linalg.norm(b))
    return float(np.arccos(np.clip(cosine, -1.0, 1.0)))

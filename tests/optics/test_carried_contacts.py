"""Contacts that a bent skin carries along are recognised, and others are not."""

from __future__ import annotations

import numpy as np
import pytest

import optisense as ots
from optisense.geometry import TriangleMesh
from optisense.optics._carried_contacts import PLACE_ERROR, PressedContacts

SIDE = 5.0
BALL = ots.Sphere(radius=2.0)


def skin(height: float) -> TriangleMesh:
    """A square that is shifted along z."""
    corners = [(x, y, height) for x, y in ((0, 0), (SIDE, 0), (SIDE, SIDE), (0, SIDE))]
    return TriangleMesh(np.array(corners, float), np.array([[0, 1, 2], [0, 2, 3]], np.int32))


def contact(x: float, y: float, z: float, **kwargs: object) -> ots.Contact:
    return ots.Contact(BALL, point=(x, y, z), **{"depth": 0.5, **kwargs})


@pytest.mark.parametrize(
    ("new", "is_carried"),
    [
        (contact(2, 1, 0.7), True),
        (contact(2 + 0.9 * PLACE_ERROR, 1, 0.7), True),
        (contact(2 + 1.1 * PLACE_ERROR, 1, 0.7), False),
        (contact(2, 1, 0.0), True),  # given as it was: its nearest point of the skin is taken
        (contact(2, 1, 0.7, depth=0.6), False),
        (contact(2, 1, 0.7, rotation=5.0), False),
        (contact(2, 1, 0.7, along=(1.0, 0.0, 0.0)), False),
        (ots.Contact(BALL, at=(2, 1), depth=0.5), False),
        (ots.Contact(ots.Sphere(radius=1.0), point=(2, 1, 0.7), depth=0.5), False),
    ],
)
def test_a_contact_is_carried_where_the_skin_took_it(new: ots.Contact, is_carried: bool) -> None:
    pressed = PressedContacts((contact(2, 1, 0),), skin(0.0))
    assert pressed.carried_to([new], skin(0.7)) == is_carried


def test_the_direction_of_a_contact_may_turn_by_little() -> None:
    pressed = PressedContacts((contact(2, 1, 0, along=(1.0, 0.0, 0.0)),), skin(0.0))
    for turn, is_carried in ((0.04, True), (0.06, False)):
        along = (np.cos(turn), np.sin(turn), 0.0)
        assert pressed.carried_to([contact(2, 1, 0.7, along=along)], skin(0.7)) == is_carried


def test_other_faces_or_another_number_of_contacts_carry_nothing() -> None:
    pressed = PressedContacts((contact(2, 1, 0),), skin(0.0))
    other = TriangleMesh(skin(0.7).vertices, np.array([[0, 1, 3], [1, 2, 3]], np.int32))
    assert not pressed.carried_to([contact(2, 1, 0.7)], other)
    assert not pressed.carried_to([], skin(0.7))

"""Contacts beside the rim of a gel have a warning about their force, others have none."""

import pytest

from optisense.geometry import Contact, Sphere
from optisense.mechanics import rims_in_words
from optisense.optics._ray_model import RayModel
from optisense.sensors import load

BALL = Sphere(1.5)


@pytest.mark.parametrize(
    ("name", "near", "far", "word"),
    [
        ("digit", (9.0, 0.0), (6.0, 0.0), "not reliable"),
        ("digit", (9.4, 0.0), (0.0, 10.0), "not reliable"),  # on the edge of the rim
        ("gelsight-mini-ideal", (0.0, 9.8), (0.0, 9.0), "too small"),
    ],
)
def test_contacts_near_a_rim_are_warned_of(name, near, far, word):
    design = load(name)
    assert word in rims_in_words(design)
    model = RayModel(design)
    pressed = model.pressed([Contact(BALL, at=near, depth=0.3)])
    assert word in pressed.in_numbers()[0]["warning"]
    beside = model.pressed([Contact(BALL, at=far, depth=0.3)])
    assert beside.warnings == []
    assert "warning" not in beside.in_numbers()[0]


def test_a_dome_has_no_steep_rim():
    model = RayModel(load("gelsight360"))
    assert model.pressed([Contact(BALL, at=(9.0, 0.0), depth=0.3)]).warnings == []


def test_contacts_beside_a_side_that_leans_under_the_skin_are_warned_of():
    model = RayModel(load("gelsight-svelte"))
    contacts = [Contact(BALL, at=(u, 0.0), depth=0.3) for u in (34.0, 30.0)]
    near, far = (model.pressed([contact]).warnings for contact in contacts)
    assert "leans under the skin" in near[0]
    assert far == []

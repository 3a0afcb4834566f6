"""Iterations that do not converge are errors that give the residual."""

import re

import numpy as np
import pytest
from gels import gel_of, pad

from optisense.errors import ContactError
from optisense.geometry import Contact, Sphere
from optisense.mechanics import Elasticity
from optisense.mechanics import _dragged_skin as dragged_skin
from optisense.mechanics import _normal_contact as normal_contact
from optisense.mechanics import _pressed_skin as pressed_skin
from optisense.mechanics import _tangential_contact as tangential_contact
from optisense.mechanics._displacement_field import grid_response

PAD = pad(25.25, 20.75, 4.25)
MIDDLE, CORNER = (0.0, 0.0), (11.0, 8.5)
BESIDE_SIDES = {"at": (9.0, 7.0), "shift": (0.5, 0.5)}


def press(at=MIDDLE, neighbour=None, **motion):
    places = [at] if neighbour is None else [at, neighbour]
    return gel_of(*PAD).pressed(
        [Contact(Sphere(1.5), at=each, depth=0.8, **motion) for each in places]
    )


@pytest.mark.parametrize(
    ("module", "name", "most", "contact", "message"),
    [
        (normal_contact, "MAX_ITERATIONS", 3, {}, r"not found in 3 iterations; (\S+) mm of gap"),
        (tangential_contact, "MAX_ITERATIONS", 3, {"shift": (0.1, 0.0)}, r"change was (\S+) %"),
        (pressed_skin, "MAX_TURNS", 1, {"at": CORNER}, r"moved the skin by (\S+) mm"),
        (dragged_skin, "MAX_TURNS", 3, BESIDE_SIDES, r"shear .* moved the skin by (\S+) mm"),
        (pressed_skin, "MAX_SWEEPS", 2, {"neighbour": (2.8, 0.0)}, r"moved the skin by (\S+) mm"),
    ],
)
def test_what_does_not_settle_is_told_with_its_residual(
    monkeypatch, module, name, most, contact, message
):
    monkeypatch.setattr(module, name, most)
    monkeypatch.setattr(pressed_skin, "UNSETTLED", pressed_skin.SETTLED)
    with pytest.raises(ContactError, match=message) as told:
        press(**contact)
    assert float(re.search(message, str(told.value))[1]) > 0.0
    monkeypatch.undo()
    assert np.isfinite(press(**contact).contacts[0].force)


@pytest.mark.parametrize("size", [0.0, 100.0])
def test_a_pressure_is_found_from_a_start_that_is_nothing_or_far_too_large(size):
    found = press().contacts[0]
    spot, elasticity = found.place, Elasticity(0.435, 0.49)
    response = grid_response(spot.overlap.shape, spot.pitch, spot.thickness, elasticity)
    start = size * np.ones_like(found.pressure)
    again = normal_contact.solve_normal_contact(response, spot.overlap, start)
    assert again == pytest.approx(found.pressure, abs=1e-3 * found.pressure.max())

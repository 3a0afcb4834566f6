"""Dragged and turned contacts against closed forms."""

import math

import numpy as np
import pytest
from gels import gel_of, pad

from optisense.errors import ContactError
from optisense.geometry import Contact, MeshIndenter, Sphere, TriangleMesh
from optisense.geometry.contact_text import parse_contact
from optisense.mechanics import Elasticity
from optisense.mechanics._convolution import GridResponse
from optisense.mechanics._normal_contact import solve_normal_contact
from optisense.mechanics._tangential_contact import Drag, solve_shear

GEL = Elasticity(0.4, 0.45)


def pressed(friction=0.5, **motion):
    return pressed_in([Contact(Sphere(3.0), at=(0.0, 0.0), depth=0.6, **motion)], friction)


def pressed_in(contacts, friction=0.5):
    gel = gel_of(*pad(50.0, 50.0, 4.0), elasticity=Elasticity(0.4, 0.49, friction))
    return gel.pressed(contacts)


@pytest.fixture(scope="module")
def hertz():
    """A ball on a gel that is far thicker than the contact wide."""
    radius, depth, count, width = 2.0, 0.05, 96, 0.9
    pitch = width / count
    x = (np.arange(count) - (count - 1) / 2) * pitch
    response = GridResponse((count, count), pitch, 400.0, GEL)
    pressure = solve_normal_contact(response, depth - (x[:, None] ** 2 + x**2) / (2 * radius))
    return response, pressure, x, pitch, math.sqrt(radius * depth)


@pytest.mark.parametrize("share", [0.2, 0.6, 0.9])
def test_a_dragged_ball_slips_in_a_ring_as_mindlin_has_it(hertz, share):
    response, pressure, x, pitch, a = hertz
    friction, force = 0.4, pressure.sum() * pitch**2
    most = 3 * friction * force * (2 - GEL.poisson_ratio) / (16 * a * GEL.shear_modulus)
    wanted = Drag(np.array([share * most, 0.0]), 0.0).displacement(x, x)
    shear = solve_shear(response, pressure, friction, wanted)
    total = shear[0].sum() * pitch**2 / (friction * force)
    assert total == pytest.approx(1 - (1 - share) ** 1.5, rel=0.015)
    sticking = (np.hypot(*shear) < 0.999 * friction * pressure).sum() * pitch**2
    stuck_radius = a * math.sqrt(1 - share)
    assert math.sqrt(sticking / math.pi) == pytest.approx(stuck_radius, rel=0.03)


def test_a_ball_that_is_dragged_far_slips_everywhere(hertz):
    response, pressure, x, _, _ = hertz
    shear = solve_shear(response, pressure, 0.3, Drag(np.array([0.0, 5.0]), 0.0).displacement(x, x))
    assert shear[1] == pytest.approx(0.3 * pressure, abs=1e-6)
    assert shear[0] == pytest.approx(0.0, abs=1e-3 * pressure.max())


def test_a_turned_ball_takes_the_torque_of_reissner_and_sagoci(hertz):
    response, pressure, x, pitch, a = hertz
    angle = 1e-3
    shear = solve_shear(response, pressure, 100.0, Drag(np.zeros(2), angle).displacement(x, x))
    torque = (x * shear[1] - x[:, None] * shear[0]).sum() * pitch**2
    assert torque == pytest.approx(16 / 3 * GEL.shear_modulus * a**3 * angle, rel=0.03)


@pytest.mark.parametrize("twist", [180.0, 360.0])
def test_a_ball_that_is_turned_far_slips_everywhere(twist):
    contact = pressed(twist=twist).contacts[0]
    distance = np.hypot(contact.place.x, contact.place.y[:, None])
    slipping = 0.5 * (contact.pressure * distance).sum() * contact.place.pitch**2
    assert contact.torque == pytest.approx(slipping, rel=1e-3)


def test_the_skin_under_a_dragged_ball_goes_along_and_less_beside_it():
    dragged, resting = pressed(friction=2.0, shift=(0.1, 0.0)), pressed()
    points = np.array([[0.0, 0.0, -0.6], [2.5, 0.0, 0.0], [6.0, 0.0, 0.0]])
    inward = np.tile([0.0, 0.0, -1.0], (3, 1))
    moved = [each.maps(points, inward).displacement for each in (dragged, resting)]
    along = (moved[0] - moved[1])[:, 0]
    assert along[0] == pytest.approx(0.1, rel=0.02)
    assert 0.1 > along[1] > along[2] > 0.0
    assert moved[0][:, 2] == pytest.approx(moved[1][:, 2], abs=1e-9)
    assert dragged.contacts[0].shear_force[0] > 0.05
    assert dragged.contacts[0].force == resting.contacts[0].force


def test_two_balls_that_are_dragged_together_are_dragged_as_one_body():
    drag = {"depth": 0.5, "shift": (0.05, 0.0)}
    sides = -1.6, 1.6
    pair = pressed_in([Contact(Sphere(1.5), at=(x, 0.0), **drag) for x in sides])
    ball = Sphere(1.5).mesh(1.5, 1e-3)
    body = TriangleMesh.joined([ball.with_vertices(ball.vertices + (x, 0, 0)) for x in sides])
    (whole,) = pressed_in([Contact(MeshIndenter(body), at=(0.0, 0.0), **drag)]).contacts
    along = sum(contact.shear_force[0] for contact in pair.contacts)
    assert along == pytest.approx(whole.shear_force[0], rel=0.02)  # each alone: 16 % more
    # The skin under each ball moves with it, whatever the other one does.
    points = np.array([[x, 0.0, -0.5] for x in sides])
    inward = np.tile([0.0, 0.0, -1.0], (2, 1))
    at_rest = pressed_in([Contact(Sphere(1.5), at=(x, 0.0), depth=0.5) for x in sides])
    moved = pair.maps(points, inward).displacement - at_rest.maps(points, inward).displacement
    assert moved[:, 0] == pytest.approx(0.05, abs=1e-3)


def test_friction_bounds_the_force_and_none_gives_none():
    slipping = pressed(friction=0.5, shift=(0.0, 3.0)).contacts[0]
    assert slipping.shear_force[1] == pytest.approx(0.5 * slipping.force, rel=1e-3)
    smooth = pressed(friction=0.0, shift=(0.0, 3.0), twist=20.0).contacts[0]
    assert not smooth.shear.any()
    numbers = pressed(twist=10.0).in_numbers()[0]
    assert numbers["torque_nmm"] > 0.0
    assert numbers["shear_force_n"] == pytest.approx(0.0, abs=1e-3)
    assert "torque_nmm" not in pressed().in_numbers()[0]


def test_motions_are_written_after_the_contact():
    contact = parse_contact("sphere:1.5@0,0:0.8;shift=0.2,-0.1;twist=5")
    assert (contact.shift, contact.twist, contact.depth) == ((0.2, -0.1), 5.0, 0.8)
    with pytest.raises(ContactError, match="'slide=2' is no motion"):
        parse_contact("sphere:1.5@0,0:0.8;slide=2")
    with pytest.raises(ContactError, match="shift needs 2 numbers"):
        parse_contact("sphere:1.5@0,0:0.8;shift=2")
    with pytest.raises(ContactError, match="twist"):
        Contact(Sphere(1.0), twist=math.nan)

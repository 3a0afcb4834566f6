"""Solved contacts against closed forms and another program."""

import math

import numpy as np
import pytest
from ContactMechanics import PeriodicFFTElasticHalfSpace
from ContactMechanics.Systems import NonSmoothContactSystem
from hertz import plane_strain_modulus
from SurfaceTopography import Topography

from optisense.errors import ContactError
from optisense.mechanics import Elasticity, youngs_modulus_of_shore_a
from optisense.mechanics._convolution import GridResponse
from optisense.mechanics._normal_contact import contact_area, solve_normal_contact


def pressed(shape, width, count, thickness, gel):
    """A contact of an indenter of height ``shape(r^2)`` over its lowest point, less its depth."""
    pitch = width / count
    x = (np.arange(count) - (count - 1) / 2) * pitch
    response = GridResponse((count, count), pitch, thickness, gel)
    pressure = solve_normal_contact(response, -shape(x[:, None] ** 2 + x**2))
    force = pressure.sum() * pitch**2
    area = contact_area(pressure, pitch)
    return pressure, force, math.sqrt(area / math.pi), response


def ball(radius, depth):
    return lambda r2: (
        np.where(r2 < radius**2, radius - np.sqrt(np.maximum(radius**2 - r2, 0)), radius) - depth
    )


def paraboloid(radius, depth):
    return lambda r2: r2 / (2 * radius) - depth


def test_a_thick_gel_takes_the_force_and_radius_of_hertz():
    gel, radius, depth = Elasticity(0.4, 0.47), 2.0, 0.05
    _, force, contact_radius, _ = pressed(paraboloid(radius, depth), 0.9, 120, 400.0, gel)
    assert force == pytest.approx(
        4 / 3 * plane_strain_modulus(gel) * radius**0.5 * depth**1.5, rel=0.01
    )
    assert contact_radius == pytest.approx(math.sqrt(radius * depth), rel=2e-3)


def test_a_thin_compressible_gel_yields_as_a_bed_of_springs():
    gel, radius, depth, thickness = Elasticity(1.0, 0.25), 60.0, 0.003, 0.03
    _, force, contact_radius, _ = pressed(paraboloid(radius, depth), 1.4, 200, thickness, gel)
    oedometric = gel.youngs_modulus * 0.75 / (1.25 * 0.5)
    assert force == pytest.approx(oedometric / thickness * math.pi * radius * depth**2, rel=0.03)
    assert contact_radius == pytest.approx(math.sqrt(2 * radius * depth), rel=0.02)


@pytest.mark.parametrize(
    ("thickness", "poisson_ratio", "radius", "depth", "box", "points"),
    [
        (4.25, 0.49, 1.5, 0.8, 40.0, 500),
        (1.0, 0.49, 1.5, 0.8, 12.0, 300),
        (2.0, 0.3, 3.0, 0.3, 16.0, 300),
    ],
)
def test_contactmechanics_finds_the_same_force_and_radius(
    thickness, poisson_ratio, radius, depth, box, points
):
    pitch = box / points
    layer = PeriodicFFTElasticHalfSpace(
        (points, points), 1.0, (box, box), thickness=thickness, poisson=poisson_ratio
    )
    x = (np.arange(points) - points // 2) * pitch
    skin_to_ball = ball(radius, depth)(x[:, None] ** 2 + x**2)
    theirs = NonSmoothContactSystem(layer, Topography(-skin_to_ball, (box, box)))
    assert theirs.minimize_proxy(offset=0.0, pentol=1e-6).success
    count = 2 * math.ceil(1.05 * math.sqrt(2 * radius * depth - depth**2) / pitch) + 1
    _, force, found, _ = pressed(
        ball(radius, depth), pitch * count, count, thickness, Elasticity(1.0, poisson_ratio)
    )
    assert force == pytest.approx(layer.force.sum(), rel=1e-3)
    # The area is read from either pressure in the same way, more finely than the grid's squares.
    area = contact_area(layer.force / pitch**2, pitch)
    assert found == pytest.approx(math.sqrt(area / math.pi), rel=1e-3)


def test_no_point_is_pulled_and_none_is_entered():
    pressure, _, _, response = pressed(ball(1.5, 0.6), 3.0, 90, 3.0, Elasticity(0.4, 0.48))
    assert pressure.min() == 0.0
    x = (np.arange(90) - 44.5) * 3.0 / 90
    gap = response.normal(pressure) + ball(1.5, 0.6)(x[:, None] ** 2 + x**2)
    assert gap.min() > -2e-4 * 0.6
    assert np.abs(gap[pressure > 0]).max() < 2e-4 * 0.6


def test_an_incompressible_gel_keeps_its_volume():
    lost = {}
    for nu in (0.3, 0.4999):
        gel, count, pitch = Elasticity(0.4, nu), 400, 0.1
        response = GridResponse((count, count), pitch, 2.0, gel)
        pressure = np.zeros((count, count))
        pressure[190:210, 190:210] = 0.1
        moved = response.normal(pressure)
        lost[nu] = moved.sum() / moved[moved > 0].sum()
    assert lost[0.4999] == pytest.approx(0.0, abs=0.01)
    assert lost[0.3] > 0.5


def test_displacements_of_loads_add_up():
    response = GridResponse((60, 50), 0.1, 2.0, Elasticity(0.4, 0.45))
    rng = np.random.default_rng(0)
    one, other = rng.random((2, 60, 50))
    shear = rng.random((2, 60, 50))
    both = response.tangential(shear, one + other)
    alone = response.tangential(0 * shear, one) + response.tangential(shear, other)
    assert both == pytest.approx(alone, abs=1e-9)
    assert response.normal(one + other) == pytest.approx(
        response.normal(one) + response.normal(other), abs=1e-9
    )


def test_loads_do_the_same_work_on_each_others_displacements():
    # Betti's reciprocal theorem
    response = GridResponse((40, 48), 0.1, 1.5, Elasticity(0.4, 0.4))
    rng = np.random.default_rng(1)
    p1, p2 = rng.random((2, 40, 48))
    t1, t2 = rng.standard_normal((2, 2, 40, 48))
    for move, one, other in ((response.normal, p1, p2), (response.tangential, t1, t2)):
        assert (move(one) * other).sum() == pytest.approx((move(other) * one).sum(), rel=1e-9)


def test_shore_hardness_gives_youngs_modulus():
    # A shore A hardness of 10 is 0.41 MPa by Gent's formula, and the Mini's gel is near that.
    assert youngs_modulus_of_shore_a(10.0) == pytest.approx(0.41, abs=0.01)
    with pytest.raises(ContactError, match="Shore A hardness of 100 is outside the scale"):
        youngs_modulus_of_shore_a(100.0)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ((0.0, 0.49), "Young's modulus"),
        ((float("nan"), 0.49), "Young's modulus"),
        ((0.4, 0.5), "Poisson ratio"),
        ((0.4, 0.49, -1.0), "friction"),
    ],
)
def test_impossible_elastic_constants_are_refused(values, message):
    with pytest.raises(ContactError, match=message):
        Elasticity(*values)

"""Gels that are no flat layers: finite elements against closed forms and each other."""

import math

import numpy as np
import pytest
from gels import gel_of
from gels import pad as layer
from hertz import plane_strain_modulus
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import spsolve

from optisense.geometry import Contact, Plane, Sphere
from optisense.mechanics import Elasticity
from optisense.mechanics import _gel_patches as gel_patches
from optisense.mechanics import _point_load as point_load
from optisense.mechanics._gel_columns import gel_columns
from optisense.mechanics._gel_elements import CORNERS, stiffnesses
from optisense.mechanics._gel_patch import GelPatch
from optisense.optics._ray_model import RayModel
from optisense.sensors import load
from optisense.sensors._shapes import revolve

GEL = Elasticity(1.0, 0.49)


def dome(radius, thickness, opening=1.2, rings=24, segments=48):
    """A gel on a ball, its pole at the origin."""
    angle = np.linspace(opening, 0.0, rings)
    outer = np.column_stack([radius * np.sin(angle), radius * np.cos(angle) - radius])
    inner = outer * [1, 1] - thickness * np.column_stack([np.sin(angle), np.cos(angle)])
    outer[-1, 0] = inner[-1, 0] = 0.0
    skin = revolve(outer, segments)
    if skin.face_normals[:, 2].mean() > 0.0:
        skin = skin.flipped()
    body = revolve(np.concatenate([inner[::-1], outer]), segments)
    assert body.is_closed
    return skin, body


def pressed(skin, body, radius=1.5, depth=0.8, at=(0.0, 0.0), **motion):
    contact = Contact(Sphere(radius), at=at, depth=depth, **motion)
    return gel_of(skin, body, elasticity=GEL).pressed([contact]).contacts[0]


def patch_at(skin, body, thickness, loaded=(2.0, 2.0), nu=0.49):
    spot = pressed(skin, body, depth=0.3).place
    assert spot.thickness == pytest.approx(thickness, rel=0.05)
    columns = gel_columns(spot, loaded, skin, [body])
    return GelPatch(columns, loaded, spot.thickness, nu)


def unit_forces(patch, offsets):
    """The corrections (rows, columns) of a unit force at some columns from the middle."""
    middle = np.array(patch.shape) // 2
    found = []
    for offset in offsets:
        force = np.zeros(patch.shape)
        force[tuple(middle + offset)] = 1.0
        found.append(patch.correction(force))
    return middle, found


@pytest.mark.parametrize("nu", [0.3, 0.49])
def test_a_point_load_is_carried_by_every_plane_below_it(nu):
    x = np.linspace(-60.0, 60.0, 1201)
    grid = np.stack([*np.meshgrid(x, x), np.full((1201, 1201), 1.5)], axis=2)
    down = np.array([0.0, 0.0, 1.0])
    total = point_load.tractions(grid, np.broadcast_to(down, grid.shape), nu)
    total = total.sum(axis=(0, 1)) * 0.1**2
    assert total == pytest.approx([0.0, 0.0, -1.0], abs=2e-3)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_derivatives_of_a_point_load_are_its_differences(axis):
    points = np.random.default_rng(0).uniform(0.1, 1.0, (20, 3))
    steps = 1e-5 * np.eye(3)
    differences = np.stack(
        [
            point_load.displacements(points + step, 0.45, axis)
            - point_load.displacements(points - step, 0.45, axis)
            for step in steps
        ],
        axis=-1,
    )
    found = point_load.gradients(points, 0.45, axis)
    assert found == pytest.approx(differences / 2e-5, abs=1e-6)
    strains = found + np.swapaxes(found, -1, -2)
    share = 2.0 * 0.45 / (1.0 - 2.0 * 0.45)
    stress = strains + share * np.trace(found, axis1=1, axis2=2)[:, None, None] * np.eye(3)
    normals = np.random.default_rng(1).uniform(-1.0, 1.0, (20, 3))
    push = point_load.tractions(points, normals, 0.45, axis)
    assert push == pytest.approx(np.einsum("nij,nj->ni", stress, normals), abs=1e-9)
    places, down = np.array([[0.3, -0.2, 0.0], [2.0, 1.0, 0.0]]), [[0.0, 0.0, 1.0]] * 2
    surface = point_load.tractions(places, np.array(down), 0.45, axis)
    assert surface == pytest.approx(0.0, abs=1e-12)


def test_elements_resist_strains_and_nothing_else():
    rng = np.random.default_rng(1)
    corners = CORNERS[None] + rng.uniform(-0.2, 0.2, (1, 8, 3))
    matrix = stiffnesses(corners, 0.49)[0]
    assert matrix == pytest.approx(matrix.T, abs=1e-9)
    shift = np.tile([1.0, -2.0, 0.5], 8)
    turn = np.cross([0.3, -0.1, 0.2], corners[0]).ravel()
    assert matrix @ shift == pytest.approx(0.0, abs=1e-9)
    assert matrix @ turn == pytest.approx(0.0, abs=1e-9)
    assert (np.linalg.eigvalsh(matrix) > -1e-9).sum() == 24
    # A uniform stretch stores the energy of the bulk modulus: 9 K / 2 for each mm^3.
    cube = CORNERS[None] / 2.0
    stretch = cube[0].ravel()
    bulk = 2.0 * 1.49 / (3.0 * 0.02)
    assert stretch @ stiffnesses(cube, 0.49)[0] @ stretch == pytest.approx(9.0 * bulk)


@pytest.mark.parametrize("nu", [0.3, 0.49])
def test_elements_find_what_a_flat_layer_adds_to_a_half_space(nu):
    patch = patch_at(*layer(60.0, 60.0, 4.25), 4.25, nu=nu)
    middle, (found,) = unit_forces(patch, [(0, 0)])
    # By the closed solution the layer yields 0.033 to 0.036 mm less under the load.
    assert np.abs(found[tuple(middle)]) < 0.02 * 0.033
    assert np.abs(found).max() < 0.02 * 0.033


@pytest.mark.parametrize(("thickness", "depth"), [(4.25, 0.8), (1.5, 0.5)])
def test_a_flat_gel_is_the_same_by_both_solvers(monkeypatch, thickness, depth):
    body = layer(50.0, 50.0, thickness)
    flat = pressed(*body, depth=depth)
    monkeypatch.setattr(gel_patches, "FLAT", -1.0)
    elements = pressed(*body, depth=depth)
    assert elements.force == pytest.approx(flat.force, rel=0.01)
    assert elements.area == pytest.approx(flat.area, rel=0.01)
    assert elements.force != flat.force


def test_a_flat_gel_is_dragged_and_turned_alike_by_both_solvers(monkeypatch):
    body, motion = layer(50.0, 50.0, 4.25), {"shift": (0.05, 0.1), "twist": 3.0}
    flat = pressed(*body, **motion)
    monkeypatch.setattr(gel_patches, "FLAT", -1.0)
    elements = pressed(*body, **motion)
    assert elements.shear_force == pytest.approx(flat.shear_force, rel=0.005, abs=1e-3)
    assert elements.torque == pytest.approx(flat.torque, rel=0.005)
    x, y = np.array([0.0, 2.5, 3.0]), np.array([0.0, 0.5, -2.0])
    moved = flat.field.tangential(x, y)
    assert moved[:, 0] == pytest.approx(motion["shift"], rel=0.01)
    assert elements.field.tangential(x, y) == pytest.approx(moved, abs=0.002)
    assert elements.torque != flat.torque


@pytest.mark.parametrize("shape", ["dome", "side"])
def test_a_gel_that_is_curved_or_ends_resists_a_drag_less(monkeypatch, shape):
    body = dome(14.0, 3.0) if shape == "dome" else layer(25.25, 20.75, 4.25)
    at = (0.0, 0.0) if shape == "dome" else (10.5, 0.0)
    elements = pressed(*body, at=at, shift=(0.2, 0.0))
    for name, value in (("FLAT", math.inf), ("NEAR", -1.0), ("NEARER", -2.0)):
        monkeypatch.setattr(gel_patches, name, value)
    flat = pressed(*body, at=at, shift=(0.2, 0.0))
    # With columns less than half as far apart the dome takes 0.85 of the shear.
    low, high = (0.83, 0.87) if shape == "dome" else (0.7, 0.9)
    assert low < elements.shear_force[0] / flat.shear_force[0] < high


def test_free_sides_make_a_pad_softer(monkeypatch):
    monkeypatch.setattr(gel_patches, "FLAT", -1.0)
    wide = pressed(*layer(50.0, 50.0, 4.25)).force
    pad = layer(25.25, 20.75, 4.25)
    # A model of the pad in quadratic elements is 0.4 % softer in its middle than a wide layer.
    forces = [pressed(*pad, at=(x, 0.0)).force / wide for x in (0.0, 8.0, 10.0, 11.0)]
    assert forces[0] == pytest.approx(0.9965, abs=0.003)
    assert forces == sorted(forces, reverse=True)
    assert 0.75 < forces[-1] < 0.9


def test_mirrored_places_whose_columns_stand_on_the_sides_of_a_pad_take_equal_forces():
    # Half a thickness from both sides, so that a column of the grid stands on each of them.
    pad = layer(25.25, 20.75, 4.25)
    signs = [(1, 1), (1, -1), (-1, 1), (-1, -1)]
    forces = [pressed(*pad, at=(10.5 * a, 8.25 * b), depth=0.5).force for a, b in signs]
    inside = pressed(*pad, at=(10.499, 8.249), depth=0.5).force
    assert forces == pytest.approx([inside] * 4, rel=1e-3)


def test_forces_fall_evenly_towards_the_side_of_a_pad():
    pad = layer(25.25, 20.75, 4.25)
    forces = [pressed(*pad, at=(x, 0.3), depth=0.5).force for x in np.arange(11.1, 12.5, 0.18)]
    falls = -np.diff(forces) / forces[0]
    assert (falls > 0.0).all()
    assert falls.max() < 0.13


def test_forces_change_evenly_with_the_distance_from_a_side():
    # A border that is known to an eighth of a pitch makes steps of 2 % between equal forces.
    pad = layer(25.25, 20.75, 4.25)
    forces = [pressed(*pad, at=(x, 0.3), depth=0.5).force for x in np.arange(9.9, 10.51, 0.06)]
    falls = -np.diff(forces) / forces[0]
    assert falls.min() > 0.001
    assert falls.max() < 0.007


def test_forces_change_evenly_from_the_flat_layer_to_the_elements():
    pad = layer(25.25, 20.75, 4.25)
    forces = [pressed(*pad, at=(x, 0.3), depth=0.5).force for x in np.arange(7.1, 8.6, 0.15)]
    falls = -np.diff(forces) / forces[0]
    assert falls.min() >= -1e-4
    assert falls.max() < 0.004
    assert forces[0] == pytest.approx(pressed(*pad, depth=0.5).force, rel=1e-6)


def pad_under_a_plate(half, thickness, counts):
    """The force (N per MPa of shear modulus) that moves the whole top of a pad by 1 mm without
    friction, by elements of equal size in a quarter of the pad."""
    nodes = np.stack(
        np.meshgrid(
            *(
                np.linspace(0.0, size, n + 1)
                for size, n in zip((*half, thickness), counts, strict=True)
            ),
            indexing="ij",
        ),
        axis=3,
    )
    number = np.arange(nodes[..., 0].size).reshape(nodes.shape[:3])
    ends = [slice(None, -1), slice(1, None)]
    cells = np.stack([number[x, y, z].ravel() for z in ends for y in ends for x in ends], axis=1)
    points = nodes.reshape(-1, 3)
    freedom = (3 * cells[:, :, None] + np.arange(3)).reshape(-1, 24)
    rows, columns = np.repeat(freedom, 24, axis=1), np.tile(freedom, (1, 24))
    values = stiffnesses(points[cells], GEL.poisson_ratio)
    matrix = csc_matrix((values.ravel(), (rows.ravel(), columns.ravel())))
    base, top = points[:, 2] == 0.0, points[:, 2] == thickness
    fixed = (points == 0.0) | base[:, None]
    fixed[top, 2] = True
    moved = np.zeros_like(points)
    moved[top, 2] = 1.0
    moved, free = moved.ravel(), ~fixed.ravel()
    moved[free] = spsolve(matrix[free][:, free], -matrix[free] @ moved)
    return 4.0 * (matrix @ moved).reshape(-1, 3)[top, 2].sum()


def test_a_plate_over_the_whole_pad_takes_the_force_of_plain_elements():
    # Loads on the free sides themselves: half of each acts on what is beside the gel. It settles as
    # well as its pressure is solved, though it is much softer than a flat layer.
    half, thickness, depth = (25.25 / 2, 20.75 / 2), 4.25, 0.5
    gel = gel_of(*layer(2 * half[0], 2 * half[1], thickness), elasticity=GEL)
    force = gel.pressed([Contact(Plane(0.0, 0.0, 30.0), at=(0.0, 0.0), depth=depth)])
    plain = pad_under_a_plate(half, thickness, (12, 10, 4)) * GEL.shear_modulus * depth
    # With elements of half the size, the plain model is 1.4 % softer.
    assert force.contacts[0].force == pytest.approx(plain, rel=0.04)


def test_a_thick_dome_takes_the_force_and_radius_of_hertz():
    # Both radii count: 1 / R = 1 / 4 + 1 / 40. The gel is sixty times as thick as the contact wide.
    skin, body = dome(40.0, 25.0, opening=0.7, rings=80, segments=120)
    contact = pressed(skin, body, radius=4.0, depth=0.05)
    radius = 1.0 / (1.0 / 4.0 + 1.0 / 40.0)
    hertz = 4.0 / 3.0 * plane_strain_modulus(GEL) * math.sqrt(radius) * 0.05**1.5
    assert contact.force == pytest.approx(hertz, rel=0.01)
    assert math.sqrt(contact.area / math.pi) == pytest.approx(math.sqrt(radius * 0.05), rel=0.01)


def test_shear_on_a_dome_does_the_same_work_on_other_shear():
    patch = patch_at(*dome(14.0, 3.0), 3.0)
    middle = np.array(patch.shape) // 2
    spots = [(0, (0, 0)), (1, (0, 1)), (0, (2, -1)), (1, (-2, 0))]
    found = []
    for axis, offset in spots:
        force = np.zeros((3, *patch.shape))
        force[(axis, *(middle + offset))] = 1.0
        found.append(patch.tangential(force))
    matrix = np.array([[each[(a, *(middle + o))] for a, o in spots] for each in found])
    assert np.abs(matrix).max() > 2e-3
    assert matrix == pytest.approx(matrix.T, abs=0.05 * np.abs(matrix).max())


def test_columns_of_a_dome_yield_to_each_others_loads_alike():
    # Betti's theorem holds for the whole response, and for the flat layer's, so for the rest.
    patch = patch_at(*dome(14.0, 3.0), 3.0)
    offsets = [(0, 0), (2, 0), (1, -2), (-2, 2)]
    middle, found = unit_forces(patch, offsets)
    matrix = np.array([[each[tuple(middle + o)] for o in offsets] for each in found])
    assert np.abs(matrix).max() > 2e-3
    assert matrix == pytest.approx(matrix.T, abs=0.05 * np.abs(matrix).max())


@pytest.mark.parametrize("at", [(5.0, 0.1), (4.9, 3.8)])
def test_a_gel_that_ends_in_a_round_rim_is_pressed_beside_its_middle(at):
    # Where DIGIT's skin ends, columns along its normals cross; the cells between them are left out.
    meshes = load("digit").deformed_meshes()
    skin = meshes["skin"]
    top = skin.vertices[np.argmax(skin.vertices[:, 2])]
    gel = gel_of(skin, meshes["gel"], elasticity=GEL, origin=top)
    forces = [
        gel.pressed([Contact(Sphere(1.5), at=spot, depth=0.3)]).contacts[0].force
        for spot in ((0.0, 0.0), at)
    ]
    assert forces[1] == pytest.approx(forces[0], rel=0.1)


def test_forces_beside_the_steep_side_of_a_tray_are_even():
    # Slopes of the skin that reach over the edge of DIGIT's rim leave out elements there.
    model = RayModel(load("digit"))
    forces = [
        model.pressed([Contact(Sphere(1.5), at=(0.0, v), depth=0.5)]).contacts[0].force
        for v in np.arange(-9.0, -10.55, -0.15)
    ]
    assert np.abs(np.diff(forces) / forces[0]).max() < 0.03
    assert max(forces) < 1.05 * min(forces)


def test_a_dome_is_softer_than_a_flat_gel_of_its_thickness(monkeypatch):
    skin, body = dome(14.0, 3.0)
    elements = pressed(skin, body)
    monkeypatch.setattr(gel_patches, "FLAT", math.inf)
    flat = pressed(skin, body)
    assert 0.9 < elements.force / flat.force < 0.98


def test_patches_are_kept_for_other_depths_and_forgotten_at_last(monkeypatch):
    skin, body = layer(25.25, 20.75, 4.25)
    patches = gel_patches.GelPatches(skin, [body], 0.49)

    def around(at, depth):
        return patches.around(pressed(skin, body, depth=depth, at=at).place)

    assert around((0.0, 0.0), 0.5) is None
    side = around((10.0, 0.0), 0.5)
    assert side is not None
    assert around((10.0, 0.0), 0.4) is side
    monkeypatch.setattr(gel_patches, "MOST_KEPT", 1)
    around((-10.0, 0.0), 0.5)
    assert around((10.0, 0.0), 0.5) is not side


def test_skin_that_turns_away_at_once_is_pressed_as_a_flat_layer():
    # Beside the rim of DIGIT's skin no column has neighbours on both sides.
    meshes = load("digit").deformed_meshes()
    gel = gel_of(meshes["skin"], meshes["gel"], elasticity=GEL)
    contact = Contact(Sphere(0.5), point=(9.2, -5.79, -3.17), depth=0.3)
    assert gel.pressed([contact]).contacts[0].force > 0.0


def test_a_patch_without_loads_does_not_move():
    patch = patch_at(*dome(14.0, 3.0), 3.0)
    assert not patch.correction(np.zeros(patch.shape)).any()

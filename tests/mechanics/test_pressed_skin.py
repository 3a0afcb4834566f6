"""Contacts pressed into a flat gel: shape of the skin, forces, neighbours."""

import os

import numpy as np
import pytest
from gels import gel_of, pad
from hertz import plane_strain_modulus

from optisense import library
from optisense.errors import ContactError
from optisense.geometry import (
    Contact,
    Cylinder,
    MeshIndenter,
    Plane,
    SensingSurface,
    Sphere,
    TriangleMesh,
)
from optisense.geometry.contact import place
from optisense.mechanics import (
    Elasticity,
    SkinState,
    elasticity_in_words,
    elasticity_of,
    skin_mesh,
    youngs_modulus_of_shore_a,
)
from optisense.optics._ray_model import RayModel
from optisense.sensors import load

GEL = Elasticity(0.435, 0.49)
TOP, BLOCK = pad(20.0, 16.0, 4.25)
SURFACE = SensingSurface(TOP, (0, 0, 0), (1, 0, 0), (0, 1, 0))

TIP = MeshIndenter(
    TriangleMesh(
        np.array([(4, 4, 4), (-4, 4, 4), (-4, -4, 4), (4, -4, 4), (0, 0, 0)], dtype=float),
        np.array([(1, 0, 4), (2, 1, 4), (3, 2, 4), (0, 3, 4)]),
    )
)
"""A pyramid that stands on its tip."""


def gel():
    return gel_of(TOP, BLOCK)


def press(*contacts):
    return gel().pressed(contacts)


@pytest.fixture(scope="module")
def wide():
    """A gel that is wide enough for wide punches, and its skin."""
    top, body = pad(50.0, 50.0, 4.25)
    return top, gel_of(top, body)


@pytest.fixture(scope="module")
def ball():
    return press(Contact(Sphere(1.5), at=(0.0, 0.0), depth=0.8))


def along_x(skin, x):
    points = np.column_stack([x, np.zeros_like(x), np.zeros_like(x)])
    moved = skin.displaced(points, np.tile([0.0, 0.0, -1.0], (len(x), 1)))
    slope = np.degrees(np.arctan2(np.abs(moved.tilt[:, 0]), 1.0))
    return -moved.displacement[:, 2], slope, moved.touching


def test_a_ball_touches_less_than_it_overlaps_and_bends_the_skin_around(ball):
    radius = np.sqrt(ball.contacts[0].area / np.pi)
    assert radius == pytest.approx(1.0805, rel=0.002)
    assert ball.contacts[0].force == pytest.approx(1.4973 * plane_strain_modulus(GEL), rel=2e-3)
    # Slopes of the layer by a finite element model of the pad.
    _, slope, touching = along_x(ball, np.array([0.0, 1.2, 1.5, 2.0, 3.0]) * radius)
    assert slope[1:] == pytest.approx([21.5, 11.5, 5.0, 1.4], abs=1.5)
    assert touching.tolist() == [True, False, False, False, False]


def test_inside_the_contact_the_skin_has_the_shape_of_the_ball(ball):
    x = np.linspace(-0.9, 0.9, 31)
    depth, slope, _ = along_x(ball, x)
    assert depth == pytest.approx(0.8 - 1.5 + np.sqrt(1.5**2 - x**2), abs=2e-5)
    assert slope == pytest.approx(np.degrees(np.arcsin(np.abs(x) / 1.5)), abs=0.1)


def test_beyond_a_thickness_the_skin_bulges(ball):
    depth, _, _ = along_x(ball, np.array([5.0]))
    assert -0.02 < depth[0] < -0.005


def balls(half, depth):
    """Two balls on either side of the middle."""
    return press(*(Contact(Sphere(1.5), at=(x, 0.0), depth=depth) for x in (-half, half)))


def test_neighbours_lift_each_other():
    for half, least, most in ((2.5, 1.005, 1.1), (6.0, 0.995, 1.005)):
        alone = press(Contact(Sphere(1.5), at=(-half, 0.0), depth=0.5)).contacts[0].force
        left, right = (contact.force for contact in balls(half, 0.5).contacts)
        assert left == pytest.approx(right, rel=1e-3)
        assert least < left / alone < most


def test_the_skin_has_the_shape_of_a_ball_beside_another_too():
    pair = balls(2.0, 0.6)
    x = -2.0 + np.linspace(-0.8, 0.8, 31)
    depth, _, touching = along_x(pair, x)
    assert touching.all()
    assert depth == pytest.approx(0.6 - 1.5 + np.sqrt(1.5**2 - (x + 2.0) ** 2), abs=3e-4)
    # No step at the rim: the skin goes on from the ball without a jump.
    x = np.linspace(-2.0, 0.0, 4001)
    depth, _, _ = along_x(pair, x)
    assert np.abs(np.diff(depth)).max() < 1e-3


def test_a_flat_punch_and_a_cylinder_and_a_tilted_plate():
    cylinder = press(Contact(Cylinder(2.0, 6.0), at=(0.0, 0.0), depth=0.4))
    rows, columns = (cylinder.contacts[0].pressure > 0).nonzero()
    place_of = cylinder.contacts[0].place
    assert np.ptp(place_of.x[columns]) == pytest.approx(6.0, abs=0.1)
    assert np.ptp(place_of.y[rows]) < 2 * np.sqrt(2 * 2.0 * 0.4)
    tilted = press(Contact(Plane(0.0, 5.0, 6.0), at=(0.0, 0.0), depth=0.3))
    assert tilted.contacts[0].force > 0.1


def test_the_rim_of_a_flat_punch_is_flat():
    punch = press(Contact(Plane(0.0, 0.0, 6.0), at=(0.0, 0.0), depth=0.3))
    place_of, field = punch.contacts[0].place, punch.contacts[0].field
    rows, columns = (punch.contacts[0].pressure > 0).nonzero()
    depth, slope_x, slope_y = field.at(place_of.x[columns], place_of.y[rows])
    assert depth == pytest.approx(0.3, abs=1e-3)
    assert np.abs([slope_x, slope_y]).max() < 1e-3


def test_the_skin_follows_sharp_edges_without_going_deeper():
    rod = Cylinder(1.5, 5.0).tilted(-1.1, 1.4)
    edges = skin_mesh(TOP, press(Contact(rod, at=(0.0, 0.0), depth=0.7, rotation=188.0)))
    assert edges.vertices[:, 2].min() == pytest.approx(-0.7, abs=1e-3)
    steep = TriangleMesh(edges.vertices, edges.faces).face_normals
    assert (np.einsum("fck,fk->fc", edges.corner_normals, steep) > 0.0).all()


def test_the_rim_of_a_wide_punch_is_as_straight_as_that_of_a_small_one(wide):
    top, pad_of = wide
    mesh = skin_mesh(top, pad_of.pressed([Contact(Plane(0.0, 0.0, 14.0), at=(0, 0), depth=0.3)]))
    touching = mesh.part(SkinState.TOUCHING)
    x, y, _ = touching.vertices.T
    right = (np.abs(y) < 6.0) & (x > 6.5)
    # The rim lies between grid points, which are 0.1 mm apart at most.
    assert x[right].max() == pytest.approx(7.0, abs=0.1)
    last = [x[right & (np.abs(y - at) < 0.15)].max() for at in np.linspace(-5.5, 5.5, 45)]
    assert np.ptp(last) < 0.1


def test_skin_that_bulges_outward_is_not_bent(wide):
    top, pad_of = wide
    mesh = skin_mesh(top, pad_of.pressed([Contact(Plane(0.0, 0.0, 12.0), at=(0, 0), depth=0.3)]))
    lowest = mesh.vertices[:, 2][mesh.faces].min(axis=1)
    assert lowest.max() > 0.1 * 0.3
    assert (mesh.state[lowest > 0.0] == SkinState.RESTING).all()
    assert (mesh.state == SkinState.BENT).any()


def test_the_mesh_is_fine_in_contacts_and_joins_the_rest(ball):
    mesh = skin_mesh(TOP, ball)
    assert set(np.unique(mesh.state)) == {0, 1, 2}
    touching = mesh.part(SkinState.TOUCHING)
    assert touching.area == pytest.approx(np.pi * 1.084**2 * 1.17, rel=0.03)  # it is a bowl
    whole = TriangleMesh(mesh.vertices, mesh.faces)
    rim = (np.abs(mesh.vertices[:, 0]) == 10.0) | (np.abs(mesh.vertices[:, 1]) == 8.0)
    assert np.all(mesh.vertices[rim, 2] == 0.0)
    assert mesh.vertices[:, 2].min() == pytest.approx(-0.8, abs=2e-3)
    # Normals agree with the facets but at the rim of the contact, where the slope jumps.
    angle = np.einsum("fi,fci->fc", whole.face_normals, mesh.corner_normals).min(axis=1)
    assert np.quantile(np.degrees(np.arccos(np.clip(angle, -1, 1))), 0.9) < 6.0
    assert np.linalg.norm(mesh.corner_normals, axis=2) == pytest.approx(1.0)


def test_a_contact_that_hangs_over_the_border_presses_on_what_is_there():
    over = press(Contact(Sphere(1.5), at=(9.8, 0.0), depth=0.5))
    inside = press(Contact(Sphere(1.5), at=(0.0, 0.0), depth=0.5))
    # With columns less than half as far apart the ball takes 0.44 of the force.
    assert 0.3 < over.contacts[0].force / inside.contacts[0].force < 0.5
    x, _ = np.meshgrid(over.contacts[0].place.x, over.contacts[0].place.y)
    touching = over.contacts[0].pressure > 0
    points = over.contacts[0].place.origin[0] + x * over.contacts[0].place.axes[0, 0]
    assert points[touching].max() <= 10.0 + 1e-9


def test_an_indenter_that_does_not_reach_the_skin_is_told():
    contact = Contact(Sphere(1.5), at=(0.0, 0.0), depth=0.8)
    lifted = place(contact, SURFACE, BLOCK)
    lifted = lifted.with_vertices(lifted.vertices + [0.0, 0.0, 2.0])
    with pytest.raises(ContactError, match="does not reach the sensing surface"):
        gel_of(TOP, BLOCK, placed=lambda _: lifted).pressed([contact])


def test_small_features_of_a_large_mesh_are_pressed_too():
    plate = [TriangleMesh.box((-30.0, -30.0, 1.5), (30.0, 30.0, 3.0))]
    pins = [
        TriangleMesh.box((x - half, y - half, 0.0), (x + half, y + half, 2.0))
        for x, y, half in ((0.0, 0.0, 0.8), (4.0, 0.7, 0.2))
    ]
    alone, both = (
        press(Contact(MeshIndenter(TriangleMesh.joined(parts)), at=(0.0, 0.0), depth=0.3))
        for parts in (pins, plate + pins)
    )
    assert both.contacts[0].force == pytest.approx(alone.contacts[0].force, rel=0.01)
    # Only the tip of a pyramid, smaller than the first grid's distance of points, is in the gel.
    shallow, deep = (
        press(Contact(TIP, at=(0.1, 0.2), depth=depth)).contacts[0].force for depth in (0.04, 0.4)
    )
    assert deep == pytest.approx(100.0 * shallow, rel=0.1)  # forces under cones grow by depth^2


@pytest.mark.parametrize(
    ("indenter", "load", "size"),
    [
        (Sphere(0.0015), {"depth": 0.8}, r"0\.0029? x 0\.0029? mm"),
        (Sphere(0.003), {"force": 2.0}, r"0\.005\d x 0\.005\d mm"),
        (Cylinder(0.002), {"depth": 0.5}, r"21 x 0\.004 mm"),
    ],
)
def test_indenters_too_small_for_the_grid_are_told_with_their_size(indenter, load, size):
    contact = Contact(indenter, at=(0.0, 0.0), **load)
    with pytest.raises(ContactError, match=f"{size} only.*lengths of indenters .* are in mm"):
        pad = gel()
        pad.pressed([pad.at_depth(contact)])


def test_contacts_that_overlap_are_told_and_neighbours_are_not():
    near, far = (
        [Contact(Sphere(1.5), at=(u, 0.0), depth=0.5) for u in (-apart, apart)]
        for apart in (0.9, 1.2)
    )
    # 0.5 mm deep a ball of 1.5 mm cuts a circle of radius 1.12 mm out of the skin.
    with pytest.raises(ContactError, match="two contacts overlap"):
        press(*near)
    assert len(press(*far).contacts) == 2


def test_a_mesh_with_a_hole_where_it_touches_is_told():
    box = TriangleMesh.box((-1.0, -1.0, 0.0), (1.0, 1.0, 2.0))
    heights = box.triangles[:, :, 2]
    middle = heights.mean(axis=1)
    without_top = MeshIndenter(box.with_faces(box.faces[middle < 1.9]))
    one_below = np.flatnonzero(heights.max(axis=1) < 0.1)[0]
    torn = MeshIndenter(box.with_faces(np.delete(box.faces, one_below, axis=0)))
    assert press(Contact(without_top, at=(0.0, 0.0), depth=0.3)).contacts[0].force > 0.1
    with pytest.raises(ContactError, match="has a hole where it touches"):
        press(Contact(torn, at=(0.0, 0.0), depth=0.3))
    # The open edges of a large pyramid whose tip touches have their middles above the skin.
    corners = np.array([(-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1), (0, 0, 0)], dtype=float)
    pyramid = TriangleMesh(corners, np.array([(0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)]))
    whole, three_sides = MeshIndenter(pyramid), MeshIndenter(pyramid.with_faces(pyramid.faces[:3]))
    assert press(Contact(whole, at=(0.0, 0.0), depth=0.3)).contacts[0].force > 0.0
    with pytest.raises(ContactError, match="has a hole where it touches"):
        press(Contact(three_sides, at=(0.0, 0.0), depth=0.3))


def test_a_mesh_file_that_was_written_again_is_pressed_anew(tmp_path):
    file, pad = tmp_path / "stamp.obj", gel()
    forces = []
    for half in (1.0, 2.0):
        TriangleMesh.box((-half, -half, 0.0), (half, half, 2.0)).save_obj(file)
        os.utime(file, (half, half))  # clocks of some disks count in seconds
        indenter = MeshIndenter(str(file))
        assert indenter == MeshIndenter(str(file))
        forces.append(pad.pressed([Contact(indenter, at=(0, 0), depth=0.3)]).contacts[0].force)
    assert forces[1] > 2.0 * forces[0]


def test_a_force_finds_its_depth():
    pushed = Contact(Sphere(1.5), at=(0.0, 0.0), force=0.5)
    found = gel().at_depth(pushed)
    assert found.force is None
    numbers = press(found).in_numbers()[0]
    assert numbers["force_n"] == pytest.approx(0.5, rel=2e-3)
    assert numbers["depth_mm"] == pytest.approx(found.depth, abs=1e-6)


def test_thin_rods_touch_alike_in_each_direction():
    along, across = (
        press(Contact(Cylinder(0.1, 5.0), at=(0.0, 0.0), depth=0.02, rotation=angle)).contacts[0]
        for angle in (0.0, 40.0)
    )
    assert across.area == pytest.approx(along.area, rel=0.05)
    assert across.force == pytest.approx(along.force, rel=0.02)


def test_a_small_force_is_found_or_refused():
    pad = gel()
    found = pad.at_depth(Contact(TIP, at=(0.0, 0.0), force=3e-4))
    assert pad.pressed([found]).contacts[0].force == pytest.approx(3e-4, rel=5e-4)
    with pytest.raises(ContactError, match=r"less than .* at the least depth .*Give a force from"):
        pad.at_depth(Contact(Plane(0.0, 0.0, 6.0), at=(0.0, 0.0), force=1e-5))


def test_a_force_beyond_what_the_gel_takes_is_told():
    pushed = Contact(Sphere(1.5), at=(0.0, 0.0), force=500.0)
    with pytest.raises(
        ContactError,
        match=r"500 N would press an indenter deeper than 60 % of the gel, which is 2\.55 mm",
    ):
        gel().at_depth(pushed)


def test_the_status_of_each_elastic_constant_is_told():
    words = elasticity_in_words(load("gelsight-mini-ideal"))
    assert words == (
        "Young's modulus 0.435 MPa (sourced), Poisson ratio 0.49 (assumed), friction 1 (assumed)"
    )
    silent = load("gelsight-mini-ideal")
    silent.materials["silicone-xp565"].elasticity = None
    assert elasticity_of(silent).youngs_modulus == 0.435
    assert "MPa (assumed)" in elasticity_in_words(silent)


@pytest.mark.parametrize("lower_first", [False, True])
def test_touching_layers_are_one_gel(lower_first):
    whole = load("gelsight-mini-ideal").model_copy(deep=True)
    whole.cages.clear()
    low, high = whole.meshes["gel"].bounds
    whole.meshes["gel"] = TriangleMesh.box(low, high)
    middle = low[2] + 0.6 * (high[2] - low[2])
    layers = whole.model_copy(deep=True)
    layers.meshes["gel"] = TriangleMesh.box((*low[:2], middle), high, (2, 3, 1))
    layers.meshes["low"] = TriangleMesh.box(low, (*high[:2], middle), (5, 4, 1))
    layers.parts["low"] = layers.parts["gel"]
    if lower_first:
        layers.parts["gel"] = layers.parts.pop("gel")
    # The gel ends beside the second place, where its elements matter.
    for at in ((0.0, 0.0), (9.0, 0.0)):
        contact = Contact(Sphere(1.5), at=at, depth=0.8)
        one, several = (
            RayModel(design).pressed([contact]).contacts[0].force for design in (whole, layers)
        )
        assert several == pytest.approx(one, rel=1e-6)


def wavy(low, high, wave_at, steps):
    """A box (mm) with a number of steps along its sides, and waves of 0.5 mm in the face at a z."""
    box = TriangleMesh.box(low, high, (steps, steps, 1))
    places = box.vertices.copy()
    moved = np.isclose(places[:, 2], wave_at)
    x, y = places[moved, :2].T
    places[moved, 2] += 0.5 * np.sin(0.7 * x) * np.cos(0.5 * y)
    return TriangleMesh(places, box.faces)


def test_layers_whose_curved_faces_have_other_facets_are_one_gel():
    low, high = BLOCK.bounds
    upper = wavy((*low[:2], -2.0), high, -2.0, 40)
    lower = wavy(low, (*high[:2], -2.0), -2.0, 60)
    layers = gel_of(TOP, upper, lower)
    for x in (-4.0, 1.3, 9.0):  # the gel ends beside the last place
        contact = Contact(Sphere(1.5), at=(x, 0.3), depth=0.8)
        one, several = (each.pressed([contact]).contacts[0] for each in (gel(), layers))
        assert several.place.thickness == pytest.approx(one.place.thickness)
        assert several.force == pytest.approx(one.force, rel=1e-6)


def test_elastomers_of_other_stiffness_are_named():
    design = load("gelsight-mini-ideal").model_copy(deep=True)
    name = design.parts["gel"].material
    design.materials["soft"] = design.materials[name].model_copy(deep=True)
    design.materials["soft"].elasticity.youngs_modulus = 0.1
    design.parts["low"] = design.parts["gel"].model_copy(update={"material": "soft"})
    assert elasticity_of(design).youngs_modulus == 0.435
    assert "; those of 'gel' are used for low, too" in elasticity_in_words(design)


@pytest.mark.parametrize("name", ["silicone-xp565", "silicone-solaris", "pdms"])
def test_silicones_of_the_library_have_elastic_constants(name):
    entry = library.entry("material", name)
    assert 0.2 < entry.value.elasticity.youngs_modulus < 3.0
    assert entry.source("elasticity") is not None


def test_the_librarys_solaris_follows_from_its_hardness():
    modulus = library.material("silicone-solaris").elasticity.youngs_modulus
    assert modulus == pytest.approx(youngs_modulus_of_shore_a(15.0), rel=1e-3)


def test_a_pressed_skin_is_carried_along_with_the_skin():
    mesh = skin_mesh(TOP, press(Contact(Sphere(1.5), at=(0, 0), depth=0.3)))
    still = mesh.carried(TOP)
    np.testing.assert_allclose(still.vertices, mesh.vertices, atol=1e-12)
    np.testing.assert_allclose(still.corner_normals, mesh.corner_normals, atol=1e-12)
    step = np.array([0.3, -0.2, 0.1])
    aside = mesh.carried(TOP.with_vertices(TOP.vertices + step))
    np.testing.assert_allclose(aside.vertices, mesh.vertices + step, atol=1e-12)
    assert aside.faces is mesh.faces and aside.state is mesh.state

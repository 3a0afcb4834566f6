"""Contacts: their text, where they end up, and which are refused."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from optisense.errors import ContactError, MeshError, OwnCodeError
from optisense.geometry import (
    Contact,
    Cylinder,
    MeshIndenter,
    Plane,
    SensingSurface,
    Sphere,
    TriangleMesh,
    available_depth,
    parse_contact,
    place,
)
from optisense.geometry.contact import refuse_no_contacts
from optisense.geometry.contact_text import parse_place
from optisense.geometry.indenter_kinds import Tilted

GEL = TriangleMesh.box((-12, -10, -4.25), (12, 10, 0), (24, 20, 2))


def surface_of(gel: TriangleMesh) -> SensingSurface:
    top = (gel.face_normals[:, 2] > 0.3) & (gel.triangles[:, :, 2].max(axis=1) > -1)
    skin = TriangleMesh(gel.vertices, gel.faces[top]).flipped()
    return SensingSurface(skin, (0, 0, 0), (1, 0, 0), (0, 1, 0))


FLAT = surface_of(GEL)

TURN, _ = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))
TURN = TURN * np.sign(np.linalg.det(TURN))


def test_a_place_that_is_not_finite_is_refused() -> None:
    with pytest.raises(ContactError, match="finite"):
        parse_place("nan,0")


def test_a_complex_radius_is_refused() -> None:
    with pytest.raises(ContactError, match="radius"):
        Sphere(np.complex128(1.0))


def test_lists_and_arrays_of_numbers_are_kept_as_tuples() -> None:
    at = np.array([1.0, 0.0])
    made = Contact(Sphere(2), at=at, depth=np.float32(0.5), along=[1, 0, 0], shift=np.zeros(2))  # type: ignore[arg-type]
    same = Contact(Sphere(2), at=(1, 0), along=(1, 0, 0))
    at[0] = 5.0
    assert made == same and hash(made) == hash(same) and repr(made) == repr(same)
    place(made, FLAT, GEL)


@pytest.mark.parametrize(
    "given",
    [
        {"at": 1.0}, {"at": (0, 0, 0)}, {"at": "ab"}, {"at": np.zeros((2, 2))},
        {"at": (1, math.nan)}, {"point": (1, 2)}, {"along": (1, 0)}, {"along": (0, 0, 0)},
        {"along": "abc"},
        {"shift": (1, [2])}, {"depth": "1"}, {"depth": 0}, {"force": "1"}, {"force": 0},
        {"rotation": None}, {"twist": "1"}, {"indenter": "sphere"}, {"indenter": Sphere},
        {"indenter": GEL},
    ],
)  # fmt: skip
def test_a_contact_refuses_what_does_not_fit(given: dict[str, Any]) -> None:
    with pytest.raises(ContactError, match=f"{next(iter(given))}.* of a contact"):
        Contact(**{"indenter": Sphere(2), **given})


def test_an_indenter_checks_its_numbers_when_it_is_made() -> None:
    assert Sphere(np.float32(2)) == Sphere(np.int64(2)) == Sphere(2)
    for kind, given in ((Sphere, "3"), (Sphere, None), (Sphere, np.ones(2)), (MeshIndenter, 3)):
        with pytest.raises(ContactError, match="ndenter"):
            kind(given)  # type: ignore[arg-type]


UP = TriangleMesh.box((-1, -1, 0), (1, 1, 2))


@pytest.mark.parametrize(
    ("made", "words"),
    [
        (lambda reach, facet_error: None, "returned None"),
        (lambda reach, facet_error: (UP.vertices, UP.faces), "returned \\("),
        (lambda reach, facet_error: 1 / 0, "fails: ZeroDivisionError"),
        (lambda reach: UP, "fails: TypeError"),
        (lambda reach, facet_error: UP.with_faces(UP.faces[:0]), "no triangles"),
        (lambda reach, facet_error: UP.with_faces(UP.faces + 1), "does not exist"),
        (lambda reach, facet_error: TriangleMesh(UP.vertices * math.nan, UP.faces), "not finite"),
        (lambda reach, facet_error: TriangleMesh(UP.vertices + 0.3, UP.faces), "at z = 0.3"),
    ],
)
def test_what_a_class_of_the_user_makes_is_checked(made: Any, words: str) -> None:
    class Own:
        mesh = staticmethod(made)

    for indenter in (Own(), Tilted(Own(), 10, 0)):
        with pytest.raises(
            OwnCodeError, match=f"mesh\\(\\) of the indenter 'Own' .*{words}"
        ) as told:
            place(Contact(indenter, depth=0.3), FLAT, GEL)
        assert told.value.where is not None and told.value.where.startswith(__file__)


@pytest.mark.parametrize(
    ("text", "contact"),
    [
        ("sphere:1.5@0,0:0.8", Contact(Sphere(1.5), at=(0, 0), depth=0.8)),
        ("cylinder:2@1,-3:0.5:90", Contact(Cylinder(2), at=(1, -3), depth=0.5, rotation=90)),
        ("cylinder:2,8@1,-3:0.5", Contact(Cylinder(2, 8), at=(1, -3), depth=0.5)),
        ("plane@0,0:0.1", Contact(Plane(), at=(0, 0), depth=0.1)),
        ("plane:2,-3,6@0,0:.1", Contact(Plane(2, -3, 6), at=(0, 0), depth=0.1)),
        ("sphere:1@1,2,-0.1:0.3", Contact(Sphere(1), point=(1, 2, -0.1), depth=0.3)),
        ("mesh:a@b/c:d.stl@1,2:0.4", Contact(MeshIndenter("a@b/c:d.stl"), (1, 2), depth=0.4)),
        ("mesh:m.stl,1000@1,2:0.4", Contact(MeshIndenter("m.stl", 1000), (1, 2), depth=0.4)),
    ],
)
def test_contact_text(text: str, contact: Contact) -> None:
    assert parse_contact(text) == contact


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("spher:1.5@0,0:0.8", "Did you mean 'sphere'"),
        ("donut:1@0,0:0.8", "cylinder, mesh, object, plane, sphere"),
        ("sphere:1.5", "no '@'"),
        ("sphere:1.5@0,0", "no depth"),
        ("sphere@0,0:1", "sphere:RADIUS"),
        ("sphere:1.5@0:0.8", "the place needs 2 or 3 numbers"),
        ("sphere:1.5@0,0:deep", "the depth"),
        ("sphere:1.5@0,0:-1", "depth above 0"),
        ("sphere:nan@0,0:1", "radius"),
        ("sphere:1@nan,0:1", "finite"),
        ("mesh:@0,0:1", "no mesh file"),
        ("", "no '@'"),
    ],
)
def test_bad_contact_text_says_what_is_wrong(text: str, expected: str) -> None:
    with pytest.raises(ContactError) as caught:
        parse_contact(text)
    assert expected in str(caught.value)
    assert f"'{text}'" in str(caught.value)


def test_a_ball_goes_in_as_deep_as_asked() -> None:
    mesh = place(Contact(Sphere(1.5), at=(3, -2), depth=0.8), FLAT, GEL)
    lowest = mesh.vertices[np.argmin(mesh.vertices[:, 2])]
    np.testing.assert_allclose(lowest, [3, -2, -0.8], atol=1e-9)
    assert mesh.bounds[1, 2] > 0.3  # and reaches out of the gel
    rim = mesh.vertices[np.abs(mesh.vertices[:, 2]) < 0.02]
    np.testing.assert_allclose(
        np.hypot(rim[:, 0] - 3, rim[:, 1] + 2), math.sqrt(1.5**2 - 0.7**2), atol=0.02
    )
    assert mesh.normals is not None
    middle = np.array([3, -2, 0.7])
    np.testing.assert_allclose(mesh.normals, (mesh.vertices - middle) / 1.5, atol=1e-9)


def test_a_point_counts_as_the_surface_point_next_to_it() -> None:
    by_point = place(Contact(Sphere(1), point=(2, 1, 0.1), depth=0.5), FLAT, GEL)
    by_place = place(Contact(Sphere(1), at=(2, 1), depth=0.5), FLAT, GEL)
    np.testing.assert_allclose(by_point.vertices, by_place.vertices, atol=1e-9)


def test_rotation_turns_a_cylinder_counter_clockwise_seen_from_outside() -> None:
    for rotation, angle in [(30.0, 0.0), (0.0, 30.0), (20.0, 10.0)]:
        contact = Contact(Cylinder(1.0, 10.0, angle), at=(0, 0), depth=0.4, rotation=rotation)
        mesh = place(contact, FLAT, GEL)
        far = mesh.vertices[np.argmax(mesh.vertices @ [1, 1, 0])]
        along = [math.cos(math.radians(30)), math.sin(math.radians(30))]
        assert far[:2] @ along == pytest.approx(5.0)
    flat = place(Contact(Cylinder(1.0, 10.0), at=(1, 2), depth=0.4), FLAT, GEL)
    np.testing.assert_allclose(flat.bounds[:, 0], [-4, 6], atol=1e-9)


def test_a_positive_tilt_lowers_the_side_of_v_or_of_u_in_a_direct_view() -> None:
    seen = SensingSurface(FLAT.mesh, (0, 0, 0), (1, 0, 0), (0, -1, 0))  # u x v points inward
    for plate, way in ((Plane(tilt_x=6.0), seen.v_axis), (Plane(tilt_y=6.0), seen.u_axis)):
        mesh = place(Contact(plate, depth=0.4), seen, GEL)
        lowest = mesh.vertices[mesh.vertices[:, 2] < mesh.bounds[0, 2] + 1e-9]
        np.testing.assert_allclose(lowest @ way, 4.0 * math.cos(math.radians(6.0)))


def test_an_indenter_lies_along_a_direction_of_the_frame() -> None:
    turned = place(Contact(Cylinder(1.0, 10.0), at=(1, 2), depth=0.4, rotation=70.0), FLAT, GEL)
    along = (math.cos(math.radians(50)), math.sin(math.radians(50)), 0.3)  # as the surface allows
    told = Contact(Cylinder(1.0, 10.0), at=(1, 2), depth=0.4, rotation=20.0, along=along)
    np.testing.assert_allclose(place(told, FLAT, GEL).vertices, turned.vertices, atol=1e-9)


def test_on_a_dome_the_way_in_is_the_inward_normal() -> None:
    vertices = GEL.vertices.copy()
    share = (vertices[:, 2] + 4.25) / 4.25
    vertices[:, 2] -= share * (vertices[:, 0] ** 2 + vertices[:, 1] ** 2) / 60
    gel = GEL.with_vertices(vertices)
    surface = surface_of(gel)
    contact = Contact(Sphere(1.5), point=(6.0, 0, -0.6), depth=0.5)
    mesh = place(contact, surface, gel)
    spot = surface.nearest((6.0, 0, -0.6))
    assert math.degrees(math.atan2(spot.inward[0], spot.inward[2])) == pytest.approx(
        -180 + math.degrees(math.atan(0.2)), abs=0.5
    )
    assert mesh.normals is not None
    centre = (mesh.vertices - 1.5 * mesh.normals).mean(axis=0)
    np.testing.assert_allclose(centre, spot.point - (1.5 - 0.5) * spot.inward, atol=1e-9)


@pytest.mark.parametrize(
    ("contact", "expected"),
    [
        (Contact(Sphere(1.5), at=(13, 0), depth=0.5), "off the sensing surface"),
        (Contact(Sphere(1.5), point=(0, 0, 3), depth=0.5), "3.00 mm away"),
        (Contact(Sphere(1.5), at=(0, 0), depth=4.25), "only 4.25 mm thick"),
    ],
)
def test_contacts_that_cannot_be_are_refused(contact: Contact, expected: str) -> None:
    with pytest.raises(ContactError, match=expected):
        place(contact, FLAT, GEL)


def test_contact_arguments_are_checked() -> None:
    with pytest.raises(ContactError, match="both `depth` and `force`"):
        Contact(Sphere(1.5), at=(0.0, 0.0), depth=0.3, force=2.0)
    with pytest.raises(ContactError, match="both"):
        Contact(Sphere(1), at=(0, 0), point=(0, 0, 0))


def test_gel_thickness_along_slanted_normals() -> None:
    assert available_depth((0, 0, 0), (0, 0, -1), GEL) == pytest.approx(4.25)
    slanted = np.array([0.6, 0, -0.8])
    assert available_depth((1, 1, 0), slanted, GEL) == pytest.approx(4.25 / 0.8)
    with pytest.raises(ContactError, match="no gel"):
        available_depth((0, 0, 0), (0, 0, 1), GEL)


def test_gel_is_as_thick_on_edges_of_its_mesh_and_at_its_border_as_elsewhere() -> None:
    tilted = GEL.transformed(np.vstack([np.hstack([TURN, [[3.0], [1.0], [7.0]]]), [0, 0, 0, 1]]))
    (x, y, _), height = GEL.bounds[1], GEL.bounds[1][2]
    inner = [(x * k / 10, y * k * sign / 10, height) for k in range(-9, 10) for sign in (1, -1)]
    border = [(x * sign, y * k / 10, height) for k in range(-9, 10) for sign in (1, -1)]
    for point in inner + border:
        for gel, turn, middle in ((GEL, np.eye(3), (0, 0, 0)), (tilted, TURN, (3.0, 1.0, 7.0))):
            found = available_depth(turn @ point + middle, turn @ (0, 0, -1), gel)
            assert found == pytest.approx(4.25, abs=1e-5), point


def test_a_gap_ends_a_gel_of_several_elastomers_and_a_film_of_glue_does_not() -> None:
    upper = TriangleMesh.box((-5, -5, -2), (5, 5, 0))
    for gap, thickness in ((0.1, 2.0), (0.04, 4.04), (-0.5, 3.5)):
        lower = TriangleMesh.box((-5, -5, -4 - gap), (5, 5, -2 - gap))
        for gels in ([upper, lower], [lower, upper]):
            for x in (1.0, 5.0):  # in the middle and at the border
                assert available_depth((x, 0, 0), (0, 0, -1), gels) == pytest.approx(thickness)


def test_a_missing_mesh_file_is_named(tmp_path: Path) -> None:
    contact = parse_contact(f"mesh:{tmp_path}/none.stl@0,0:0.2")
    with pytest.raises(MeshError, match=r"none\.stl"):
        place(contact, FLAT, GEL)


@pytest.mark.parametrize(
    ("given", "hint"),
    [(["sphere:1.5@0,0:0.5"], "parse_contact"), (Contact(Sphere(2)), r"\[contact\]")],
)
def test_an_argument_that_is_no_list_of_contacts_is_refused(given: Any, hint: str) -> None:
    with pytest.raises(ContactError, match=rf"no list of contacts.*{hint}"):
        refuse_no_contacts(given)

"""The objects that come with the package have the shapes that their names promise."""

from __future__ import annotations

import math

import numpy as np
import pytest

from optisense.errors import ContactError
from optisense.geometry import Contact, TriangleMesh, parse_contact
from optisense.geometry.indenter_kinds import indenter_from_plain
from optisense.geometry.objects import OBJECTS, ObjectIndenter
from optisense.geometry.objects._relief import TOP
from optisense.mechanics._height_map import heights

FINE = 0.02
"""Pitch (mm) of the grids on which heights are sampled."""


def height_map(name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Its heights (mm) on a fine grid around its middle line, and the places of the grid."""
    mesh = OBJECTS[name].mesh()
    x, y = (np.arange(-end, end + FINE / 2, FINE) for end in (5.0, 0.7))
    return heights(mesh, x, y), *np.meshgrid(x, y)


@pytest.mark.parametrize("name", OBJECTS)
def test_an_object_is_a_closed_mesh_on_its_plate(name: str) -> None:
    relief = OBJECTS[name]
    mesh = relief.mesh()
    mesh.validate(name, closed=True)  # raises where it is open or wound the wrong way
    assert mesh.bounds[0, 2] == 0.0
    # Closed and wound outward: the divergence theorem gives the volume, which a box bounds.
    corners = mesh.triangles
    swept = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum()
    box = np.prod(np.ptp(mesh.bounds, axis=0))
    assert 0.3 * box < swept / 6.0 < box
    touching = np.abs(mesh.vertices[mesh.vertices[:, 2] < 0.1, :2])
    assert (touching.max(axis=0) <= np.array(relief.size) / 2 + 0.1).all()
    assert 0.0 < relief.depth < TOP / 2
    # Shading normals are those of the heights: they agree with the triangles' own where these
    # are large against the rounded edges.
    assert mesh.normals is not None
    cosine = np.einsum("ij,ij->i", mesh.face_normals, mesh.normals[mesh.faces].mean(axis=1))
    assert np.median(cosine) > 0.998


def test_a_wedge_has_its_two_slopes() -> None:
    found, x, _ = height_map("wedge")
    row = found[found.shape[0] // 2]
    places = x[0]
    for here, slope in ((-1.5, -math.tan(math.radians(20.0))), (1.5, math.tan(math.radians(35.0)))):
        near = np.abs(places - here) < 0.3
        assert np.polyfit(places[near], row[near], 1)[0] == pytest.approx(slope, rel=2e-3)


def test_a_thread_repeats_at_its_pitch_and_is_as_deep_as_its_flanks() -> None:
    found, x, _ = height_map("screw-thread")
    places, row = x[0], found[found.shape[0] // 2]
    inside = np.abs(places) < 2.4  # and 0.7 mm on still short of the end
    shifted = np.interp(places + 0.7, places, row)
    assert np.abs(shifted[inside] - row[inside]).max() < 0.01
    assert np.ptp(row[inside]) == pytest.approx(0.43, abs=0.03)


def test_braille_dots_are_caps_of_a_sphere() -> None:
    found, x, y = height_map("braille")
    away = np.hypot(x - 1.25, y)  # a dot in the middle of the right column
    radius = (0.75**2 + 0.48**2) / (2 * 0.48)
    inside = away < 0.6
    cap = radius - np.sqrt(radius**2 - away[inside] ** 2)
    assert np.abs(found[inside] - cap).max() < 0.01
    ground = found[(np.abs(x) < 0.3) & (np.abs(y) < 0.3)]
    assert ground == pytest.approx(0.48, abs=0.01)


def test_a_nut_measures_its_width_across_flats() -> None:
    found, x, _ = height_map("nut")
    row = np.abs(x[0][found[found.shape[0] // 2] < TOP / 2])
    assert 2 * row.max() == pytest.approx(5.5, abs=0.5)  # the wall's draft up to half its height
    touching = np.abs(x[0][found[found.shape[0] // 2] < 0.05])
    assert touching.min() == pytest.approx(1.7, abs=0.1)


def test_objects_are_pressed_by_name() -> None:
    contact = parse_contact("object:coin,0.5@1,2:0.3:45")
    assert contact == Contact(ObjectIndenter("coin", 0.5), (1, 2), depth=0.3, rotation=45)
    plain = {"kind": "object", "name": "coin", "scale": 0.5}
    assert indenter_from_plain(plain) == contact.indenter
    whole, low = contact.indenter.mesh(math.inf), contact.indenter.mesh(0.05)
    assert isinstance(whole, TriangleMesh)
    np.testing.assert_allclose(2 * whole.bounds, OBJECTS["coin"].mesh().bounds)
    assert len(low.faces) < len(whole.faces)
    assert low.bounds[1, 2] < 0.5


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("object:coyn@0,0:0.3", "no object 'coyn'"),
        ("object:coin,big@0,0:0.3", "scale of an object is 'big'"),
        ("object:coin,0@0,0:0.3", "scale"),
        ("object:coin,nan@0,0:0.3", "scale"),
    ],
)
def test_strange_objects_are_refused(text: str, words: str) -> None:
    with pytest.raises(ContactError, match=words):
        parse_contact(text)


@pytest.mark.parametrize("values", [{}, {"name": 3}, {"name": "coin", "size": 2}])
def test_strange_requests_are_refused(values: dict[str, object]) -> None:
    with pytest.raises(ContactError, match="object"):
        indenter_from_plain({"kind": "object", **values})

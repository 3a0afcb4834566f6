"""Meshes of indenters are exact to well below a micrometre where they can touch the skin."""

import math

import numpy as np
import pytest

from optisense.errors import ContactError
from optisense.geometry import (
    Cylinder,
    Indenter,
    MeshIndenter,
    Plane,
    Sphere,
    TriangleMesh,
    parse_contact,
)


def dense_points(mesh: TriangleMesh) -> np.ndarray:
    """Points spread over each face: corners, middles of edges, and centres."""
    a, b, c = mesh.triangles[:, 0], mesh.triangles[:, 1], mesh.triangles[:, 2]
    return np.concatenate([a, b, c, (a + b) / 2, (b + c) / 2, (c + a) / 2, (a + b + c) / 3])


ALL: list[Indenter] = [
    Sphere(1.5),
    Cylinder(2.0, 6.0, 30.0),
    Plane(3.0, -8.0, 5.0),
    MeshIndenter(TriangleMesh.box((1, 2, 3), (2, 4, 4)), 2.0),
]


@pytest.mark.parametrize("indenter", ALL)
def test_every_indenter_stands_on_its_tip_and_looks_outward(indenter: Indenter) -> None:
    mesh = indenter.mesh(1.0)
    assert mesh.bounds[0, 2] == pytest.approx(0.0, abs=1e-12)
    assert mesh.normals is not None
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1.0)
    corner_normals = mesh.normals[mesh.faces]
    assert (np.einsum("fcj,fj->fc", corner_normals, mesh.face_normals) > 0.9).all()
    assert mesh.normals[mesh.vertices[:, 2] < 1e-12, 2].min() < -0.9


@pytest.mark.parametrize("radius", [0.4, 1.5, 30.0])
def test_facets_of_a_sphere_stay_within_half_a_micrometre(radius: float) -> None:
    reach = min(1.3, 2 * radius)
    mesh = Sphere(radius).mesh(reach)
    error = radius - np.linalg.norm(dense_points(mesh) - [0, 0, radius], axis=1)
    assert error.max() < 5e-4
    assert error.min() > -1e-9
    assert len(mesh.faces) < 40_000
    assert mesh.bounds[1, 2] == pytest.approx(reach)
    cap = 2 * math.pi * radius * reach
    assert mesh.area == pytest.approx(cap, rel=2e-3)


def test_a_ball_is_whole_when_all_of_it_can_touch() -> None:
    mesh = Sphere(1.0).mesh(5.0)
    mesh.validate("ball", closed=True)
    assert mesh.area == pytest.approx(4 * math.pi, rel=2e-3)
    assert mesh.bounds[1, 2] == pytest.approx(2.0)


def test_facets_of_a_cylinder_stay_within_half_a_micrometre() -> None:
    mesh = Cylinder(2.0, 6.0, 90.0).mesh(1.0)
    assert mesh.normals is not None
    side = np.abs(mesh.normals[mesh.faces][:, :, 1]).max(axis=1) < 0.5  # axis along y
    points = dense_points(TriangleMesh(mesh.vertices, mesh.faces[side]))
    error = 2.0 - np.hypot(points[:, 0], points[:, 2] - 2.0)
    assert 0 <= error.max() < 5e-4
    np.testing.assert_allclose(mesh.bounds[:, 1], [-3, 3], atol=1e-12)
    half_angle = math.acos(0.5)
    segment = 4.0 * (half_angle - math.sin(half_angle) * math.cos(half_angle))
    assert mesh.area == pytest.approx(6.0 * 2.0 * 2 * half_angle + 2 * segment, rel=1e-3)


def test_a_tilted_plate_keeps_its_tilt() -> None:
    mesh = Plane(tilt_x=10.0, size=4.0).mesh(1.0)
    assert mesh.normals is not None
    down = mesh.normals[np.argmin(mesh.normals[:, 2])]
    assert math.degrees(math.acos(-down[2])) == pytest.approx(10.0)
    assert Plane().mesh(1.0).bounds[0].tolist() == [-4, -4, 0]


def test_a_mesh_is_scaled_and_put_on_its_tip() -> None:
    cone = TriangleMesh(
        np.array([[5, 5, 1], [6, 5, 2], [5, 6, 2], [4, 4, 2]]),
        np.array([[0, 2, 1], [0, 3, 2], [0, 1, 3], [1, 2, 3]]),
    )
    mesh = MeshIndenter(cone, scale=0.5).mesh(9.0)
    tips = mesh.vertices[mesh.vertices[:, 2] < 1e-9]
    np.testing.assert_allclose(tips, 0.0, atol=1e-12)
    assert mesh.bounds[1, 2] == pytest.approx(0.5)


@pytest.mark.parametrize("radius", [0.0, -1.0, math.nan, math.inf])
def test_a_radius_must_be_a_length(radius: float) -> None:
    with pytest.raises(ContactError, match="radius"):
        Sphere(radius)
    with pytest.raises(ContactError, match="radius"):
        Cylinder(radius)


@pytest.mark.parametrize(
    ("text", "form"),
    [
        ("sphere:", "sphere:RADIUS"),
        ("cylinder:1,2,3,4", "cylinder:RADIUS[,LENGTH][,ANGLE]"),
        ("plane:1,2,3,4", "plane:[TILT_X][,TILT_Y][,SIZE]"),
    ],
)
def test_a_text_of_too_few_or_many_numbers_is_shown_its_form(text: str, form: str) -> None:
    with pytest.raises(ContactError) as raised:
        parse_contact(f"{text}@0,0:0.5")
    assert raised.value.hint == f"Write {form}"

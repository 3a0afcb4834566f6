"""Solids that nearly touch are joined, and then their media meet without air in between."""

from __future__ import annotations

import numpy as np
import pytest

from optisense.geometry import TriangleMesh
from optisense.geometry.joining import join, touching_area
from optisense.geometry.mesh_points import closest_on_triangles
from optisense.optics.scene.media import Media, Solid
from optisense.sensors._shapes import arc, revolve

GEL = TriangleMesh.box((-10, -8, -4), (10, 8, 0), (4, 4, 2))
DISTANCE = 0.05

PLATES = {
    "larger": ((-12, -10), (12, 10), 320.0),
    "smaller": ((-7, -6), (7, 6), 168.0),
    "across": ((-12, -6), (12, 6), 240.0),
    "flush": ((-10, -8), (10, 8), 320.0),
}


def plate(name: str, top: float) -> TriangleMesh:
    low, high, _ = PLATES[name]
    return TriangleMesh.box((*low, top - 2), (*high, top))


def contact_area(gel: TriangleMesh, support: TriangleMesh) -> float:
    """mm^2 of the interface between both that the media have."""
    faces = Media(
        [Solid("gel", gel, "gel", 1.41, priority=0), Solid("plate", support, "plate", 1.49, 0.0, 1)]
    ).interfaces
    return sum(face.mesh.area for face in faces if len(face.names) == 2)


@pytest.mark.parametrize("name", PLATES)
@pytest.mark.parametrize("gap", [0.01, 0.049, -0.01, -0.049])
def test_flat_faces_move_into_one_plane(name: str, gap: float) -> None:
    support = plate(name, -4.0 - gap)
    result = join(GEL, support, DISTANCE)
    assert (result.kind, result.gap) == ("flat", pytest.approx(gap))
    assert result.mesh.is_closed
    assert result.mesh.bounds[0, 2] == pytest.approx(-4.0 - gap, abs=1e-12)
    assert result.mesh.bounds[1, 2] == 0.0
    assert contact_area(result.mesh, support) == pytest.approx(PLATES[name][2])


def test_without_joining_a_hundredth_of_a_millimetre_is_a_film_of_air() -> None:
    assert contact_area(GEL, plate("larger", -4.01)) == 0.0


@pytest.mark.parametrize("gap", [0.0, 0.0005, 0.06, 1.0])
def test_what_touches_or_is_far_apart_is_left_alone(gap: float) -> None:
    result = join(GEL, plate("larger", -4.0 - gap), DISTANCE)
    assert result.kind == "none"
    assert result.mesh is GEL


def test_rounding_to_single_precision_needs_no_joining() -> None:
    """Binary STL: numbers of 10 to 100 mm are rounded to some millionths of a millimetre."""
    turn = np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
    tilt = np.array([[0.96, 0.0, -0.28], [0.0, 1.0, 0.0], [0.28, 0.0, 0.96]])
    rounded = [
        TriangleMesh(((m.vertices + 40) @ (turn @ tilt).T).astype(np.float32), m.faces)
        for m in (GEL, plate("larger", -4.0))
    ]
    assert join(*rounded, DISTANCE).kind == "none"
    assert contact_area(*rounded) == pytest.approx(320.0, rel=1e-4)


def dome(outer: float, inner: float, steps: int, segments: int) -> TriangleMesh:
    """Half a hollow ball, open side down."""
    return revolve(
        [
            [inner, 0.0],
            *arc((0, 0), outer, 0.0, 90.0, steps),
            *arc((0, 0), inner, 90.0, 0.0, steps),
        ],
        segments,
    )


SAG = 11.0 * (1.0 - np.cos(np.radians(2.8125)))
"""Distance (mm) between the ball and the chords of 5.6 degrees on the inside of the gel."""


@pytest.mark.parametrize("gap", [0.0, 0.01, -0.01])
def test_curved_faces_cut_into_other_triangles_are_joined(gap: float) -> None:
    """The contact of a gel of inner radius 11 mm has the area of the half sphere, 2 pi r^2."""
    gel, shell = dome(14.0, 11.0, 16, 64), dome(11.0 - gap, 8.5, 17, 68)
    result = join(gel, shell, DISTANCE)
    assert result.kind == "curved"
    assert result.gap == pytest.approx(gap, abs=2 * SAG)
    assert result.mesh.is_closed
    assert contact_area(result.mesh, shell) == pytest.approx(2 * np.pi * 121.0, rel=0.02)


def test_without_joining_curved_faces_meet_here_and_there() -> None:
    gel, shell = dome(14.0, 11.0, 5, 20), dome(11.0, 8.5, 6, 24)
    assert contact_area(gel, shell) < 0.9 * 2 * np.pi * 121.0


def test_equal_triangles_need_no_joining() -> None:
    assert join(dome(14.0, 11.0, 12, 48), dome(11.0, 8.0, 12, 48), DISTANCE).kind == "none"


def test_the_area_that_touches() -> None:
    assert touching_area(GEL, plate("smaller", -4.02), DISTANCE) == pytest.approx(168.0)
    assert touching_area(GEL, plate("larger", -4.2), DISTANCE) == 0.0


def test_closest_points_agree_with_many_points_tried() -> None:
    random = np.random.default_rng(3)
    triangles, points = random.normal(size=(20, 3, 3)), 2 * random.normal(size=(20, 3))
    share = random.dirichlet(np.ones(3), size=20_000)
    for triangle, point, found in zip(
        triangles, points, closest_on_triangles(points, triangles), strict=True
    ):
        tried = np.linalg.norm(share @ triangle - point, axis=1).min()
        assert np.linalg.norm(found - point) <= tried + 1e-12
        assert np.linalg.norm(found - point) == pytest.approx(tried, abs=0.05)

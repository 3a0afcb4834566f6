"""Triangles cut along planes: the shape stays, edges get short, and closed meshes stay closed."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from optisense.errors import MeshError
from optisense.geometry import TriangleMesh
from optisense.geometry.plane_cuts import cut_along_planes


def extrusion(facets: int = 40) -> TriangleMesh:
    """A half-cylinder of 36 mm along x, whose triangles are as long as it is."""
    angles = np.linspace(0.0, np.pi, facets + 1)
    outline = np.column_stack([8.0 * np.cos(angles), 8.0 * np.sin(angles)])
    count = len(outline)
    ends = [np.column_stack([np.full(count, x), outline]) for x in (0.0, 36.0)]
    here, there = np.arange(count - 1), np.arange(1, count)
    round_side = [
        np.stack([here, here + count, there], axis=1),
        np.stack([there, here + count, there + count], axis=1),
    ]
    flat = np.array([[0, count - 1, count], [count, count - 1, 2 * count - 1]])
    fan = np.stack([np.zeros(count - 2, int), here[1:], there[1:]], axis=1)
    faces = np.concatenate([*round_side, flat, fan, fan[:, ::-1] + count])
    return TriangleMesh(np.concatenate(ends), faces)


def longest_edge(mesh: TriangleMesh) -> float:
    sides = mesh.triangles - np.roll(mesh.triangles, 1, axis=1)
    return float(np.linalg.norm(sides, axis=2).max())


@pytest.mark.parametrize("shape", ["extrusion", "box", "ball"])
def test_the_shape_stays_and_its_edges_get_short(shape: str) -> None:
    if shape == "ball":
        ball = trimesh.creation.icosphere(subdivisions=2, radius=5.0)
        mesh = TriangleMesh(ball.vertices, ball.faces)
    else:
        mesh = extrusion() if shape == "extrusion" else TriangleMesh.box((0, 0, 0), (9, 7, 0.5))
    assert mesh.is_closed
    cut = cut_along_planes(mesh, 1.0, 100_000)
    assert cut.is_closed
    assert cut.volume == pytest.approx(mesh.volume, rel=1e-12)
    assert cut.area == pytest.approx(mesh.area, rel=1e-12)
    assert longest_edge(cut) <= (1.0 + 0.2) * np.sqrt(3.0)  # the diagonal of a cell, and snapping
    np.testing.assert_array_equal(
        cut.vertices[: len(mesh.welded().vertices)], mesh.welded().vertices
    )


def test_long_triangles_are_not_cut_into_thousands_of_thin_ones() -> None:
    mesh = extrusion()
    cells = mesh.area / 1.0**2
    assert len(cut_along_planes(mesh, 1.0, 100_000).faces) < 10.0 * cells


def test_a_mesh_with_short_edges_stays() -> None:
    mesh = TriangleMesh.box((0, 0, 0), (4, 4, 4), (4, 4, 4))
    cut = cut_along_planes(mesh, 1.0, 1000)
    assert len(cut.faces) == len(mesh.faces)


def test_too_many_triangles_are_refused() -> None:
    with pytest.raises(MeshError, match="more than 1,000 triangles"):
        cut_along_planes(extrusion(), 0.01, 1000)

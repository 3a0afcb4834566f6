"""Where meshes lie on one another: what is covered and what is not add up, whatever the edges."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from optisense.geometry import TriangleMesh
from optisense.geometry._flat_polygons import area_and_length, common
from optisense.geometry.coincidence import cut, find_coincident, sample_seam
from optisense.geometry.shading_normals import shaded
from optisense.geometry.solids import cut_out

SIDES = 96


def disc(radius: float, inches: bool, up: bool) -> TriangleMesh:
    """A fan of triangles, with corners of single precision as an STL file has them."""
    angle = 2.0 * np.pi * np.arange(SIDES) / SIDES
    rim = np.stack([radius * np.cos(angle), radius * np.sin(angle), 0.0 * angle], axis=1)
    vertices = np.concatenate([[[0.0, 0.0, 0.0]], rim])
    if inches:
        vertices = (vertices / 25.4).astype(np.float32).astype(np.float64) * 25.4
    row = np.arange(SIDES)
    faces = np.stack([0 * row, 1 + row, 1 + (row + 1) % SIDES], axis=1)
    return TriangleMesh(vertices, faces if up else faces[:, ::-1])


@pytest.mark.parametrize("inches", [False, True])
@pytest.mark.parametrize("first_corner", [0, 1, 2])
def test_fans_whose_spokes_lie_on_one_another(inches: bool, first_corner: int) -> None:
    # The spokes of both are the same lines up to rounding, the larger ones are longer.
    large, small = (
        mesh.with_faces(np.roll(mesh.faces, first_corner, axis=1))
        for mesh in (disc(10.0, inches, up=True), disc(9.0, inches, up=False))
    )
    exact = 0.5 * SIDES * np.sin(2.0 * np.pi / SIDES)
    for one, other in ((large, small), (small, large)):
        covered, rest = cut(one, [find_coincident(one, other, 0.002, facing=True)])
        assert covered.area == pytest.approx(exact * 9.0**2, rel=1e-6)
        assert rest.area == pytest.approx(one.area - covered.area, abs=1e-4)


def test_triangles_are_clipped_by_one_another() -> None:
    rng = np.random.default_rng(0)
    one, other = rng.random((2, 500, 3, 2))
    other[:50] = one[:50]  # the same
    other[50:100, :2] = one[50:100, 1::-1]  # with a common edge
    area, length = area_and_length(common(one, other))
    known = shapely.intersection(shapely.polygons(one), shapely.polygons(other), grid_size=1e-12)
    assert area == pytest.approx(shapely.area(known), abs=1e-9)
    solid = area > 1e-6
    assert solid.sum() > 200
    assert length[solid] == pytest.approx(shapely.length(known)[solid], abs=1e-6)


def test_the_seam_of_a_small_solid_on_a_large_one_is_measured_in_either_order() -> None:
    plate = TriangleMesh.box((-50.0, -50.0, 0.0), (50.0, 50.0, 10.0))
    pad = TriangleMesh.box((-2.5, -2.5, 10.02), (2.5, 2.5, 15.0))
    for one, other in ((plate, pad), (pad, plate)):
        seam = sample_seam(one, other, 0.05)
        assert len(seam.heights) * seam.area == pytest.approx(25.0, rel=0.02)
        np.testing.assert_allclose(seam.heights, 0.02, atol=1e-9)


def test_pieces_keep_the_edges_of_the_whole_mesh_smooth() -> None:
    """An edge between two facets, without the next ones of its curve, would be a crease."""
    block = TriangleMesh.box((-10, -5, 0), (10, 5, 1), (8, 1, 1))
    x, y, z = block.vertices.T
    arch = block.with_vertices(np.column_stack([x, y, z * (4 - 0.02 * x**2)]))
    middle = arch.triangles.mean(axis=1)
    beside = (np.abs(middle[:, 0]) > 2.5) & (middle[:, 2] > 1)
    sheet = arch.with_faces(arch.faces[beside]).compacted()
    rest = cut(arch, [find_coincident(arch, sheet, 0.002, facing=False)])[-1]
    sides = [TriangleMesh.box((-11, -6, -1), (-2, 6, 5)), TriangleMesh.box((2, -6, -1), (11, 6, 5))]
    for piece in (rest, cut_out(arch, TriangleMesh.joined(sides))):
        found = shaded(piece)
        assert found.normals is not None
        ridge = (np.abs(found.vertices[:, 0]) < 1e-6) & (found.vertices[:, 2] > 3.9)
        upward = found.normals[ridge & (found.normals[:, 2] > 0.5)]
        assert len(upward) >= 2
        np.testing.assert_allclose(upward, np.tile([0.0, 0.0, 1.0], (len(upward), 1)), atol=1e-6)

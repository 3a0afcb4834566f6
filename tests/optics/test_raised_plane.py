"""The raised plane: places where photons cross it, and which camera samples look it up."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
import trimesh

from optisense.optics.radiance_cache._raised_plane import (
    RAISED_HEIGHT,
    areas,
    crossings,
    raised_height,
    sampled_plane,
)
from optisense.optics.scene.surface_cells import build_cells, cell_at

SQUARE = np.array([[-5, -5, 0], [5, -5, 0], [5, 5, 0], [-5, 5, 0]], dtype=float)
RADIUS = 16.0
"""Radius (mm) of a dome."""
SPACING = 0.05
"""Spacing (mm) of the photons of a beam."""
FACES = np.array([[0, 1, 2], [0, 2, 3]])


def test_a_slanting_photon_crosses_the_plane_behind_its_landing() -> None:
    cells = build_cells(SQUARE, FACES, 0.5)
    point = mi.Point3f(1.0, 0.2, 0.0)
    landed, found = cell_at(cells, point, mi.Bool(True))
    for tangent in (0.0, 1.0, 3.0):
        direction = dr.normalize(mi.Vector3f(tangent, 0, -1))
        crossed, _, crosses = crossings(cells, landed, point, direction, -direction.z, found)
        expected, _ = cell_at(
            cells, point - mi.Vector3f(tangent * RAISED_HEIGHT, 0, 0), mi.Bool(True)
        )
        assert crosses[0] and crossed[0] == expected[0]


def test_the_plane_is_lower_above_a_small_surface() -> None:
    fineness = 0.4
    cells = build_cells(fineness * SQUARE, FACES, fineness * 0.5, fineness=fineness)
    assert raised_height(cells)[0] == pytest.approx(fineness * RAISED_HEIGHT)
    assert np.asarray(areas(cells)) == pytest.approx(1.0)


def test_photons_from_beyond_the_edge_and_from_behind_do_not_count() -> None:
    cells = build_cells(SQUARE, FACES, 0.5)
    point = mi.Point3f(-4.8, 0.2, 0.0)
    landed, found = cell_at(cells, point, mi.Bool(True))
    for direction in (mi.Vector3f(5, 0, -1), mi.Vector3f(0, 0, 1)):
        direction = dr.normalize(direction)
        crosses = crossings(cells, landed, point, direction, -direction.z, found)[2]
        assert not crosses[0]


@pytest.mark.parametrize("cosine", [0.35, 0.6, 0.95])
def test_a_beam_is_as_strong_above_a_dome_as_on_it(cosine: float) -> None:
    dome = trimesh.creation.icosphere(subdivisions=5, radius=RADIUS)
    # Seen from inside, as gel over a coating.
    vertices, faces = np.asarray(dome.vertices), np.asarray(dome.faces)[:, ::-1]
    low = vertices[faces][:, :, 2].max(axis=1) < 0
    corners = -vertices[faces[low]] / RADIUS
    cells = build_cells(vertices, faces[low], 0.5, corners)
    # Parallel photons that travel downwards, evenly spread across their direction.
    side = np.arange(-RADIUS, RADIUS, SPACING) + SPACING / 2
    x, y = (each.ravel() for each in np.meshgrid(side, side))
    inside = np.hypot(x, y) < 0.98 * RADIUS
    x, y = x[inside], y[inside]
    depth = np.sqrt(RADIUS**2 - x**2 - y**2)
    point, direction = mi.Point3f(x, y, -depth), mi.Vector3f(0, 0, -1)
    landed, found = cell_at(cells, point, mi.Bool(True))
    crossed, relative, crosses = crossings(
        cells, landed, point, direction, mi.Float(depth / RADIUS), found, areas(cells)
    )
    power = np.where(crosses, relative, 0) / (depth / RADIUS) * SPACING**2
    flux = np.bincount(np.asarray(crossed), power, cells.cells)
    near = np.abs(cells.normals[:, 2] - cosine) < 0.05
    assert flux[near].sum() / cells.areas[near].sum() == pytest.approx(1, rel=0.02)


@pytest.mark.parametrize("share", [0.0, 0.25, 0.75, 1.2])
def test_samples_look_up_the_plane_in_proportion_to_their_height(share: float) -> None:
    count = 1200
    cells = build_cells(SQUARE, FACES, 0.5)
    points = SimpleNamespace(
        series=dr.full(mi.UInt32, 7, count), number=dr.arange(mi.UInt32, count)
    )
    rise = dr.full(mi.Float, share * RAISED_HEIGHT, count)
    above = sampled_plane(cells, cast(Any, points), rise, mi.Bool(True))
    assert np.asarray(above).mean() == pytest.approx(min(share, 1.0), abs=0.01)
    beside = sampled_plane(cells, cast(Any, points), rise, dr.full(mi.Bool, False, count))
    assert not np.asarray(beside).any()

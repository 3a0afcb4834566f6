"""The bend radius of sheets whose curvature is known."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from optisense import evaluate
from optisense.errors import ObjectiveError
from optisense.geometry import TriangleMesh
from optisense.objectives._bent_parts import (
    MOST_RADIUS,
    bend_radius,
    edge_curvatures,
    radius_of,
)
from optisense.objectives.testing import evaluation
from optisense.optics import OpticalModel
from optisense.sensors import load

SHEET = TriangleMesh.grid((20.0, 10.0), (80, 40))


def radius(bent: TriangleMesh, flat: TriangleMesh = SHEET) -> float:
    return radius_of(*edge_curvatures(flat, bent))


def rolled(sheet: TriangleMesh, by: float, axis: int = 0) -> TriangleMesh:
    """A flat sheet laid around a cylinder of a radius."""
    x, z = sheet.vertices[:, axis], sheet.vertices[:, 2]
    vertices = sheet.vertices.copy()
    vertices[:, axis] = (by + z) * np.sin(x / by)
    vertices[:, 2] = (by + z) * np.cos(x / by)
    return TriangleMesh(vertices, sheet.faces)


@pytest.mark.parametrize("by", [4.0, 15.0, 200.0])
@pytest.mark.parametrize("axis", [0, 1])
def test_a_rolled_sheet_has_the_radius_of_the_cylinder(by: float, axis: int) -> None:
    assert radius(rolled(SHEET, by, axis)) == pytest.approx(by, rel=0.01)


def test_a_flat_sheet_is_not_bent() -> None:
    assert radius(SHEET) == MOST_RADIUS


def test_the_sharper_half_counts() -> None:
    """A sheet that is straight on one side and rolled on the other."""
    vertices = SHEET.vertices.copy()
    right = vertices[:, 0] > 0
    vertices[right, 2] = 6.0 - 6.0 * np.cos(vertices[right, 0] / 6.0)
    vertices[right, 0] = 6.0 * np.sin(vertices[right, 0] / 6.0)
    assert radius(TriangleMesh(vertices, SHEET.faces)) == pytest.approx(6.0, rel=0.01)


def test_edges_of_the_part_itself_are_no_curvature() -> None:
    box = TriangleMesh.box((0.0, 0.0, 0.0), (10.0, 10.0, 2.0))
    assert radius(box, box) == MOST_RADIUS


def test_a_single_crease_does_not_decide() -> None:
    vertices = SHEET.vertices.copy()
    corner = np.flatnonzero((vertices[:, 0] > 9.9) & (vertices[:, 1] > 4.9))
    vertices[corner, 2] += 0.5
    bent = TriangleMesh(vertices, SHEET.faces)
    curvature, _ = edge_curvatures(SHEET, bent)
    assert curvature.max() > 1.0
    assert radius(bent) == MOST_RADIUS


def test_the_mirror_of_gelsight_svelte_is_one_long_arc() -> None:
    """Its profile is a polynomial, whose radius is known."""
    design = load("gelsight-svelte")
    score = evaluate(OpticalModel(design), "bend_radius")
    assert score.unit == "mm"
    points = design.deformed_meshes()["M1"].vertices
    profile = np.poly1d(np.polyfit(points[:, 2], points[:, 0], 4))
    assert np.abs(points[:, 0] - profile(points[:, 2])).max() < 1e-4
    z = np.linspace(points[:, 2].min(), points[:, 2].max(), 101)
    radii = (1.0 + profile.deriv()(z) ** 2) ** 1.5 / np.abs(profile.deriv(2)(z))
    assert score.value == pytest.approx(radii.min(), rel=0.002)
    assert score.parts["sharpest"] <= score.value == score.parts["of_parts"]["M1"]


def test_a_design_without_bent_parts_has_none() -> None:
    own = evaluation().design.copy()
    own.cages = {}
    stand_in: Any = SimpleNamespace(design=own)
    with pytest.raises(ObjectiveError, match="no cage bends"):
        bend_radius(stand_in)

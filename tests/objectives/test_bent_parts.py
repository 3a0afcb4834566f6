"""Bend radius, draft, clearance and cage roughness of shapes for which they are known."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from optisense import evaluate, load, set_value
from optisense.errors import ObjectiveError
from optisense.geometry import TriangleMesh
from optisense.objectives._bent_parts import (
    MOST_RADIUS,
    bend_radius,
    cage_roughness,
    draft,
    draft_of,
    edge_curvatures,
    radius_of,
    unevenness,
)
from optisense.objectives._clearance import clearance, distance
from optisense.objectives.testing import evaluation
from optisense.optics import OpticalModel

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


def of(design: Any) -> Any:
    return SimpleNamespace(design=design)


@pytest.mark.parametrize("slope", [0.0, 30.0, 60.0])
def test_the_draft_of_a_roof_is_its_slope(slope: float) -> None:
    vertices = SHEET.vertices.copy()
    vertices[:, 2] = np.abs(vertices[:, 0]) * np.tan(np.radians(slope))
    assert draft_of(TriangleMesh(vertices, SHEET.faces)) == pytest.approx(90.0 - slope)


def test_more_than_half_a_tube_is_undercut() -> None:
    angle = SHEET.vertices[:, 0] / 10.0 * np.radians(120.0)
    vertices = np.stack([np.sin(angle), SHEET.vertices[:, 1], np.cos(angle)], axis=1)
    assert draft_of(TriangleMesh(vertices, SHEET.faces)) == pytest.approx(-30.0, abs=5.0)


def test_clearance_is_the_distance_of_boxes_and_of_their_edges() -> None:
    box = TriangleMesh.box((0.0, 0.0, 0.0), (10.0, 10.0, 2.0))
    assert distance(box, TriangleMesh.box((3.0, 3.0, 2.7), (4.0, 4.0, 5.0))) == pytest.approx(0.7)
    assert distance(box, TriangleMesh.box((13.0, -5.0, 6.0), (14.0, 20.0, 9.0))) == pytest.approx(
        5.0
    )
    crossing = TriangleMesh.box((9.0, 9.0, 1.0), (14.0, 20.0, 9.0))
    assert distance(box, crossing) == pytest.approx(0.0, abs=1e-6)


def test_a_mirror_that_is_bent_towards_the_gel_loses_clearance() -> None:
    svelte = load("gelsight-svelte")
    flat, bent = (set_value(svelte, "cages.M1.blend", share) for share in (0.0, 1.0))
    (before, _), (after, parts) = clearance(of(flat)), clearance(of(bent))
    assert after != pytest.approx(before, abs=0.05)
    assert "M1" in parts["of_parts"] or after > 0.0


def test_cages_that_are_moved_evenly_are_not_rough() -> None:
    lattice = np.stack(np.meshgrid(*[np.arange(3.0)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    even = lattice @ np.array([[0.1, 0.2, 0.0], [0.0, -0.1, 0.0], [0.3, 0.0, 0.0]]) + 1.0
    assert unevenness(even, (3, 3, 3)) == pytest.approx(0.0, abs=1e-12)
    one = np.zeros((27, 3))
    one[13, 2] = 0.6
    uneven = unevenness(one, (3, 3, 3))
    assert sorted(uneven)[-3:] == pytest.approx([0.6, 0.6, 0.6])
    assert np.count_nonzero(uneven) == 3
    assert len(unevenness(np.zeros((8, 3)), (2, 2, 2))) == 0


def test_designs_without_cages_have_neither_draft_nor_roughness() -> None:
    plain = load("gelbelt").copy()
    plain.cages = {}
    for score in (draft, cage_roughness):
        with pytest.raises(ObjectiveError, match="cage"):
            score(of(plain))
    value, parts = draft(of(load("gelsight-svelte")))
    assert 0.0 < value < 90.0 and set(parts["of_parts"]) == {"M1"}

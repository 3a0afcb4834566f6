"""Draft, clearance and cage roughness of shapes for which they are known."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from optisense import load, set_value
from optisense.errors import ObjectiveError
from optisense.geometry import TriangleMesh
from optisense.objectives._bent_parts import cage_roughness, draft, draft_of, unevenness
from optisense.objectives._clearance import clearance, distance

SHEET = TriangleMesh.grid((20.0, 10.0), (40, 20))


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

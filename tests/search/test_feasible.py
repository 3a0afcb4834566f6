"""The nearest point at which a design can be built, and what is left of a slope there."""

from __future__ import annotations

import numpy as np
import pytest

from optisense import SensorDesign
from optisense.search import Around, SearchSpace
from optisense.search.methods._feasible import FeasibleRegion
from optisense.search.space.constraints import NoCrossings

MIRROR = {
    "cages.M1.points.x": Around(8.0),
    "cages.M1.points.y": Around(1.0),
    "cages.M1.points.z": Around(2.0),
}


def test_a_mirror_that_is_wanted_inside_a_part_is_moved_beside_it(
    coarse_svelte: SensorDesign,
) -> None:
    """The point usually is closer than on the straight way back, orthogonal to free directions."""
    space = SearchSpace(MIRROR).bind(coarse_svelte)
    region = FeasibleRegion(space, [NoCrossings(coarse_svelte)], ["M1"])
    start = space.to_unit(space.start)
    assert region.allows(start)
    found = slid = 0
    for seed in range(80):
        way = np.random.default_rng(seed).normal(size=space.size)
        wanted = np.clip(start + 1.5 * way / np.linalg.norm(way), 0.0, 1.0)
        placed = region.nearest(wanted, start)
        assert region.allows(placed.point)
        assert ((placed.point >= 0.0) & (placed.point <= 1.0)).all()
        if region.allows(wanted):
            assert placed.point is wanted
            assert np.array_equal(placed.along(way), way)
            continue
        found += 1
        moved = placed.point - wanted
        back = region._bisect(wanted, start).point - wanted
        slid += np.linalg.norm(moved) < 0.9 * np.linalg.norm(back)
        assert placed.normals @ placed.normals.T == pytest.approx(np.eye(len(placed.normals)))
        assert placed.along(moved) == pytest.approx(np.zeros(space.size), abs=1e-6)
    assert found >= 6
    assert slid >= 0.5 * found


def test_other_constraints_are_met_on_the_way_back(coarse_svelte: SensorDesign) -> None:
    space = SearchSpace(MIRROR).bind(coarse_svelte)
    start = space.to_unit(space.start)
    middle = space.names.index("cages.M1.points[13].x")
    most = space.start[middle] + 0.5

    def not_too_far(design: SensorDesign) -> bool:
        return float(design.cages["M1"].current_points()[13][0]) <= most

    region = FeasibleRegion(space, [not_too_far], ["M1"])
    way = np.eye(space.size)[middle]
    placed = region.nearest(start + 0.1 * way, start)
    assert space.from_unit(placed.point)[middle] == pytest.approx(most, abs=0.02)
    assert region.allows(placed.point)
    assert placed.along(way) == pytest.approx(np.zeros(space.size))

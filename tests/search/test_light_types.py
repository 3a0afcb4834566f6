"""The three kinds of light types: one for all, one a group, one a light."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from optisense.design import SensorDesign
from optisense.errors import SearchError
from optisense.search import SearchSpace, run_study, search
from optisense.search.evaluation.outcome import Outcome
from optisense.search.methods import Problem, find, make
from optisense.search.methods._lights import FOR_ALL, FOR_GROUPS, FOR_LIGHTS, LightTypes
from optisense.search.space.search_space import BoundSpace

TYPES = ["osram-topled-black-30", "chanzon-5730", "generic-spot"]


@pytest.fixture(scope="module")
def space(mini: SensorDesign) -> BoundSpace:
    return SearchSpace({"lights.types": TYPES}).bind(mini)


def groups(space: BoundSpace) -> np.ndarray:
    """(n,) which group each light is of."""
    names = [name.split(".")[1] for name in space.names]
    return np.unique(names, return_inverse=True)[1]


def drive(
    space: BoundSpace, score: Callable[[np.ndarray], float], budget: int
) -> list[tuple[str, np.ndarray]]:
    """The stage and the point of each trial, in order."""
    method = make("types", Problem(space, ("score",), budget, seed=1))
    tried: list[tuple[str, np.ndarray]] = []
    while len(tried) < budget and len(points := method.ask()):
        stage = method.stage  # type: ignore[attr-defined]
        tried += [(stage, point) for point in points[: budget - len(tried)]]
        method.tell(points, [Outcome({"score": score(point)}) for point in points])
    return tried


def test_all_of_one_type_come_first_then_all_groups(space: BoundSpace) -> None:
    tried = drive(space, lambda point: float(point.sum()), 200)
    assert len(tried) == len({tuple(point) for _, point in tried}) == 200
    stages = [stage for stage, _ in tried]
    assert stages[:3] == [FOR_ALL] * 3
    assert stages[3:27] == [FOR_GROUPS] * 24
    assert set(stages[27:]) == {FOR_LIGHTS}
    owner = groups(space)
    by_group = {tuple(point[owner == k][0] for k in range(3)) for _, point in tried[:27]}
    assert len(by_group) == 27
    for _, point in tried[:27]:
        assert all(len(set(point[owner == k])) == 1 for k in range(3))


def test_single_lights_are_found_that_groups_cannot_have(space: BoundSpace) -> None:
    """The best has every second light of another type."""
    best = np.arange(space.size) % 2
    tried = drive(space, lambda point: -float(np.abs(point - best).sum()), 800)
    assert any((point == best).all() for _, point in tried)


def test_many_groups_are_climbed(space: BoundSpace) -> None:
    """With a budget for a few combinations of groups only."""
    wanted = np.array([2, 0, 1])[groups(space)]
    tried = drive(space, lambda point: -float(np.abs(point - wanted).sum()), 40)
    chosen = [point for stage, point in tried if stage == FOR_GROUPS]
    assert len(chosen) < 24
    assert any((point == wanted).all() for point in chosen)


def test_a_larger_budget_goes_on_until_all_are_tried(mini: SensorDesign) -> None:
    name = next(iter(mini.lights))
    lights = {f"lights.{name}.lights[{k}].model": TYPES[:2] for k in range(5)}
    result = search(mini, lights, lambda design: 1.0, method="types", budget=6)
    assert len(result.trials) == 1 + 6
    more = run_study(result.study, limit=20)
    assert len(more.trials) == 1 + 20 and more.ended == "the budget is spent"
    every = run_study(result.study, limit=100)
    assert len({trial.vector.tobytes() for trial in every.trials}) == 2**5
    assert len(every.trials) == 1 + 2**5 and every.ended == "the method has finished"


def test_the_usual_budget_is_within_reason(space: BoundSpace) -> None:
    assert find("types").default_budget(space) == max(2 * 27, 4 * space.size)
    assert LightTypes.default_budget(space) < 1000


def test_a_trial_is_a_design_with_these_types(space: BoundSpace) -> None:
    point = np.arange(space.size) % 3
    design = space.apply(point.astype(float))
    made = sorted(group.model for group in design.lights.values() for _ in group.lights)
    assert made == sorted(TYPES[int(k)] for k in point)


def test_other_spaces_are_refused(mini: SensorDesign) -> None:
    other = SearchSpace({"coating.specularity": (0.0, 1.0)}).bind(mini)
    with pytest.raises(SearchError, match="types of lights and nothing else"):
        make("types", Problem(other, ("score",), 100))
    name = next(iter(mini.lights))
    mixed = {
        f"lights.{name}.lights[0].model": TYPES,
        f"lights.{name}.lights[1].model": TYPES[:2],
    }
    with pytest.raises(SearchError, match="the same types"):
        make("types", Problem(SearchSpace(mixed).bind(mini), ("score",), 100))

"""Proposals of a method that are no points of the space are refused before they are stored."""

from __future__ import annotations

from collections.abc import Iterator
from types import ModuleType
from typing import Any, ClassVar

import numpy as np
import pytest

from optisense.design import SensorDesign
from optisense.errors import SearchError
from optisense.search import SearchResult, search
from optisense.search.methods import Method, register
from optisense.search.methods._registry import METHODS

SPACE = {"coating.specularity": (0.0, 0.3), "camera.resolution[0]": (318, 322)}


class Proposing(Method):
    """A method that proposes one generation, which a test gives."""

    name = "proposing"
    summary = "one generation that a test gives"
    proposals: ClassVar[Any]

    def ask(self) -> Any:
        given, self.left = getattr(self, "left", self.proposals), np.empty((0, 2))
        return given

    def tell(self, vectors: object, outcomes: object) -> None:
        pass


@pytest.fixture(autouse=True)
def _registered() -> Iterator[None]:
    with METHODS.forgetting():
        register(Proposing)
        yield


def searched(
    mini: SensorDesign, goals: ModuleType, given: object, monkeypatch: pytest.MonkeyPatch
) -> SearchResult:
    monkeypatch.setattr(Proposing, "proposals", given, raising=False)
    return search(mini, SPACE, goals.brightness, method="proposing", budget=4)


@pytest.mark.parametrize(
    ("given", "place"),
    [
        ([[0.2, 320.0], [0.4, 320.0]], "coating.specularity"),
        ([[np.nan, 320.0]], "coating.specularity"),
        ([[0.1, np.inf]], "camera.resolution[0]"),
        ([[0.1, 319.5]], "camera.resolution[0]"),
    ],
)
def test_points_outside_the_space_are_refused(
    mini: SensorDesign,
    goals: ModuleType,
    given: object,
    place: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with pytest.raises(SearchError, match="method proposing proposes a point outside") as told:
        searched(mini, goals, np.array(given), monkeypatch)
    assert told.value.where == place
    assert "must be repaired" in str(told.value)


@pytest.mark.parametrize(
    ("given", "named"),
    [
        (None, "None"),
        ("middle", "'middle'"),
        ([[0.1, 320.0], [0.1]], r"\[\[0.1, 320.0\], \[0.1\]\]"),
        (np.array([0.1, 320.0]), r"an array \(2,\)"),
        (np.zeros((1, 3)), r"an array \(1, 3\)"),
        (np.zeros((1, 1, 2)), r"an array \(1, 1, 2\)"),
    ],
)
def test_anything_but_points_is_refused(
    mini: SensorDesign,
    goals: ModuleType,
    given: object,
    named: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with pytest.raises(SearchError, match=rf"proposes {named} instead of points \(k, 2\)") as told:
        searched(mini, goals, given, monkeypatch)
    assert "must be repaired" in str(told.value)


def test_rounding_at_the_bounds_is_corrected(
    mini: SensorDesign, goals: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    above = np.nextafter(0.3, 1.0)
    result = searched(mini, goals, [[above, 320.0], [0.1, 321.0 - 1e-12]], monkeypatch)
    assert [trial.vector.tolist() for trial in result.trials[1:]] == [[0.3, 320.0], [0.1, 321.0]]

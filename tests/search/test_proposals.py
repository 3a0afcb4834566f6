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


OUTSIDE = "a point outside the space"


@pytest.mark.parametrize(
    ("given", "named", "place"),
    [
        (np.array([[0.2, 320.0], [0.4, 320.0]]), OUTSIDE, "coating.specularity"),
        (np.array([[np.nan, 320.0]]), OUTSIDE, "coating.specularity"),
        (np.array([[0.1, np.inf]]), OUTSIDE, "camera.resolution[0]"),
        (np.array([[0.1, 319.5]]), OUTSIDE, "camera.resolution[0]"),
        (None, r"None instead of points \(k, 2\)", None),
        ("middle", "'middle' instead of points", None),
        ([[0.1, 320.0], [0.1]], r"\[\[0.1, 320.0\], \[0.1\]\] instead of points", None),
        (np.array([0.1, 320.0]), r"an array \(2,\) instead of points", None),
        (np.zeros((1, 3)), r"an array \(1, 3\) instead of points", None),
        (np.zeros((1, 1, 2)), r"an array \(1, 1, 2\) instead of points", None),
    ],
)
def test_anything_but_points_of_the_space_is_refused(
    mini: SensorDesign,
    goals: ModuleType,
    given: object,
    named: str,
    place: str | None,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with pytest.raises(SearchError, match=f"the method proposing proposes {named}") as told:
        searched(mini, goals, given, monkeypatch)
    assert told.value.where == place
    assert "must be repaired" in str(told.value)


def test_rounding_at_the_bounds_is_corrected(
    mini: SensorDesign, goals: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    above = np.nextafter(0.3, 1.0)
    result = searched(mini, goals, [[above, 320.0], [0.1, 321.0 - 1e-12]], monkeypatch)
    assert [trial.vector.tolist() for trial in result.trials[1:]] == [[0.3, 320.0], [0.1, 321.0]]

"""The contract of search methods, over all of the package."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np
import pytest

from optisense.design import SensorDesign
from optisense.errors import SearchError
from optisense.search import Around, CagePoints
from optisense.search.methods._registry import METHODS
from optisense.search.space.search_space import BoundSpace
from optisense.search.testing import Landscape, MethodContract, general_spaces
from optisense.sensors import gelsight_svelte

COLOURS = ["red", "green", "blue"]


class TestCmaEs(MethodContract):
    method = "cma-es"
    optimum_tolerance = 0.02


class TestRandom(MethodContract):
    method = "random"
    optimum_tolerance = 0.2


class TestGrid(MethodContract):
    method = "grid"
    optimum_tolerance = 0.0
    budget = 45

    def spaces(self) -> dict[str, dict[str, object]]:
        return {name: space for name, space in general_spaces().items() if name != "100 numbers"}

    def test_a_budget_of_one_is_one_trial(self) -> None:
        with pytest.raises(SearchError, match="the budget is 1"):
            self.run(self.spaces()["one number"], lambda share: 0.0, 1)

    def test_a_grid_over_a_hundred_numbers_is_refused(self) -> None:
        with pytest.raises(SearchError, match="steps"):
            self.run(general_spaces()["100 numbers"], lambda share: 0.0)
        many = {
            path: (*bounds, 2)  # type: ignore[misc]
            for path, bounds in general_spaces()["100 numbers"].items()
        }
        with pytest.raises(SearchError, match="1,267,650,600,228,229,401,496,703,205,376 designs"):
            self.run(many, lambda share: 0.0)


class TestPareto(MethodContract):
    method = "pareto"
    objectives = 2


class TestLightColours(MethodContract):
    method = "light-colours"

    def spaces(self) -> dict[str, dict[str, object]]:
        return {
            "one choice": {"lights.red.colour": COLOURS},
            "one number": {"lights.red.flux": (1.0, 5.0, 7)},
            "more than the budget": {
                "lights.*.colour": COLOURS,
                "lights.*.flux": (1.0, 5.0, 5),
            },
        }


class TestTypes(MethodContract):
    method = "types"

    def spaces(self) -> dict[str, dict[str, object]]:
        types = ["smd-3528", "chanzon-5730"]
        return {
            "one light": {"lights.red.lights[0].model": types},
            "two lights": {
                "lights.red.lights[0].model": types,
                "lights.blue.lights[0].model": types,
            },
            "fifteen lights": {"lights.types": types},
        }

    def coordinates(self, space: BoundSpace, design: SensorDesign) -> np.ndarray:
        """Types in no order, as shares: how many lights have the second type."""
        of_second = {
            tuple(light.position)
            for group in design.lights.values()
            for light in group.lights
            if group.model == "chanzon-5730"
        }
        places = [
            space.design.lights[p.variable.group].lights[p.variable.index].position  # type: ignore[union-attr]
            for p in space.parameters
        ]
        return np.array([float(tuple(place) in of_second) for place in places])


class TestGradient(MethodContract):
    """By the rays of a real sensor, since only they have slopes."""

    method = "gradient"
    budget = 4
    rerun_tolerance = 1e-4  # slopes are added up by several threads at once, in whatever order
    options: Mapping[str, Any] = {"resolution": 48}

    def design(self) -> SensorDesign:
        return svelte()

    def spaces(self) -> dict[str, dict[str, object]]:
        return {
            "one number that is at its bound": {"camera.fov": (40.146, 42.0)},
            "two numbers": {"camera.position.x": (-0.5, 0.5), "camera.position.z": (-0.5, 0.5)},
            "nine numbers": {
                "cages.M1.points": CagePoints(Around(0.3), points=tuple(range(9)), axes="x")
            },
        }

    def landscapes(self) -> dict[str, str | Landscape]:
        return {"aoap": "aoap"}  # others take the same ways through the method

    def settings(self) -> dict[str, Any]:
        return {"ray_resolution": [48, 36]}


@cache
def svelte() -> SensorDesign:
    return gelsight_svelte(tessellation=1.0, m1_grid=(60, 15))


def test_no_method_of_the_package_goes_without_the_contract() -> None:
    tested = {each.method for each in MethodContract.__subclasses__()}
    assert set(METHODS.built_in) <= tested

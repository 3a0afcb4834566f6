"""Points of a search that cannot be built: detached parts and lights, vanished plates.

The points are winners of `benchmarks/single_parameters.py` that a person would not accept.
"""

from __future__ import annotations

import pickle
from functools import cache

import numpy as np
import pytest

from optisense import sensors
from optisense.search.evaluation.evaluator import DesignEvaluator
from optisense.search.evaluation.robust import RobustEvaluator
from optisense.search.space.buildable import PartsInContact
from optisense.search.space.manufacturing import ManufacturingErrors
from optisense.search.space.search_space import SearchSpace

RAYS = {"ray_resolution": (40, 30)}

load = cache(sensors.load)


def evaluator(name: str, path: str, apart: bool = True) -> DesignEvaluator:
    """Of a space with one parameter that reaches far."""
    space = SearchSpace({path: (1.0, 4.0) if path.endswith("ior") else (-200.0, 200.0)})
    bound = space.bind(load(name), tried=False)
    return DesignEvaluator(bound, ["aoap"], RAYS, apart=apart)


def failure(name: str, path: str, value: float) -> str | None:
    return evaluator(name, path)(np.array([value]), 0).failure


@pytest.mark.parametrize(
    ("name", "path", "value", "said"),
    [
        ("gelbelt", "parts.window.shift.x", -100.0, "'window' and 'film' lie on one another"),
        ("gelbelt", "parts.window.shift.z", 10.0, "'window' and 'film' lie on one another"),
        ("gelbelt", "parts.tape.shift.y", -100.0, "'gel' and 'tape' lie on one another"),
        ("gelbelt", "parts.tape.turn.z", -60.0, "'gel' and 'tape' lie on one another"),
        ("gelbelt", "parts.gel.shift.z", 30.0, "'gel' lie on one another"),
        ("gelbelt", "parts.skin.shift.x", -30.0, "'skin' and 'gel' lie on one another"),
        ("gelbelt", "parts.skin.shift.z", -3.0, "'skin' and 'gel' lie on one another"),
        ("gelsight360", "parts.shell.shift.z", -100.0, "'gel' and 'shell' lie on one another"),
        ("gelsight360", "parts.boards.shift.z", -30.0, "of group 'lg1' sits on part 'boards'"),
        ("gelsight360", "parts.boards.turn.z", -60.0, "of group 'lg1' sits on part 'boards'"),
        ("gelsight-mini-ideal", "parts.tray.shift.z", 1.0, "'tray' and 'guide' lie on one another"),
        (
            "gelsight-mini-ideal",
            "parts.guide.shift.y",
            -30.0,
            "'tray' and 'guide' lie on one another",
        ),
        ("gelsight-mini-ideal", "cages.skin.points[0].z", -14.25, "cuts into part 'tray'"),
        ("gelsight-mini-ideal", "cages.skin.points[0].x", -42.6, "has come off part 'tray'"),
        ("gelsight-mini-ideal", "cages.skin.points[17].y", 40.0, "reaches"),
        ("gelsight-mini-ideal-cylindrical", "cages.skin.points[26].x", 45.0, "reaches"),
        ("gelsight-mini-ideal-spherical", "cages.skin.points[17].y", 40.0, "reaches"),
        ("gelsight-mini-ideal", "lights.green.shift.z", 2.5, "inside part 'tray'"),
        ("gelsight-mini-ideal", "lights.green.lights[0].shift.z", 2.5, "light 0 of group 'green'"),
        ("gelsight-mini-ideal", "parts.guide.turn.z", 3.0, "inside part 'guide'"),
        ("gelbelt", "materials.acrylic.ior", 1.0, "material 'acrylic' is air"),
        ("gelbelt", "materials.clear-tape.ior", 1.2, "no transparent solid"),
        ("gelbelt", "materials.air-film.ior", 1.4, "material 'air-film' is a solid"),
        ("gelsight-mini-ideal", "materials.silicone-xp565.ior", 4.0, "no clear elastomer"),
        ("gelsight-mini-ideal", "materials.silicone-xp565.ior", 1.0, "'silicone-xp565' is air"),
    ],
)
def test_nobody_could_build_it(name: str, path: str, value: float, said: str) -> None:
    assert said in str(failure(name, path, value))


@pytest.mark.parametrize(
    ("name", "path", "value"),
    [
        # The tray is 1.5 mm wider than the gel and the guide: they may slide on it.
        ("gelsight-mini-ideal", "parts.tray.shift.x", 1.0),
        ("gelsight-mini-ideal", "parts.guide.turn.z", 0.3),
        # These lights are cast into the shell.
        ("gelsight360", "lights.lg1.shift.z", 0.2),
        ("gelsight-mini-ideal", "lights.green.shift.x", -1.0),
        # Nothing touches the mirror.
        ("gelsight-svelte", "parts.M2.shift.x", 0.5),
        # The bottom of the gel becomes smaller and stays flat.
        ("gelsight-mini-ideal", "cages.skin.points[0].x", -10.0),
        ("gelsight-mini-ideal", "cages.skin.points[14].z", 3.0),
        ("gelsight-mini-ideal", "materials.silicone-xp565.ior", 1.55),
    ],
)
def test_what_can_be_built_is_scored(name: str, path: str, value: float) -> None:
    assert failure(name, path, value) is None


def test_parts_that_are_moved_together_keep_their_contact() -> None:
    belt = load("gelbelt")
    paths = [f"parts.{part}.shift.x" for part in ("window", "film")]
    space = SearchSpace(dict.fromkeys(paths, (-20.0, 20.0))).bind(belt, tried=False)
    rest = PartsInContact(belt, {"window", "film"})
    assert rest(space.apply(np.array([3.0, 3.0]))) is None
    assert "'window'" in str(rest(space.apply(np.array([3.0, 0.0]))))


def test_parts_may_part_where_they_may_cross() -> None:
    free = evaluator("gelbelt", "parts.window.shift.x", apart=False)
    assert free(np.array([-100.0]), 0).failure is None


def test_it_is_the_same_in_another_process() -> None:
    one = evaluator("gelsight-mini-ideal", "parts.guide.shift.z")
    point = np.array([10.0])
    expected = one(point, 0).failure
    assert expected is not None
    assert pickle.loads(pickle.dumps(one))(point, 0).failure == expected


def test_manufacturing_errors_are_no_part_of_the_design() -> None:
    """A window that is glued on two millimetres aside has lost no seat; one designed so has."""
    usual = evaluator("gelbelt", "parts.window.shift.y")
    robust = RobustEvaluator(usual, ManufacturingErrors({"parts.window.shift.y": 1.0}), 0, 4)
    assert robust(np.array([0.0]), 0).failure is None
    assert "'window' and 'film' lie on one another" in str(robust(np.array([5.0]), 0).failure)
